#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "dmslam/map/map.h"
#include "dmslam/tracking/motion_model.h"

namespace dmslam {

/// How fast a camera usually goes: of all poses that were believed, in depths of the scene per second, over
/// 0.2 s each. What takes a camera along, as somebody who was mapped while he stood and begins to walk, is
/// mostly faster. Keeps a histogram in which old times count for less.
class UsualSpeed {
 public:
  UsualSpeed();

  /// A pose that is believed. After a step that is too far for it, it is measured from there: it was found
  /// again, or goes faster now.
  void OnPose(const Map& map, const PlacedPose& pose, int64_t stamp_ns);
  /// The next pose does not follow from those before.
  void Interrupt() { recent_.clear(); }

  /// Whether the pose is farther away than the camera can have come: from where it was 0.2 s before, or when
  /// it was believed last if that is longer ago. For half a second it may hurry, and then it goes half
  /// as fast.
  bool IsTooFar(const Map& map, const PlacedPose& pose, int64_t stamp_ns) const;
  /// The same of so many depths of the scene in so much time; `hurry`: so many times as fast as usual.
  /// Nothing is too far while too little is known.
  bool IsTooFar(double moved, double seconds, double hurry = kHurry) const;

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
  static constexpr double kHurry = 2.5;

  std::optional<Step> StepTo(const Map& map, const PlacedPose& pose, int64_t stamp_ns) const;
  void Count(double speed, double seconds);
  void FindUsual();

  std::vector<Recent> recent_;           ///< in the order of their stamps
  std::array<double, kBins> seconds_{};  ///< at which speed; the width of bins grows with the speed
  double known_s_ = 0;                   ///< their sum
  std::optional<double> usual_;          ///< [depths/s]; none: too little is known
};

}  // namespace dmslam
