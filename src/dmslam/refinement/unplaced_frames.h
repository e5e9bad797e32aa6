#pragma once

#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "dmslam/map/tracked_frame.h"

namespace dmslam {

/// A frame that waits for a pose: features alone, as many wait for long.
struct WaitingFrame {
  uint32_t index = 0;
  int64_t stamp_ns = 0;
  FeatureSet features;

  explicit WaitingFrame(const TrackedFrame& frame)
      : WaitingFrame(frame.index, frame.stamp_ns, frame.features->set) {}
  WaitingFrame(uint32_t frame_index, int64_t frame_stamp_ns, FeatureSet frame_features)
      : index(frame_index), stamp_ns(frame_stamp_ns), features(std::move(frame_features)) {}
  TrackedFrame ToTracked(const Camera& camera, const Pyramid& pyramid) && {
    return {index, stamp_ns, MakeFrameFeatures(std::move(features), camera, pyramid)};
  }
};

/// Frames that had no pose when they came, in order. Beyond a number, and two minutes, the oldest are
/// forgotten.
class UnplacedFrames {
 public:
  explicit UnplacedFrames(int max_frames) : max_frames_(static_cast<size_t>(max_frames)) {}

  bool empty() const { return frames_.empty(); }
  size_t size() const { return frames_.size(); }

  void Keep(WaitingFrame frame);
  /// Frames of any time.
  void PutBack(std::vector<WaitingFrame> frames);
  /// The newest; there must be one.
  WaitingFrame TakeNewest();
  /// Those from frame `index` on.
  std::deque<WaitingFrame> TakeFrom(uint32_t index);

  /// A frame that was looked at and not found waits until ReturnSetAside(), when it is tried again. They are
  /// set aside from the newest back.
  void SetAside(WaitingFrame frame) { set_aside_.push_front(std::move(frame)); }
  void ReturnSetAside();
  /// One of them was found after all.
  void ForgetSetAside(uint32_t index) {
    std::erase_if(set_aside_, [index](const WaitingFrame& frame) { return frame.index == index; });
  }

 private:
  void Bound();

  size_t max_frames_;
  std::deque<WaitingFrame> frames_;
  std::deque<WaitingFrame> set_aside_;
};

}  // namespace dmslam
