#include "viewer/event_hub.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr std::array<const char*, kNumEventKinds> kNames = {"status", "pose", "features", "map", "playback"};

}  // namespace

EventHub::EventHub() : fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  DMSLAM_CHECK(fd_ >= 0, "eventfd is part of every Linux");
}

EventHub::~EventHub() { close(fd_); }

void EventHub::ClearFd() {
  eventfd_t count = 0;
  eventfd_read(fd_, &count);
}

std::string EventHub::Listener::Next(std::chrono::milliseconds wait) {
  std::unique_lock lock(mutex_);
  const auto any = [this] {
    return closed_ ||
           std::any_of(waiting_.begin(), waiting_.end(), [](const auto& text) { return text != nullptr; });
  };
  if (!changed_.wait_for(lock, wait, any)) return ":\n\n";
  if (closed_) return {};
  std::string all;
  for (auto& text : waiting_) {
    if (text) all += *text;
    text.reset();
  }
  return all;
}

int64_t EventHub::Listener::skipped() const {
  const std::lock_guard lock(mutex_);
  return skipped_;
}

void EventHub::Put(Listener* listener, size_t slot, const std::shared_ptr<const std::string>& text) {
  {
    const std::lock_guard lock(listener->mutex_);
    if (listener->waiting_[slot]) ++listener->skipped_;
    listener->waiting_[slot] = text;
  }
  listener->changed_.notify_one();
}

std::shared_ptr<EventHub::Listener> EventHub::Join() {
  const std::lock_guard lock(mutex_);
  if (closed_ || listeners_.size() >= kMostListeners) return nullptr;
  auto listener = std::make_shared<Listener>();
  listener->waiting_ = newest_;
  listeners_.push_back(listener);
  joined_or_left_.notify_all();
  return listener;
}

void EventHub::Leave(const std::shared_ptr<Listener>& listener) {
  const std::lock_guard lock(mutex_);
  const auto it = std::find(listeners_.begin(), listeners_.end(), listener);
  if (it == listeners_.end()) return;
  skipped_by_former_ += listener->skipped();
  listeners_.erase(it);
  joined_or_left_.notify_all();
}

void EventHub::Send(EventKind kind, const std::string& json, CameraId camera) {
  const auto index = static_cast<size_t>(kind);
  const auto text = std::make_shared<const std::string>("event: " + std::string(kNames[index]) +
                                                        "\ndata: " + json + "\n\n");
  const size_t slot = std::min(camera, kMaxCameras - 1) * kNumEventKinds + index;
  const std::lock_guard lock(mutex_);
  newest_[slot] = text;
  for (const auto& listener : listeners_) Put(listener.get(), slot, text);
  eventfd_write(fd_, 1);
}

void EventHub::Close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  for (const auto& listener : listeners_) {
    {
      const std::lock_guard inner(listener->mutex_);
      listener->closed_ = true;
    }
    listener->changed_.notify_one();
  }
}

size_t EventHub::num_listeners() const {
  const std::lock_guard lock(mutex_);
  return listeners_.size();
}

bool EventHub::WaitForListeners(size_t count, std::chrono::milliseconds patience) const {
  std::unique_lock lock(mutex_);
  return joined_or_left_.wait_for(lock, patience, [&] { return listeners_.size() == count; });
}

int64_t EventHub::skipped() const {
  const std::lock_guard lock(mutex_);
  int64_t sum = skipped_by_former_;
  for (const auto& listener : listeners_) sum += listener->skipped();
  return sum;
}

}  // namespace dmslam
