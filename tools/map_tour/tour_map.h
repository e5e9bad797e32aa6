#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "dmslam/map/map_editor.h"
#include "dmslam/map/proposals.h"
#include "dmslam/util/random.h"

namespace dmslam {

struct TourOptions {
  size_t keyframes = 5000;
  size_t landmarks = 300'000;
  size_t features = 0;  ///< of a keyframe, at least; those beyond what it sees of the map see nothing
  uint64_t seed = 1;
};

/// A made-up map of a walk through the aisles of a large hall, as a mapper would have built it: keyframe by
/// keyframe, with landmarks on shelves, floor and ceiling, some people, and a loop at the end. Nothing in it
/// was ever seen; it is as large as is wished.
class TourMap {
 public:
  TourMap(const TourOptions& options, uint32_t session);
  /// See Map; to be said first.
  void KeepFeaturesIn(std::shared_ptr<FeatureStore> store) { map_.KeepFeaturesIn(std::move(store)); }

  bool done() const { return next_ >= options_.keyframes; }
  /// Adds the next keyframe with its landmarks and returns the change.
  MapDelta Step();
  /// Applies a correction, as a mapper would, and returns the change.
  MapDelta Correct(const LoopAnswer& answer);
  const Map& map() const { return map_; }
  static Camera TourCamera();

 private:
  struct Corner {
    Eigen::Vector2d at;
    double walked = 0;  ///< along the way [m]
  };
  Rigid3d PoseAt(double walked) const;
  Eigen::Vector2d PlaceAt(double walked) const;
  Landmark MakeLandmark(const Keyframe& keyframe);
  Descriptor MakeDescriptor();

  TourOptions options_;
  uint32_t session_;
  Random random_;
  MapEditor map_;
  std::vector<Corner> way_;
  size_t next_ = 0;
  uint64_t landmarks_made_ = 0;
  std::vector<LandmarkId> recent_;  ///< landmarks that the last keyframes made, and that the next ones see
};

}  // namespace dmslam
