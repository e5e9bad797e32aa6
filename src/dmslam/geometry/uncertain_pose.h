#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/geometry/similarity.h"

namespace dmslam {

/// What is wrong with poses besides what the residuals show (docs/uncertainty.md, where they are calibrated).
struct PoseErrorModel {
  /// Correlation of the errors of two features in one cell of the image: what is near lies on the same
  /// surface, in the same blur, and was triangulated from the same keyframes.
  double neighbour_correlation = 0.02;
  /// Errors that all landmarks of a view share (of the camera model, of the keyframes' poses) and that are
  /// others when the view has been left and come back to: as an angle [rad], and as a share of the depth.
  double model_error = 0.0003;
  /// Growth of the shared errors from one view to another that has nothing in common with it: as an angle
  /// [rad], as a share of the depth, and as a share of the scale.
  double drift = 0.001;
  /// Share of a pose's variance that a view has which is new and was mapped from it.
  double inherited = 1.0;
};

/// What two views have not in common, from 0 on: how far what is in the middle of a's view, at the depth of
/// the scene, has moved in the eyes of b, in depths. A camera that goes around it keeps it in view; one that
/// turns away by a radian has nothing left of it.
double ViewChange(const Rigid3d& T_b_a, double depth);

/// From one view to another.
struct ViewsBetween {
  double change = 0;       ///< what they have not in common
  double gone = 0;         ///< the same, summed up over the way between them
  double since_scale = 0;  ///< the first one's change since the scale was fixed, where that was elsewhere
  /// Variances of the rotations [rad^2] by which new views were entered on the way, a view each (a sum of
  /// variance times change): what is mapped there errs as the pose from which it was. The same since the
  /// scale was fixed.
  double entered = 0, entered_since_scale = 0;
};

/// Covariance of what the errors that a view's landmarks share differ by in another view: as far as the views
/// have been left by model_error, and by drift, a walk at random, for what is new. Tangent (w, v).
Matrix6d SharedErrors(const PoseErrorModel& model, const ViewsBetween& between, double depth);

/// The covariance of a pose T_b_a with tangent (w, v) on its left, as a message tells it: of b's camera in
/// a's frame, position first and then the rotation vector, both along a's axes.
Matrix6d ToPoseInReference(const Matrix6d& covariance, const Rigid3d& T_b_a);
/// And back.
Matrix6d FromPoseInReference(const Matrix6d& told, const Rigid3d& T_b_a);

/// The 21 numbers of a symmetric matrix that travel: its upper triangle, row by row; and back.
std::vector<double> UpperTriangle(const Matrix6d& symmetric);
Matrix6d FromUpperTriangle(std::span<const double> upper);

/// A pose as it was told: where the camera stood, and how well that is known in its neighbourhood of the map.
struct UncertainPose {
  Rigid3d T_world_cam;
  Matrix6d covariance = Matrix6d::Zero();  ///< position and rotation vector, along the axes of the map
};

/// Covariance of where b stands in a's frame (position, rotation vector, along a's axes), of two poses of one
/// map: what is wrong with either, and how far the map between them may be bent.
Matrix6d RelativeCovariance(const UncertainPose& a, const UncertainPose& b, const ViewsBetween& between,
                            double depth, const PoseErrorModel& model = {});

}  // namespace dmslam
