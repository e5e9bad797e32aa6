#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/dynamics/frame_expectation.h"
#include "dmslam/map/map.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {

struct MovedOptions {
  double chi2 = 4.0 * kChiSquared2Dof;  ///< a strong match farther off than this speaks for motion
  double near_chi2 = 16.0;    ///< a match near its place that is rejected by so much speaks for motion too...
  int near_distance = 60;     ///< ...where it looks like the landmark [bits]
  double radius_rad = 0.057;  ///< how far a landmark that is missed in its place is looked for
  int max_distance = 40;      ///< bits; a match elsewhere must be strong...
  double ratio = 0.7;         ///< ...and alone
};

/// Finds the landmarks that a frame with a known pose sees elsewhere than the map says.
class MovedLandmarks {
 public:
  explicit MovedLandmarks(const MovedOptions& options) : options_(options) {}

  /// Marks their features as moving and returns their ids (valid until the next call): first those of the
  /// matches that the pose rejected, then those of `expected` that are found farther off.
  const std::vector<LandmarkId>& Find(const Map& map, std::span<const ExpectedLandmark> expected,
                                      std::span<const RejectedMatch> rejected, TrackedFrame* frame);
  /// The features that showed them, parallel to what Find() returned.
  const std::vector<uint16_t>& features() const { return features_; }

 private:
  void JudgeRejected(const Map& map, std::span<const RejectedMatch> rejected, TrackedFrame* frame);
  void LookAround(const Map& map, const ExpectedLandmark& expected, TrackedFrame* frame);

  MovedOptions options_;
  std::vector<LandmarkId> moved_;
  std::vector<uint16_t> features_;
  std::vector<LandmarkId> used_;  ///< workspace: landmarks that are accounted for
  std::vector<uint8_t> taken_;    ///< workspace: features that are
};

}  // namespace dmslam
