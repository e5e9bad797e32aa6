#include "dmslam/motion_segmentation/depth_layers.h"

#include <algorithm>
#include <cmath>

namespace dmslam {
namespace {

struct Layer {
  double low = 0, high = 0;  // [rad], about
};

/// Runs of bins that are not empty, closer ones joined.
std::vector<Layer> FindLayers(const LayerOptions& options, std::span<const double> disparity) {
  const auto [low, high] = std::minmax_element(disparity.begin(), disparity.end());
  const double origin = *low;
  const auto bins = static_cast<size_t>((*high - origin) / options.bin_rad) + 1;
  std::vector<int> count(bins, 0);
  for (const double d : disparity) ++count[static_cast<size_t>((d - origin) / options.bin_rad)];
  const double empty = options.noise_share * *std::max_element(count.begin(), count.end());
  std::vector<Layer> layers;
  for (size_t b = 0; b < bins; ++b) {
    if (count[b] <= empty) continue;
    const double begin = origin + static_cast<double>(b) * options.bin_rad, end = begin + options.bin_rad;
    if (!layers.empty() && begin - layers.back().high < options.gap_rad) {
      layers.back().high = end;
    } else {
      layers.push_back({begin, end});
    }
  }
  return layers;
}

/// That with the largest D times number of matches.
Layer WidestLayer(std::span<const Layer> layers, std::span<const double> disparity,
                  std::span<const size_t> index, std::span<const Eigen::Vector2d> positions_px) {
  if (layers.size() == 1) return layers.front();
  double best_score = -1;
  Layer best;
  std::vector<Eigen::Vector2d> points;
  for (const Layer& layer : layers) {
    points.clear();
    for (size_t k = 0; k < index.size(); ++k) {
      if (disparity[k] >= layer.low && disparity[k] <= layer.high) points.push_back(positions_px[index[k]]);
    }
    const double spread = Spread(points);
    const double score = spread * spread * static_cast<double>(points.size());
    if (score <= best_score) continue;
    best_score = score;
    best = layer;
  }
  return best;
}

}  // namespace

double Disparity(const TwoViewModel& model, const MatchArrays& arrays, size_t i) {
  const Eigen::Vector3d y = model.R * arrays.ray0[i];
  if (!(y.z() > 1e-6)) return 0;
  const Eigen::Vector2d at_infinity = y.hnormalized();
  const Eigen::Vector2d direction = model.t.head<2>() - at_infinity * model.t.z();
  const double length = direction.norm();
  if (!(length > 1e-9)) return 0;
  return (arrays.p1[i] - at_infinity).dot(direction) / length;
}

int KeepWidestLayer(const LayerOptions& options, const TwoViewModel& model, const MatchArrays& arrays,
                    std::span<const Eigen::Vector2d> positions_px, std::span<uint8_t> flags) {
  std::vector<double> disparity;
  std::vector<size_t> index;
  disparity.reserve(flags.size());
  index.reserve(flags.size());
  for (size_t i = 0; i < flags.size(); ++i) {
    if (!flags[i]) continue;
    index.push_back(i);
    disparity.push_back(std::clamp(Disparity(model, arrays, i), -20.0, 20.0));
  }
  if (index.empty()) return 0;
  const Layer best = WidestLayer(FindLayers(options, disparity), disparity, index, positions_px);
  int kept = 0;
  for (size_t k = 0; k < index.size(); ++k) {
    const bool in_layer = disparity[k] >= best.low && disparity[k] <= best.high;
    flags[index[k]] = in_layer ? 1 : 0;
    kept += in_layer ? 1 : 0;
  }
  return kept;
}

}  // namespace dmslam
