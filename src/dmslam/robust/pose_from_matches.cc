#include "dmslam/robust/pose_from_matches.h"

#include <limits>
#include <vector>

#include "dmslam/geometry/absolute_pose.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

class PoseProblem {
 public:
  using Model = Rigid3d;
  static constexpr int kSampleSize = 3;
  static constexpr int kMaxModels = 4;

  PoseProblem(const Pinhole& camera, std::span<const Eigen::Vector3d> points,
              std::span<const Eigen::Vector2d> uv_px, std::span<const double> inv_sigma_squared,
              double max_chi2)
      : camera_(camera),
        points_(points),
        uv_px_(uv_px),
        inv_sigma_squared_(inv_sigma_squared),
        max_chi2_(max_chi2) {
    rays_.reserve(uv_px.size());
    for (const Eigen::Vector2d& uv : uv_px) rays_.push_back(camera.Ray(uv));
  }

  int size() const { return static_cast<int>(points_.size()); }

  int Fit(std::span<const int, 3> sample, std::array<Rigid3d, 4>& poses) const {
    std::array<Eigen::Vector3d, 3> rays, points;
    for (size_t k = 0; k < 3; ++k) {
      rays[k] = rays_[static_cast<size_t>(sample[k])];
      points[k] = points_[static_cast<size_t>(sample[k])];
    }
    return SolveP3p(rays, points, poses);
  }

  double NormalizedErrorSquared(const Rigid3d& pose, int index) const {
    const auto i = static_cast<size_t>(index);
    const double weight = inv_sigma_squared_.empty() ? 1.0 : inv_sigma_squared_[i];
    return ReprojectionErrorSquared(camera_, pose, points_[i], uv_px_[i]) * weight / max_chi2_;
  }

  bool Refit(std::span<const int> indices, Rigid3d& pose) const {
    pose = RefinePose(camera_, pose, points_, uv_px_, inv_sigma_squared_, indices);
    return true;
  }

 private:
  Pinhole camera_;
  std::span<const Eigen::Vector3d> points_;
  std::span<const Eigen::Vector2d> uv_px_;
  std::span<const double> inv_sigma_squared_;
  double max_chi2_;
  std::vector<Eigen::Vector3d> rays_;
};

}  // namespace

RansacReport<Rigid3d> PoseFromMatches(const Pinhole& camera, std::span<const Eigen::Vector3d> points_world,
                                      std::span<const Eigen::Vector2d> uv_px,
                                      std::span<const double> inv_sigma_squared,
                                      const PoseRansacOptions& options) {
  DMSLAM_CHECK(points_world.size() == uv_px.size(), "one pixel per point");
  DMSLAM_CHECK(inv_sigma_squared.empty() || inv_sigma_squared.size() == uv_px.size(), "one sigma per pixel");
  const PoseProblem problem(camera, points_world, uv_px, inv_sigma_squared, options.max_chi2);
  return Ransac(problem, {.max_iterations = options.max_iterations,
                          .min_iterations = options.min_iterations,
                          .confidence = options.confidence,
                          .min_inliers = options.min_inliers,
                          .seed = options.seed});
}

}  // namespace dmslam
