#include "dmslam/refinement/unplaced_frames.h"

#include <algorithm>
#include <iterator>

namespace dmslam {
namespace {

// Frames are placed beside others, and of those the refiner keeps the newest two minutes
// (FrameRefinerOptions). A camera that is lost now and then in a run of hours would fill the memory with
// older ones.
constexpr int64_t kMaxAgeNs = 120'000'000'000;

}  // namespace

void UnplacedFrames::Keep(WaitingFrame frame) {
  frames_.push_back(std::move(frame));
  Bound();
}

void UnplacedFrames::PutBack(std::vector<WaitingFrame> frames) {
  for (WaitingFrame& frame : frames) frames_.push_back(std::move(frame));
  std::sort(frames_.begin(), frames_.end(),
            [](const WaitingFrame& a, const WaitingFrame& b) { return a.index < b.index; });
  Bound();
}

void UnplacedFrames::Bound() {
  const auto is_forgotten = [this] {
    return frames_.size() > max_frames_ || frames_.back().stamp_ns - frames_.front().stamp_ns > kMaxAgeNs;
  };
  while (!frames_.empty() && is_forgotten()) frames_.pop_front();
}

WaitingFrame UnplacedFrames::TakeNewest() {
  WaitingFrame frame = std::move(frames_.back());
  frames_.pop_back();
  return frame;
}

std::deque<WaitingFrame> UnplacedFrames::TakeFrom(uint32_t index) {
  const auto first = std::find_if(frames_.begin(), frames_.end(),
                                  [index](const WaitingFrame& frame) { return frame.index >= index; });
  std::deque<WaitingFrame> taken(std::make_move_iterator(first), std::make_move_iterator(frames_.end()));
  frames_.erase(first, frames_.end());
  return taken;
}

void UnplacedFrames::ReturnSetAside() {
  for (WaitingFrame& frame : std::exchange(set_aside_, {})) frames_.push_back(std::move(frame));
}

}  // namespace dmslam
