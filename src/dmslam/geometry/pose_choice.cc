#include <algorithm>
#include <cmath>

#include "dmslam/geometry/triangulation.h"
#include "dmslam/geometry/two_view.h"

namespace dmslam {
namespace {

struct Matches {
  const Pinhole& camera;
  std::span<const Eigen::Vector2d> x1_px, x2_px;
  std::span<const char> mask;
  std::span<const double> sigma_squared;
};

struct Support {
  int num_good = 0;
  std::vector<char> good;
  std::vector<Eigen::Vector3d> points_cam1;
  std::vector<double> parallax_rad;  ///< Of the good ones.
};

Support CountSupport(const Rigid3d& T_cam2_cam1, const Matches& m, const PoseChoiceOptions& options) {
  Support support;
  support.good.assign(m.x1_px.size(), 0);
  support.points_cam1.assign(m.x1_px.size(), Eigen::Vector3d::Zero());
  const Eigen::Vector3d center2 = T_cam2_cam1.Center();
  for (size_t i = 0; i < m.x1_px.size(); ++i) {
    if (!m.mask.empty() && !m.mask[i]) continue;
    const auto point =
        TriangulatePointInFirst(T_cam2_cam1, m.camera.Ray(m.x1_px[i]), m.camera.Ray(m.x2_px[i]));
    if (!point) continue;
    const double bound =
        options.max_reprojection_error_squared_px * (m.sigma_squared.empty() ? 1.0 : m.sigma_squared[i]);
    if (ReprojectionErrorSquared(m.camera, Rigid3d(), *point, m.x1_px[i]) > bound) continue;
    if (ReprojectionErrorSquared(m.camera, T_cam2_cam1, *point, m.x2_px[i]) > bound) continue;
    ++support.num_good;
    const double parallax = ParallaxAngle(Eigen::Vector3d::Zero(), center2, *point);
    support.parallax_rad.push_back(parallax);
    if (parallax < options.min_parallax_rad) continue;
    support.good[i] = 1;
    support.points_cam1[i] = *point;
  }
  return support;
}

}  // namespace

std::optional<PoseChoice> ChoosePose(std::span<const Rigid3d> candidates_cam2_cam1, const Pinhole& camera,
                                     std::span<const Eigen::Vector2d> x1_px,
                                     std::span<const Eigen::Vector2d> x2_px, std::span<const char> mask,
                                     std::span<const double> sigma_squared,
                                     const PoseChoiceOptions& options) {
  if (candidates_cam2_cam1.empty()) return std::nullopt;
  const Matches matches{camera, x1_px, x2_px, mask, sigma_squared};
  PoseChoice choice;
  Support best;
  best.num_good = -1;
  for (const Rigid3d& candidate : candidates_cam2_cam1) {
    Support support = CountSupport(candidate, matches, options);
    if (support.num_good > best.num_good) {
      choice.num_good_second = std::max(0, best.num_good);
      choice.T_cam2_cam1 = candidate;
      best = std::move(support);
    } else {
      choice.num_good_second = std::max(choice.num_good_second, support.num_good);
    }
  }
  choice.num_good = best.num_good;
  choice.good = std::move(best.good);
  choice.points_cam1 = std::move(best.points_cam1);
  std::vector<double>& parallax = best.parallax_rad;
  if (!parallax.empty()) {
    std::sort(parallax.begin(), parallax.end(), std::greater<>());
    choice.parallax_rad = parallax[std::min<size_t>(49, parallax.size() - 1)];
    choice.median_parallax_rad = parallax[parallax.size() / 2];
  }
  return choice;
}

}  // namespace dmslam
