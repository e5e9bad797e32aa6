#include "dmslam/initialization/plane_motions.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/geometry/two_view.h"

namespace dmslam {
namespace {

constexpr double kMinShare = 0.6;       // of the matches lie on the plane...
constexpr double kMaxOffPlane = 0.004;  // ...which is to say that it moves them to within so much [rad]
constexpr int kRounds = 8;

/// The matches among `indices` that H moves to within the bound or, where that is more, the better half of
/// them.
std::vector<int> BetterHalf(const MatchArrays& arrays, const Eigen::Matrix3d& H, std::vector<int> indices) {
  const auto off = [&](int i) {
    const auto k = static_cast<size_t>(i);
    return TransferErrorSquared(H, arrays.p0[k], arrays.p1[k]);
  };
  const auto within = std::partition(indices.begin(), indices.end(),
                                     [&](int i) { return off(i) <= kMaxOffPlane * kMaxOffPlane; });
  const auto half = indices.begin() + static_cast<ptrdiff_t>(indices.size() / 2);
  if (within < half) {
    std::nth_element(within, half, indices.end(), [&](int a, int b) { return off(a) < off(b); });
  }
  indices.erase(std::max(within, half), indices.end());
  return indices;
}

/// By least squares over the better half, again and again; none where the plane has too few.
std::optional<Eigen::Matrix3d> PlaneHomography(const MatchArrays& arrays, const std::vector<int>& all) {
  std::vector<int> agreeing = all;
  std::optional<Eigen::Matrix3d> H;
  for (int round = 0; round < kRounds; ++round) {
    H = HomographyLinear(arrays.p0, arrays.p1, agreeing);
    if (!H) return std::nullopt;
    agreeing = BetterHalf(arrays, *H, all);
  }
  const auto on_plane = std::count_if(all.begin(), all.end(), [&](int i) {
    const auto k = static_cast<size_t>(i);
    return TransferErrorSquared(*H, arrays.p0[k], arrays.p1[k]) <= kMaxOffPlane * kMaxOffPlane;
  });
  const bool most = static_cast<double>(on_plane) >= kMinShare * static_cast<double>(all.size());
  return most ? H : std::nullopt;
}

}  // namespace

std::vector<Rigid3d> PlaneMotions(const MatchArrays& arrays, std::span<const uint8_t> use) {
  std::vector<int> all;
  for (size_t k = 0; k < arrays.size(); ++k) {
    if (use[k]) all.push_back(static_cast<int>(k));
  }
  const std::optional<Eigen::Matrix3d> H = PlaneHomography(arrays, all);
  std::vector<Rigid3d> motions;
  if (!H) return motions;
  for (const PlaneMotion& motion : DecomposeHomography(*H, Pinhole(), Pinhole())) {
    const auto before = std::count_if(all.begin(), all.end(), [&](int i) {
      return motion.normal_cam1.dot(arrays.ray0[static_cast<size_t>(i)]) > 0;
    });
    const double length = motion.T_cam2_cam1.translation.norm();
    if (2 * static_cast<size_t>(before) <= all.size() || length <= 0) continue;
    motions.push_back(motion.T_cam2_cam1);
    motions.back().translation /= length;
  }
  return motions;
}

}  // namespace dmslam
