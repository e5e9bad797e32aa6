#include "dmslam/robust/two_view_ransac.h"

#include <vector>

#include "dmslam/geometry/two_view.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

struct Matches {
  std::span<const Eigen::Vector2d> x1_px, x2_px;
  std::vector<double> inverse_threshold;  ///< 1 / (bound * sigma^2)

  Matches(std::span<const Eigen::Vector2d> x1, std::span<const Eigen::Vector2d> x2,
          std::span<const double> sigma_squared, double max_error_squared_px)
      : x1_px(x1), x2_px(x2), inverse_threshold(x1.size(), 1.0 / max_error_squared_px) {
    DMSLAM_CHECK(x1.size() == x2.size(), "matches come in pairs");
    DMSLAM_CHECK(sigma_squared.empty() || sigma_squared.size() == x1.size(), "one sigma per match");
    for (size_t i = 0; i < sigma_squared.size(); ++i) inverse_threshold[i] /= sigma_squared[i];
  }
  int size() const { return static_cast<int>(x1_px.size()); }
  double Sampson(const Eigen::Matrix3d& F, int index) const {
    const auto i = static_cast<size_t>(index);
    return SampsonErrorSquared(F, x1_px[i], x2_px[i]) * inverse_threshold[i];
  }
};

/// The model is F = K^-T E K^-1, so that errors are in pixels.
struct EssentialProblem {
  using Model = Eigen::Matrix3d;
  static constexpr int kSampleSize = 5;
  static constexpr int kMaxModels = 10;
  const Matches& matches;
  const Pinhole& camera;
  const std::vector<Eigen::Vector3d>& rays1;
  const std::vector<Eigen::Vector3d>& rays2;

  int size() const { return matches.size(); }
  int Fit(std::span<const int, 5> sample, std::array<Eigen::Matrix3d, 10>& models) const {
    const int count = EssentialFivePoint(rays1, rays2, sample, models);
    for (int k = 0; k < count; ++k) {
      Eigen::Matrix3d& model = models[static_cast<size_t>(k)];
      model = FundamentalFromEssential(model, camera, camera);
    }
    return count;
  }
  double NormalizedErrorSquared(const Eigen::Matrix3d& F, int i) const { return matches.Sampson(F, i); }
  bool Refit(std::span<const int> indices, Eigen::Matrix3d& F) const {
    if (indices.size() < 8) return false;
    Rigid3d T;
    PoseFromEssential(EssentialFromFundamental(F, camera, camera), rays1, rays2, indices, T);
    T = RefineRelativePose(camera, T, matches.x1_px, matches.x2_px, indices, matches.inverse_threshold, 0.0,
                           3);
    F = FundamentalFromEssential(EssentialFromPose(T), camera, camera);
    return true;
  }
};

}  // namespace

RansacReport<Eigen::Matrix3d> EssentialFromMatches(const Pinhole& camera,
                                                   std::span<const Eigen::Vector2d> x1_px,
                                                   std::span<const Eigen::Vector2d> x2_px,
                                                   std::span<const double> sigma_squared,
                                                   const TwoViewRansacOptions& options) {
  const Matches matches(x1_px, x2_px, sigma_squared, options.max_error_squared_px);
  std::vector<Eigen::Vector3d> rays1, rays2;
  for (const auto& x : x1_px) rays1.push_back(camera.Ray(x));
  for (const auto& x : x2_px) rays2.push_back(camera.Ray(x));
  auto report = Ransac(EssentialProblem{matches, camera, rays1, rays2}, options.ransac);
  report.model = EssentialFromFundamental(report.model, camera, camera);
  return report;
}

}  // namespace dmslam
