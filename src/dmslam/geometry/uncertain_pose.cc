#include "dmslam/geometry/uncertain_pose.h"

#include <algorithm>

namespace dmslam {

double ViewChange(const Rigid3d& T_b_a, double depth) {
  const Eigen::Vector3d middle(0, 0, depth);
  return (T_b_a * middle - middle).norm() / depth;
}

Matrix6d SharedErrors(const PoseErrorModel& model, const ViewsBetween& between, double depth) {
  const double variance = model.model_error * model.model_error * std::min(1.0, between.gone) +
                          model.drift * model.drift * between.change + model.inherited * between.entered;
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << Eigen::Vector3d::Constant(variance),
      Eigen::Vector3d::Constant(variance * depth * depth);
  return covariance;
}

namespace {

/// Between a step (w, v) on the left of T_b_a and b's centre and turn in a's frame, but for the sign: it
/// moves the centre by -R_a_b v and turns b by -R_a_b w.
Matrix6d TurnIntoReference(const Rigid3d& T_b_a) {
  const Eigen::Matrix3d R_a_b = T_b_a.rotation.conjugate().toRotationMatrix();
  Matrix6d turn = Matrix6d::Zero();
  turn.topRightCorner<3, 3>() = R_a_b;
  turn.bottomLeftCorner<3, 3>() = R_a_b;
  return turn;
}

Matrix6d Turned(const Matrix6d& turn, const Matrix6d& covariance) {
  const Matrix6d turned = turn * covariance * turn.transpose();
  return 0.5 * (turned + turned.transpose());
}

}  // namespace

Matrix6d ToPoseInReference(const Matrix6d& covariance, const Rigid3d& T_b_a) {
  return Turned(TurnIntoReference(T_b_a), covariance);
}

Matrix6d FromPoseInReference(const Matrix6d& told, const Rigid3d& T_b_a) {
  return Turned(TurnIntoReference(T_b_a).transpose(), told);
}

std::vector<double> UpperTriangle(const Matrix6d& symmetric) {
  std::vector<double> upper;
  upper.reserve(21);
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) upper.push_back(symmetric(row, column));
  }
  return upper;
}

Matrix6d FromUpperTriangle(std::span<const double> upper) {
  Matrix6d symmetric = Matrix6d::Zero();
  size_t at = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column)
      symmetric(row, column) = symmetric(column, row) = upper[at++];
  }
  return symmetric;
}

Matrix6d RelativeCovariance(const UncertainPose& a, const UncertainPose& b, const ViewsBetween& between,
                            double depth, const PoseErrorModel& model) {
  const Eigen::Matrix3d R_a_world = a.T_world_cam.rotation.conjugate().toRotationMatrix();
  const Eigen::Vector3d way = b.T_world_cam.translation - a.T_world_cam.translation;
  // d position = R_a_world (d b - d a + way x turn of a), d rotation = R_a_world (turn of b - turn of a).
  Matrix6d by_a = Matrix6d::Zero(), by_b = Matrix6d::Zero();
  by_b.topLeftCorner<3, 3>() = by_b.bottomRightCorner<3, 3>() = R_a_world;
  by_a = -by_b;
  by_a.topRightCorner<3, 3>() = R_a_world * Hat(way);
  Matrix6d covariance = by_a * a.covariance * by_a.transpose() + by_b * b.covariance * by_b.transpose();
  const Matrix6d bent = SharedErrors(model, between, depth);
  covariance.topLeftCorner<3, 3>() += bent.bottomRightCorner<3, 3>();
  covariance.bottomRightCorner<3, 3>() += bent.topLeftCorner<3, 3>();
  // What the map turns and grows by on the way moves its end.
  const double turned = model.drift * model.drift * between.change + model.inherited * between.entered;
  covariance.topLeftCorner<3, 3>().diagonal().array() += turned * way.squaredNorm();
  const Eigen::Vector3d way_in_a = R_a_world * way;
  covariance.topLeftCorner<3, 3>() +=
      (model.drift * model.drift * between.since_scale + model.inherited * between.entered_since_scale) *
      way_in_a * way_in_a.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace dmslam
