#pragma once

#include <cstdint>
#include <optional>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/geometry/similarity.h"
#include "dmslam/util/ids.h"

namespace dmslam {

struct PoseJitterOptions {
  /// How large a pose's error is beside what the motion has changed by from one frame to the next: poses that
  /// err by turns of a frame would have 0.4 (each change holds three errors, squared 1, 4 and 1); what errs
  /// for longer changes by less.
  double gain = 0.45;
  /// A change that a camera makes itself: depths of the scene, and radians, per second squared.
  double acceleration = 1.0;
  double memory_s = 1.0;  ///< so long a pose that has jumped is believed to be wrong
};

/// How wrong poses are by how unevenly they move. What residuals say is how well a pose agrees with its
/// landmarks; it is silent where a part of them has gone on with a person, or is of a young map that is bent.
/// Such poses jump when features come and go, and no camera moves so: innovations measure the errors
/// themselves (Mehra, IEEE Trans. Automatic Control 1970).
class PoseJitter {
 public:
  /// So long a step is still one motion.
  static constexpr int64_t kLongestStepNs = 500'000'000;

  explicit PoseJitter(const PoseJitterOptions& options = {}) : options_(options) {}

  /// A pose as it is told; `depth`: of the scene.
  void OnPose(int64_t stamp_ns, MapId map, const Rigid3d& T_cam_world, double depth);
  /// The map has moved under the poses so far: what comes is no motion.
  void OnMapMoved() { last_.reset(); }
  /// Of the pose told last: tangent (w, v).
  Matrix6d Covariance(double depth) const;
  /// What of it the pose's own covariance does not account for, of rotation and position each: to be added.
  /// Poses that err as much as they are told to do jitter, too. All in tangents (w, v).
  Matrix6d Beyond(const Matrix6d& told, double depth) const;

 private:
  struct Told {
    int64_t stamp_ns = 0;
    Rigid3d T_cam_world;
    std::optional<Rigid3d> T_cam_before;  ///< the step that ended there...
    double step_s = 0;                    ///< ...and how long it took
  };
  Told Follow(int64_t stamp_ns, const Rigid3d& T_cam_world, double depth);

  PoseJitterOptions options_;
  MapId map_ = 0;
  std::optional<Told> last_;
  int64_t newest_ns_ = 0;
  double position_squared_ = 0;  ///< in depths
  double rotation_squared_ = 0;  ///< [rad^2]
};

}  // namespace dmslam
