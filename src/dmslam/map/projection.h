#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "dmslam/map/map.h"

namespace dmslam {

/// Where and how a camera at some pose should see a landmark.
struct LandmarkView {
  Eigen::Vector2d uv_px;  ///< undistorted
  double depth = 0;       ///< along the optical axis [map units]
  double view_cos = 1;    ///< cosine between this view and the mean of those that saw it
  int octave = 0;         ///< the pyramid level at which it should appear
};

struct ViewLimits {
  double min_view_cos = 0.5;    ///< views from the side are refused (ORB-SLAM2: 60 degrees)
  double distance_slack = 1.2;  ///< how far outside its range of distances a landmark may be
  double border_px = 0;         ///< how far outside the image a projection may lie
};

/// Where the camera stands, worked out once for all landmarks.
struct Viewpoint {
  Viewpoint(const Rigid3d& T) : T_cam_world(T), center(T.Center()) {}  // NOLINT: a pose is one

  Rigid3d T_cam_world;
  Eigen::Vector3d center;  ///< in the world
};

/// Predicts the view of a landmark; none when it is behind, outside the image, or seen from too different a
/// place.
std::optional<LandmarkView> PredictView(const Map& map, const Landmark& landmark, const Viewpoint& from,
                                        const ViewLimits& limits = {});

/// The feature near a pixel whose descriptor is nearest.
struct FeatureHit {
  int feature = 0;
  int distance = 0;  ///< bits
  int octave = 0;
  int second_distance = kNoDistance;   ///< of the next best feature; kNoDistance: there is no other
  std::optional<int> second_octave{};  ///< of that feature
};

/// Looks within `radius_px` of `uv_px`, at octaves min..max, for the feature nearest to `descriptor`; none:
/// there is none. Features whose entry in `taken` is non-zero are passed over (`taken` may be empty), and
/// those that differ by more than `max_distance` bits. Ties go to the lower index.
std::optional<FeatureHit> FindFeature(const FrameFeatures& features, const Eigen::Vector2d& uv_px,
                                      double radius_px, int min_octave, int max_octave,
                                      const Descriptor& descriptor, const std::vector<uint8_t>& taken,
                                      int max_distance = kNoDistance);
/// Second best features that are farther than this [bits] make no difference where the best one may be
/// `max_best` away, and at most `ratio` of the second best.
constexpr int FarthestSecond(int max_best, double ratio) { return static_cast<int>(max_best / ratio) + 1; }

/// Squared reprojection error over the feature's variance.
inline double NormalizedErrorSquared(const FrameFeatures& features, int feature, const Eigen::Vector2d& uv_px,
                                     const Pyramid& pyramid) {
  const size_t i = static_cast<size_t>(feature);
  return (features.uv_px[i] - uv_px).squaredNorm() / features.Variance(i, pyramid);
}

}  // namespace dmslam
