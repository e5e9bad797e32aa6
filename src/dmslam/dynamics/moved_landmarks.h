#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/dynamics/frame_expectation.h"
#include "dmslam/map/map.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {

/// Finds the landmarks that a frame with a known pose sees elsewhere than the map says.
class MovedLandmarks {
 public:
  /// Marks their features as moving and returns their ids (valid until the next call): first those of the
  /// matches that the pose rejected, then those of `expected` that are found farther off.
  const std::vector<LandmarkId>& Find(const Map& map, std::span<const ExpectedLandmark> expected,
                                      std::span<const RejectedMatch> rejected, TrackedFrame* frame);
  /// The features that showed them, parallel to what Find() returned.
  const std::vector<uint16_t>& features() const { return features_; }

 private:
  void JudgeRejected(const Map& map, std::span<const RejectedMatch> rejected, TrackedFrame* frame);
  void LookAround(const Map& map, const ExpectedLandmark& expected, TrackedFrame* frame);

  // A match near its place that the pose rejects by so much speaks for motion, where it looks like the
  // landmark.
  static constexpr double kNearChi2 = 16.0;
  static constexpr int kNearDistance = 60;  // bits
  // One that is missed in its place and found so near speaks for motion too, where it is far enough from its
  // place, looks like the landmark, and is the only one that does.
  static constexpr double kRadiusRad = 0.057;
  static constexpr double kChi2 = 4.0 * kChiSquared2Dof;
  static constexpr int kMaxDistance = 40;  // bits
  static constexpr double kRatio = 0.7;    // of the best distance by the second best

  std::vector<LandmarkId> moved_;
  std::vector<uint16_t> features_;
  LandmarkSet used_;            ///< workspace: landmarks that are accounted for
  std::vector<uint8_t> taken_;  ///< workspace: features that are
};

}  // namespace dmslam
