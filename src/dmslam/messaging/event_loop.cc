#include "dmslam/messaging/event_loop.h"

#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>

#include "dmslam/util/check.h"

namespace dmslam {

EventLoop::EventLoop() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, &former_mask_);
  signal_fd_ = signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC);
  DMSLAM_CHECK(signal_fd_ >= 0, "signalfd is part of every Linux");
}

EventLoop::~EventLoop() {
  close(signal_fd_);
  pthread_sigmask(SIG_SETMASK, &former_mask_, nullptr);
}

void EventLoop::Watch(int fd, std::function<void()> on_readable) {
  watched_.push_back({fd, std::move(on_readable)});
}

bool EventLoop::PumpOnce(int64_t deadline_ns) {
  std::vector<pollfd> fds = {{signal_fd_, POLLIN, 0}};
  for (const Watched& watched : watched_) fds.push_back({watched.fd, POLLIN, 0});
  const int64_t now = now_ns();
  const int64_t wait_ns = deadline_ns <= now ? 0 : deadline_ns - now;
  const timespec timeout{wait_ns / 1'000'000'000, wait_ns % 1'000'000'000};
  const bool forever = deadline_ns == INT64_MAX;
  if (ppoll(fds.data(), fds.size(), forever ? nullptr : &timeout, nullptr) > 0) {
    if (fds[0].revents != 0) TakeSignal();
    for (size_t i = 0; i < watched_.size(); ++i) {
      if (fds[i + 1].revents != 0) watched_[i].on_readable();
    }
  }
  return stop_signal_ == 0;
}

void EventLoop::TakeSignal() {
  signalfd_siginfo info;
  if (read(signal_fd_, &info, sizeof(info)) == static_cast<ssize_t>(sizeof(info))) {
    stop_signal_ = static_cast<int>(info.ssi_signo);
  }
}

int64_t EventLoop::now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

int64_t EventLoop::wall_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace dmslam
