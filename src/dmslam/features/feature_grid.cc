#include "dmslam/features/feature_grid.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr uint32_t kLanes = 4;
constexpr double kRoundingPx = 1e-3;  // more than what a coordinate loses as a float
// Vectors of the compiler: of all machines, and no wider than any of them has.
using Floats [[gnu::vector_size(4 * kLanes)]] = float;
using Ints [[gnu::vector_size(4 * kLanes)]] = int32_t;

template <typename Vector, typename Value>
Vector Repeat(Value value) {
  return Vector{} + value;
}
template <typename Vector, typename Value>
Vector Load(const Value* from) {
  Vector vector;
  std::memcpy(&vector, from, sizeof(vector));
  return vector;
}

/// Cell of a coordinate, the nearest one for coordinates outside the image.
int ClampedCell(double coordinate_px, double cell_size_px, int count) {
  return static_cast<int>(std::clamp(coordinate_px * (1.0 / cell_size_px), 0.0, count - 1.0));
}

}  // namespace

void FeatureGrid::Build(std::span<const Eigen::Vector2d> uv_px, std::span<const Keypoint> keypoints,
                        int width_px, int height_px) {
  DMSLAM_CHECK(uv_px.size() == keypoints.size(), "every keypoint needs its pixel");
  DMSLAM_CHECK(width_px > 0 && height_px > 0, "the image must have pixels");
  columns_ = static_cast<int>(std::ceil(width_px / kCellSizePx));
  rows_ = static_cast<int>(std::ceil(height_px / kCellSizePx));
  starts_.assign(CellIndex(0, rows_) + 1, 0);
  const size_t slots = uv_px.empty() ? 0 : uv_px.size() + kSlack;
  x_px_.resize(slots);
  y_px_.resize(slots);
  octaves_.resize(slots);
  features_.resize(slots);
  // Counting sort: count per cell, running sum, then place in order of features.
  for (const Eigen::Vector2d& uv : uv_px) ++starts_[CellOf(uv)];
  uint32_t end = 0;
  for (uint32_t& start : starts_) {
    end += start;
    start = end;
  }
  for (size_t i = uv_px.size(); i-- > 0;) {
    uint32_t& slot = starts_[CellOf(uv_px[i])];
    --slot;
    x_px_[slot] = static_cast<float>(uv_px[i].x());
    y_px_[slot] = static_cast<float>(uv_px[i].y());
    octaves_[slot] = keypoints[i].octave;
    features_[slot] = static_cast<uint32_t>(i);
  }
}

void FeatureGrid::FindInRadius(const Eigen::Vector2d& center_px, double radius_px, int min_octave,
                               int max_octave, std::vector<uint32_t>* features) const {
  features->clear();
  ForEachInRadius(center_px, radius_px, min_octave, max_octave,
                  [features](uint32_t feature) { features->push_back(feature); });
}

size_t FeatureGrid::CollectInRadius(const Eigen::Vector2d& center_px, double radius_px, int min_octave,
                                    int max_octave, uint32_t* features) const {
  const Circle circle(center_px, radius_px);
  const Rows rows = RowsOf(circle);
  size_t count = 0;
  for (int row = rows.begin; row < rows.end; ++row)
    count += CollectOf(circle, RunOf(circle, row), min_octave, max_octave, features + count);
  return count;
}

size_t FeatureGrid::CollectOf(const Circle& circle, const Run& run, int min_octave, int max_octave,
                              uint32_t* features) const {
  const Floats x = Repeat<Floats>(circle.x_px), y = Repeat<Floats>(circle.y_px);
  const Floats radius_squared = Repeat<Floats>(circle.radius_px * circle.radius_px);
  const Ints least = Repeat<Ints>(min_octave), most = Repeat<Ints>(max_octave);
  size_t count = 0;
  for (uint32_t i = run.begin; i < run.end; i += kLanes) {
    const Floats dx = Load<Floats>(&x_px_[i]) - x, dy = Load<Floats>(&y_px_[i]) - y;
    const Ints octave = Load<Ints>(&octaves_[i]);
    const Ints wanted = (dx * dx + dy * dy <= radius_squared) & (octave >= least) & (octave <= most);
    const uint32_t in_run = std::min<uint32_t>(kLanes, run.end - i);
    for (uint32_t k = 0; k < in_run; ++k) {
      features[count] = features_[i + k];
      count += static_cast<size_t>(wanted[k] & 1);
    }
  }
  return count;
}

FeatureGrid::Rows FeatureGrid::RowsOf(const Circle& circle) const {
  if (features_.empty() || !(circle.radius_px >= 0.0F) || !std::isfinite(circle.x_px) ||
      !std::isfinite(circle.y_px)) {
    return {};
  }
  return {ClampedCell(circle.y_px - circle.radius_px, kCellSizePx, rows_),
          ClampedCell(circle.y_px + circle.radius_px, kCellSizePx, rows_) + 1};
}

/// The part of the row that the circle reaches; the outermost rows go on beyond the image. Of a small circle,
/// which hardly leaves out a cell, that of the square around it.
FeatureGrid::Run FeatureGrid::RunOf(const Circle& circle, int row) const {
  const double radius = circle.radius_px;
  if (radius <= kSmallRadiusPx)
    return RunBetween(circle.x_px - radius - kRoundingPx, circle.x_px + radius + kRoundingPx, row);
  const double top = row * kCellSizePx, bottom = top + kCellSizePx;
  double away = 0;
  if (circle.y_px < top && row > 0) away = top - circle.y_px;
  if (circle.y_px > bottom && row + 1 < rows_) away = circle.y_px - bottom;
  const double half = std::sqrt(std::max(0.0, radius * radius - away * away)) + kRoundingPx;
  return RunBetween(circle.x_px - half, circle.x_px + half, row);
}

FeatureGrid::Run FeatureGrid::RunBetween(double left_px, double right_px, int row) const {
  return {starts_[CellIndex(ClampedCell(left_px, kCellSizePx, columns_), row)],
          starts_[CellIndex(ClampedCell(right_px, kCellSizePx, columns_), row) + 1]};
}

size_t FeatureGrid::CellOf(const Eigen::Vector2d& uv_px) const {
  return CellIndex(ClampedCell(uv_px.x(), kCellSizePx, columns_), ClampedCell(uv_px.y(), kCellSizePx, rows_));
}

}  // namespace dmslam
