#include "frontend/incoming_frames.h"

#include <algorithm>
#include <utility>

#include "dmslam/util/check.h"
#include "frontend/camera_turns.h"

namespace dmslam {
namespace {

constexpr int64_t kMaxWaitNs = 100'000'000;  // by their stamps

bool GoesBack(const Frame& from, const Frame& to) {
  return to.frame_index <= from.frame_index || to.stamp_ns <= from.stamp_ns;
}

}  // namespace

std::optional<IncomingFrames::Verdict> IncomingFrames::WhyNotNew(const Frame& frame) const {
  if (frame.frame_index >= CameraTurns::kTheEnd) return Verdict::kOutOfRange;
  if (IsOld(frame)) return in_work() ? Verdict::kKnown : Verdict::kOld;
  const auto is_known = [&](const ReceivedFrame& waiting) {
    if (waiting.frame.frame_index == frame.frame_index) return true;
    return mode_ == PlaybackMode::kRealtime && newest_ && GoesBack(waiting.frame, frame);
  };
  if (std::ranges::any_of(waiting_, is_known)) return Verdict::kKnown;
  return std::nullopt;
}

bool IncomingFrames::IsOld(const Frame& frame) const {
  if (!newest_) return false;
  const bool goes_back =
      mode_ == PlaybackMode::kRealtime && newest_->stamp_ns && frame.stamp_ns <= *newest_->stamp_ns;
  return frame.frame_index <= newest_->index || goes_back;
}

IncomingFrames::Verdict IncomingFrames::Hear(ReceivedFrame received, int64_t now_ns) {
  const Frame& frame = received.frame;
  if (const std::optional<Verdict> known = WhyNotNew(frame)) {
    if (known != Verdict::kOutOfRange) order_.OnRepeat();
    return *known;
  }
  if (mode_ == PlaybackMode::kLockstep && in_work()) order_.OnPlayerWaits();
  if (!order_.Takes({frame.frame_index, frame.stamp_ns}, NewestHeard(), now_ns)) return Verdict::kFarAhead;
  ++received_;
  MakeRoomFor(frame);
  waiting_.push_back(std::move(received));
  return Verdict::kWaits;
}

/// Where too many wait, all of them make room: whoever is too slow for long is late by one frame then, and
/// not always by all that may wait. Before any was taken out nobody knows which is right of two that go back,
/// and the later one stays.
void IncomingFrames::MakeRoomFor(const Frame& frame) {
  const auto is_old = [&](const ReceivedFrame& waiting) {
    return mode_ == PlaybackMode::kLockstep || frame.stamp_ns - waiting.frame.stamp_ns >= kMaxWaitNs ||
           GoesBack(waiting.frame, frame);
  };
  if (std::ranges::none_of(waiting_, is_old)) return;
  skipped_ += std::ssize(waiting_);
  waiting_.clear();
}

/// None: none was, or its stamp is not known.
std::optional<PlayOrder::Place> IncomingFrames::NewestHeard() const {
  if (!waiting_.empty())
    return PlayOrder::Place{waiting_.back().frame.frame_index, waiting_.back().frame.stamp_ns};
  if (!newest_ || !newest_->stamp_ns) return std::nullopt;
  return PlayOrder::Place{newest_->index, *newest_->stamp_ns};
}

ReceivedFrame IncomingFrames::Take() {
  DMSLAM_CHECK(!waiting_.empty(), "a frame that is taken out has waited");
  ReceivedFrame taken = std::move(waiting_.front());
  waiting_.pop_front();
  newest_ = {taken.frame.frame_index, taken.frame.stamp_ns, true};
  return taken;
}

/// A player that was started again, too, begins from the front until it hears how far we are.
void IncomingFrames::GoOnBehind(uint32_t frame_index) {
  newest_ = {frame_index, {}, false};
  std::erase_if(waiting_,
                [&](const ReceivedFrame& waiting) { return waiting.frame.frame_index <= frame_index; });
}

void IncomingFrames::Fill(FrontendStatus* status) const {
  status->frames_received = received_;
  status->frames_skipped = skipped_;
  if (newest_) status->frame_index = static_cast<int32_t>(newest_->index);
}

}  // namespace dmslam
