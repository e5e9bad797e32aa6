#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "dmslam/dataset/frame_source.h"

namespace dmslam {

/// Which frame of a recording is played next, and when: one after the other at the recorded rate, some left
/// out. Until the next one is made due, time is counted from the first of them.
class PlaySchedule {
 public:
  /// `order`: indices into the source, not empty. `speed`: factor on the recorded rate; 0: each frame is due
  /// at once. The source outlives this.
  PlaySchedule(const FrameSource* source, std::vector<size_t> order, double speed)
      : source_(source), order_(std::move(order)), speed_(speed) {}

  size_t size() const { return order_.size(); }
  bool IsOver() const { return position_ >= order_.size(); }
  /// How many frames have had their turn.
  size_t position() const { return position_; }
  /// Index into the source of the first frame, and of the one that had its turn last (of none: the first).
  size_t first() const { return order_.front(); }
  size_t last() const { return order_[std::max<size_t>(position_, 1) - 1]; }

  /// When the next frame is due; there must be one.
  int64_t due_ns() const {
    if (speed_ <= 0) return start_ns_;
    const int64_t since_first = source_->StampNs(order_[position_]) - source_->StampNs(order_.front());
    return start_ns_ + static_cast<int64_t>(static_cast<double>(since_first) / speed_);
  }
  bool IsDue(int64_t now_ns) const { return !IsOver() && now_ns >= due_ns(); }
  /// The next frame, and by it all that follow, is due then.
  void MakeDue(int64_t at_ns) {
    if (!IsOver()) start_ns_ += at_ns - due_ns();
  }
  /// The same where it was due earlier.
  void MakeDueNoEarlier(int64_t at_ns) {
    if (!IsOver() && due_ns() < at_ns) MakeDue(at_ns);
  }

  /// The next frame has its turn: its index into the source. There must be one.
  size_t Take(int64_t now_ns) {
    late_ms_ = static_cast<double>(now_ns - due_ns()) * 1e-6;
    return order_[position_++];
  }
  /// By how much the one that had its turn last came late.
  double late_ms() const { return late_ms_; }

  /// Where all up to the frame of this number have had their turn.
  size_t PositionBehind(uint32_t frame_index) const {
    const auto next =
        std::upper_bound(order_.begin(), order_.end(), frame_index,
                         [this](uint32_t frame, size_t index) { return frame < source_->FrameIndex(index); });
    return static_cast<size_t>(next - order_.begin());
  }
  /// All before that position have had their turn; size(): all.
  void GoTo(size_t position) { position_ = position; }

 private:
  const FrameSource* source_;
  std::vector<size_t> order_;
  double speed_;
  size_t position_ = 0;   ///< next of `order_`
  int64_t start_ns_ = 0;  ///< when the first of them is due, or was
  double late_ms_ = 0;
};

}  // namespace dmslam
