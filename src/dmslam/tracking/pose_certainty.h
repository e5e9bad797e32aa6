#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dmslam/map/map.h"
#include "dmslam/map/tracked_frame.h"
#include "dmslam/optimization/pose_covariance.h"
#include "dmslam/tracking/motion_model.h"
#include "dmslam/tracking/pose_jitter.h"
#include "dmslam/tracking/pose_solver.h"

namespace dmslam {

/// How well the pose of a tracked frame is known.
struct PoseCertainty {
  /// Of the camera in its reference keyframe's frame: position [map units], rotation vector [rad], along the
  /// keyframe's axes.
  Matrix6d covariance = Matrix6d::Zero();
  /// The same in the camera of a frame tracked just before.
  struct Step {
    uint32_t from = 0;  ///< index of that frame
    Matrix6d covariance = Matrix6d::Zero();
  };
  std::optional<Step> step;
  double depth = 1.0;  ///< median of the landmarks used [map units]
  /// Largest standard deviations, as the landmarks fix the pose (without PoseJitter's): of the position, as a
  /// share of the depth, and of the rotation [rad].
  double position_share = 0, rotation_rad = 0;
};

/// Says of each tracked frame how well its pose is known. Keeps what the next frame's step needs. Changes no
/// pose.
class PoseCertaintyEstimator {
 public:
  explicit PoseCertaintyEstimator(const PoseErrorModel& model = {}) : model_(model) {}

  /// `basis`: what the solver found the pose by. `follows`: from the frame before, not found anew. None where
  /// nothing determines it.
  std::optional<PoseCertainty> Estimate(const Map& map, const TrackedFrame& frame, const PlacedPose& pose,
                                        const PoseBasis& basis, bool follows);
  /// The map is void.
  void Forget();

 private:
  struct Told {
    uint32_t index = 0;
    int64_t stamp_ns = 0;
    PlacedPose pose;
    Rigid3d T_cam_world;
    std::vector<PoseSight> sights;
    PoseUncertainty uncertainty;
  };

  /// The root of a landmark's covariance, which holds until keyframes see it anew or it is moved.
  struct Known {
    size_t observations = 0;
    Eigen::Vector3d p_world;
    Eigen::Matrix3d root;
  };

  std::vector<PoseSight> SightsOf(const Map& map, const PoseBasis& basis);
  const Eigen::Matrix3d& RootOf(const Map& map, const Pinhole& camera, const Landmark& landmark);
  Eigen::Matrix3d WorkOutCovariance(const Map& map, const Pinhole& camera, const Landmark& landmark);
  std::optional<PoseCertainty::Step> StepTo(const Map& map, const Told& now, double depth) const;

  bool HasMapMoved(const Map& map) const;

  PoseErrorModel model_;
  PoseJitter jitter_;
  std::optional<Told> last_;
  std::unordered_map<LandmarkId, Known> known_;
  // Workspace:
  std::vector<LandmarkRay> views_;
  std::vector<std::pair<LandmarkId, size_t>> order_;  ///< places in the basis, by landmark
};

}  // namespace dmslam
