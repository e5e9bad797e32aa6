#include "frontend/play_order.h"

namespace dmslam {
namespace {

constexpr int64_t kLeap = 100;  // numbers of frames
constexpr int64_t kLeapNs = 10'000'000'000;
constexpr int64_t kSaidForNs = 100'000'000;
constexpr int64_t kSilenceNs = 5'000'000'000;

bool GoesOn(const PlayOrder::Place& frame, const PlayOrder::Place& before) {
  return int64_t{frame.index} - before.index <= kLeap && frame.stamp_ns - before.stamp_ns <= kLeapNs;
}

}  // namespace

bool PlayOrder::Takes(const Place& frame, const std::optional<Place>& newest, int64_t now_ns) {
  end_.reset();
  if (!newest || GoesOn(frame, *newest)) {
    leap_.reset();
    return true;
  }
  const bool said_before = leap_ && frame.index >= leap_->newest.index &&
                           frame.stamp_ns >= leap_->newest.stamp_ns && GoesOn(frame, leap_->newest);
  if (said_before && now_ns - leap_->since_ns >= kSaidForNs) {
    leap_.reset();
    return true;
  }
  leap_ = {frame, said_before ? leap_->since_ns : now_ns};
  return false;
}

void PlayOrder::OnEnd(const EndOfSequence& end, int64_t now_ns) {
  const bool same = end_ && end_->frames_published == end.frames_published &&
                    end_->last_frame_index == end.last_frame_index;
  if (!same) {
    end_ = {end.frames_published, end.last_frame_index, now_ns, false};
  } else if (now_ns - end_->since_ns >= kSaidForNs) {
    end_->certain = true;
  }
}

bool PlayOrder::IsOver(int64_t now_ns) const {
  return end_ && (end_->certain || now_ns - end_->since_ns >= kSilenceNs);
}

}  // namespace dmslam
