#pragma once

#include <span>
#include <vector>

#include "dmslam/dynamics/frame_expectation.h"
#include "dmslam/dynamics/landmark_votes.h"
#include "dmslam/map/map.h"

namespace dmslam {

struct HiddenPlaceOptions {
  double distance = 40;  ///< so few bits are asked of a match where nothing else of the map is found...
  double distance_slope = 200;  ///< ...and so many more are allowed, times the share that is found around it

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("tracking.hidden_distance", distance, 0, 256, "bits",
             "descriptor distance allowed where nothing of the map is found around");
    v.Number("tracking.hidden_distance_slope", distance_slope, 0, 10000, "bits",
             "more of it, times the share of the map that is found around");
  }
};

/// What is found where little else of the map is found is mostly found by chance, on whoever hides the map:
/// within the search radius, and so in agreement with any pose, right or wrong. It must look like its
/// landmark more closely than a match among many others.
class HiddenPlaces {
 public:
  explicit HiddenPlaces(const HiddenPlaceOptions& options) : options_(options) {}

  /// Takes such matches from the frame. `expected`: all that it should see.
  void DropMatches(const Map& map, std::span<const ExpectedLandmark> expected, const LandmarkVotes& votes,
                   TrackedFrame* frame);

 private:
  HiddenPlaceOptions options_;
  LandmarkSet matched_;  ///< workspace
};

}  // namespace dmslam
