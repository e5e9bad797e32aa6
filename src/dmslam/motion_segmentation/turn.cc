#include "dmslam/motion_segmentation/turn.h"

#include <algorithm>
#include <limits>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/geometry/solve_symmetric.h"

namespace dmslam {
namespace {

constexpr int kIterations = 8;
constexpr double kLeastScaleRad = 1e-3;  // the rays' differences need not be told apart more finely

struct RayPair {
  Eigen::Vector3d ray0, ray1;
};

double MedianDifference(std::span<const RayPair> pairs, const Eigen::Matrix3d& R_1_0) {
  std::vector<double> differences;
  for (const RayPair& pair : pairs) differences.push_back((pair.ray1 - R_1_0 * pair.ray0).norm());
  const auto middle = differences.begin() + static_cast<ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  return std::max(kLeastScaleRad, *middle);
}

/// The turn that is added to lower the weighted squares of the differences.
Eigen::Vector3d Step(std::span<const RayPair> pairs, const Eigen::Matrix3d& R_1_0, double scale) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const RayPair& pair : pairs) {
    const Eigen::Vector3d turned = R_1_0 * pair.ray0;
    const double weight = 1 / (1 + (pair.ray1 - turned).squaredNorm() / (scale * scale));
    normal += weight * (Eigen::Matrix3d::Identity() - turned * turned.transpose());
    right += weight * turned.cross(pair.ray1);
  }
  return SolveSymmetric(normal, right);
}

}  // namespace

Eigen::Quaterniond FitTurn(std::span<const Match> matches, const Camera& camera,
                           const Eigen::Quaterniond& start) {
  if (matches.size() < 3) return start;
  std::vector<RayPair> pairs;
  pairs.reserve(matches.size());
  for (const Match& match : matches)
    pairs.push_back({camera.Ray(match.uv0_px).normalized(), camera.Ray(match.uv1_px).normalized()});
  Eigen::Quaterniond R_1_0 = start;
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Matrix3d R = R_1_0.toRotationMatrix();
    const Eigen::Vector3d step = Step(pairs, R, MedianDifference(pairs, R));
    if (!step.allFinite()) return start;
    R_1_0 = (ExpSo3(step) * R_1_0).normalized();
  }
  return R_1_0;
}

std::vector<Eigen::Vector2d> Turned(std::span<const Eigen::Vector2d> uv0_px, const Camera& camera,
                                    const Eigen::Quaterniond& R_1_0) {
  const Eigen::Vector2d nowhere = Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  const Eigen::Matrix3d R = R_1_0.toRotationMatrix();
  std::vector<Eigen::Vector2d> turned;
  turned.reserve(uv0_px.size());
  for (const Eigen::Vector2d& uv_px : uv0_px)
    turned.push_back(camera.Project(R * camera.Ray(uv_px)).value_or(nowhere));
  return turned;
}

}  // namespace dmslam
