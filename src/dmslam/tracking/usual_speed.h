#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "dmslam/map/map.h"
#include "dmslam/tracking/motion_model.h"

namespace dmslam {

/// How fast a camera usually goes [depths of the scene per second], measured over 0.2 s between poses that
/// were believed: the speed that it stays below for 80 % of the time. When somebody who was mapped while he
/// stood begins to walk, the camera seems to go with him, and mostly faster than that. Motion more than about
/// half a minute old counts for less and less.
class UsualSpeed {
 public:
  static constexpr int64_t kShortestNs = 195'000'000;  ///< 0.2 s, stamps being a little off

  UsualSpeed();

  /// A pose that is believed. Where it is too far from the ones before, those are forgotten: the camera was
  /// found again, or goes faster now.
  void OnPose(const Map& map, const PlacedPose& pose, int64_t stamp_ns);
  /// The next pose does not follow from those before.
  void Interrupt() { recent_.clear(); }

  /// Whether the camera cannot have come to the pose from the newest believed one that is at least 0.2 s old.
  /// It may go 2.5 times as fast as usual for half a second, and half of that afterwards. False from another
  /// map.
  bool IsTooFar(const Map& map, const PlacedPose& pose, int64_t stamp_ns) const;
  /// The same for `moved` [depths of the scene] in `seconds`. False while less than 1.5 s of motion is known.
  bool IsTooFar(double moved, double seconds) const;
  /// The same for frames that are placed late, at any time of the run: by the fastest that was usual, of
  /// which they may go 2 times as fast.
  bool WasTooFar(double moved, double seconds) const;

 private:
  struct Recent {
    PlacedPose pose;
    int64_t stamp_ns = 0;
  };
  struct Step {
    double moved = 0;  ///< depths of the scene
    double seconds = 0;
  };
  static constexpr size_t kBins = 96;

  std::optional<Step> StepTo(const Map& map, const PlacedPose& pose, int64_t stamp_ns) const;
  void Count(double speed, double seconds);
  void FindUsual();

  std::vector<Recent> recent_;           ///< in the order of their stamps
  std::array<double, kBins> seconds_{};  ///< at which speed; the width of bins grows with the speed
  double known_s_ = 0;                   ///< their sum
  std::optional<double> usual_;          ///< [depths/s]; none: too little is known
  std::optional<double> most_usual_;     ///< the largest it was
};

}  // namespace dmslam
