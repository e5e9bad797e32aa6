#pragma once

#include <cstdint>
#include <cstdlib>
#include <optional>

namespace dmslam {

/// When a frontend tells what its frames said of landmarks: before each keyframe, and from time to time.
/// While the map grows back, where the time of the frames runs backwards, that is counted apart.
class EvidenceSchedule {
 public:
  enum class Way : uint8_t { kForward, kBack };

  explicit EvidenceSchedule(int64_t every_ns) : every_ns_(every_ns) {}

  /// A frame that was placed, and becomes a `keyframe` or does not: whether it is told now. The first frame
  /// of a way has nothing to tell unless it becomes one.
  bool IsDueAt(int64_t stamp_ns, bool keyframe, Way way) {
    std::optional<int64_t>& told_ns = way == Way::kForward ? told_ns_ : told_back_ns_;
    const int64_t since_ns = std::abs(stamp_ns - told_ns.value_or(stamp_ns));
    const bool due = keyframe || since_ns >= every_ns_;
    if (!told_ns || due) told_ns = stamp_ns;
    return due;
  }

 private:
  int64_t every_ns_;
  std::optional<int64_t> told_ns_, told_back_ns_;  ///< when it was told last
};

}  // namespace dmslam
