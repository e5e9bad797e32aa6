#include "dmslam/optimization/pose_covariance.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "dmslam/geometry/solve_symmetric.h"
#include "dmslam/geometry/symmetric_eigen.h"
#include "dmslam/optimization/reprojection.h"

namespace dmslam {
namespace {

using Matrix62 = Eigen::Matrix<double, 6, 2>;

/// Sum of error covariances in which neighbours err alike: (1 - correlation) sum K K^T + correlation sum over
/// the cells of (sum K) (sum K)^T.
template <int kColumns>
class SumByCell {
 public:
  using Factor = Eigen::Matrix<double, 6, kColumns>;

  void Add(int cell, const Factor& factor) {
    single_.noalias() += factor * factor.transpose();
    const size_t at = static_cast<size_t>(std::max(cell, 0));
    if (at >= cells_.size()) cells_.resize(at + 1, Factor::Zero());
    cells_[at] += factor;
  }
  Matrix6d Covariance(double correlation) const {
    Matrix6d sum = (1.0 - correlation) * single_;
    for (const Factor& cell : cells_) sum.noalias() += correlation * (cell * cell.transpose());
    return sum;
  }

 private:
  Matrix6d single_ = Matrix6d::Zero();
  std::vector<Factor> cells_;
};

/// What a step (w, v) on the left of the pose that stands right of T becomes on the left of the product.
Matrix6d Adjoint(const Rigid3d& T) {
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  Matrix6d adjoint = Matrix6d::Zero();
  adjoint.topLeftCorner<3, 3>() = R;
  adjoint.bottomRightCorner<3, 3>() = R;
  adjoint.bottomLeftCorner<3, 3>() = Hat(T.translation) * R;
  return adjoint;
}

Matrix6d Symmetric(const Matrix6d& m) { return 0.5 * (m + m.transpose()); }

}  // namespace

bool IsCovariance(const Matrix6d& covariance) {
  return covariance.allFinite() && covariance.diagonal().minCoeff() >= 0.0;
}

Eigen::Matrix3d LandmarkCovariance(const Pinhole& camera, const Eigen::Vector3d& p_world,
                                   std::span<const LandmarkRay> views) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const LandmarkRay& view : views) {
    const Eigen::Vector3d p_cam = view.T_cam_world * p_world;
    if (p_cam.z() < kMinDepth) continue;
    const Matrix23 J = ProjectionJacobian(camera, p_cam) * view.T_cam_world.rotation.toRotationMatrix();
    information.noalias() += J.transpose() * J / view.variance_px;
    const Eigen::Vector3d ray = view.T_cam_world.rotation.conjugate() * p_cam / p_cam.squaredNorm();
    information.noalias() += ray * ray.transpose() / static_cast<double>(views.size());
  }
  return InverseOfPositive(information).value_or(Eigen::Matrix3d::Zero());
}

Eigen::Matrix3d SymmetricRoot(const Eigen::Matrix3d& covariance) {
  const SymmetricEigen<3> eigen = DirectEigenOfSymmetric(covariance);
  return eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * eigen.vectors.transpose();
}

std::optional<PoseUncertainty> EstimatePoseUncertainty(const Pinhole& camera, const Rigid3d& T_cam_world,
                                                       std::span<const PoseSight> sights,
                                                       const Matrix6d& information, double noise_variance,
                                                       const PoseErrorModel& model) {
  const std::optional<Matrix6d> inverted = InverseOfPositive(information);
  if (!inverted || !inverted->allFinite()) return std::nullopt;
  const Matrix6d& inverse = *inverted;
  const Eigen::Matrix3d R = T_cam_world.rotation.toRotationMatrix();
  PoseUncertainty result;
  result.gains.reserve(sights.size());
  SumByCell<2> noise;
  SumByCell<3> landmarks;
  Matrix6d seen = Matrix6d::Zero();
  for (const PoseSight& sight : sights) {
    const Eigen::Vector3d p_cam = R * sight.p_world + T_cam_world.translation;
    const Matrix26 J = PoseJacobian(camera, p_cam);
    const double weight = sight.weight / sight.variance_px;
    seen.noalias() += weight * J.transpose() * J;
    const Matrix62 gain = weight * inverse * J.transpose();
    noise.Add(sight.cell, std::sqrt(noise_variance * sight.variance_px) * gain);
    result.gains.push_back(-gain * ProjectionJacobian(camera, p_cam) * R);
    landmarks.Add(sight.cell, result.gains.back() * sight.landmark_root);
  }
  // What the information has besides is the prior's, which errs as it says.
  const Matrix6d prior = information - seen;
  result.noise = Symmetric(noise.Covariance(model.neighbour_correlation) + inverse * prior * inverse);
  result.landmarks = Symmetric(landmarks.Covariance(model.neighbour_correlation));
  return result;
}

Matrix6d StepUncertainty(const StepEnd& before, const StepEnd& after, const PoseErrorModel& model) {
  const Matrix6d adjoint = Adjoint(after.T_cam_world * before.T_cam_world.Inverse());
  SumByCell<3> landmarks;
  size_t b = 0;
  const auto add_before = [&](const PoseSight& sight) {
    landmarks.Add(sight.cell, -adjoint * before.uncertainty->gains[b] * sight.landmark_root);
  };
  for (size_t a = 0; a < after.sights.size(); ++a) {
    const PoseSight& sight = after.sights[a];
    for (; b < before.sights.size() && before.sights[b].landmark < sight.landmark; ++b)
      add_before(before.sights[b]);
    LandmarkGain gain = after.uncertainty->gains[a];
    if (b < before.sights.size() && before.sights[b].landmark == sight.landmark)
      gain -= adjoint * before.uncertainty->gains[b++];
    landmarks.Add(sight.cell, gain * sight.landmark_root);
  }
  for (; b < before.sights.size(); ++b) add_before(before.sights[b]);
  return Symmetric(landmarks.Covariance(model.neighbour_correlation) + after.uncertainty->noise +
                   adjoint * before.uncertainty->noise * adjoint.transpose());
}

}  // namespace dmslam
