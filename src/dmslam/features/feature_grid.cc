#include "dmslam/features/feature_grid.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr uint32_t kLanes = 4;
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

/// Entries of the index one after the other; behind each list kSlack more can be read.
struct Entries {
  const float* x_px;
  const float* y_px;
  const int32_t* octaves;
  const uint32_t* features;
  uint32_t count;
};

/// Within a circle, and of some octaves.
struct Wanted {
  float x_px, y_px, radius_squared;
  int32_t min_octave, max_octave;
};

/// Those of the entries that are wanted, in their order. No branches: which ones are has no pattern.
size_t Collect(const Entries& entries, const Wanted& circle, uint32_t* features) {
  const Floats x = Repeat<Floats>(circle.x_px), y = Repeat<Floats>(circle.y_px);
  const Floats radius_squared = Repeat<Floats>(circle.radius_squared);
  const Ints least = Repeat<Ints>(circle.min_octave), most = Repeat<Ints>(circle.max_octave);
  size_t count = 0;
  for (uint32_t i = 0; i < entries.count; i += kLanes) {
    const Floats dx = Load<Floats>(entries.x_px + i) - x, dy = Load<Floats>(entries.y_px + i) - y;
    const Ints octave = Load<Ints>(entries.octaves + i);
    const Ints wanted = (dx * dx + dy * dy <= radius_squared) & (octave >= least) & (octave <= most);
    const uint32_t in_run = std::min<uint32_t>(kLanes, entries.count - i);
    for (uint32_t k = 0; k < in_run; ++k) {
      features[count] = entries.features[i + k];
      count += static_cast<size_t>(wanted[k] & 1);
    }
  }
  return count;
}

#if defined(__x86_64__)
constexpr uint32_t kWideLanes = 8;
static_assert(kWideLanes <= FeatureGrid::kSlack);

/// For each set of eight lanes, which are those that are in it, in order; and how many.
struct LanesOfSet {
  std::array<std::array<uint8_t, kWideLanes>, 256> lanes{};
  std::array<uint8_t, 256> count{};
};
constexpr LanesOfSet MakeLanesOfSet() {
  LanesOfSet table;
  for (size_t set = 0; set < 256; ++set) {
    for (uint8_t lane = 0; lane < kWideLanes; ++lane) {
      if (((set >> lane) & 1) != 0) table.lanes[set][table.count[set]++] = lane;
    }
  }
  return table;
}
constexpr LanesOfSet kLanesOfSet = MakeLanesOfSet();

/// The same, eight at a time. Writes up to kWideLanes features beyond the last one.
__attribute__((target("avx2"))) size_t CollectAvx2(const Entries& entries, const Wanted& circle,
                                                   uint32_t* features) {
  const __m256 x = _mm256_set1_ps(circle.x_px), y = _mm256_set1_ps(circle.y_px);
  const __m256 radius_squared = _mm256_set1_ps(circle.radius_squared);
  const __m256i below = _mm256_set1_epi32(circle.min_octave), above = _mm256_set1_epi32(circle.max_octave);
  size_t count = 0;
  for (uint32_t i = 0; i < entries.count; i += kWideLanes) {
    const __m256 dx = _mm256_sub_ps(_mm256_loadu_ps(entries.x_px + i), x);
    const __m256 dy = _mm256_sub_ps(_mm256_loadu_ps(entries.y_px + i), y);
    const __m256i octave = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(entries.octaves + i));
    const __m256 inside = _mm256_cmp_ps(_mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy)),
                                        radius_squared, _CMP_LE_OQ);
    const __m256i of_others =
        _mm256_or_si256(_mm256_cmpgt_epi32(below, octave), _mm256_cmpgt_epi32(octave, above));
    const uint32_t in_run = 0xffU >> (kWideLanes - std::min(kWideLanes, entries.count - i));
    const uint32_t set =
        static_cast<uint32_t>(_mm256_movemask_ps(_mm256_andnot_ps(_mm256_castsi256_ps(of_others), inside))) &
        in_run;
    const __m256i lanes = _mm256_cvtepu8_epi32(
        _mm_loadl_epi64(reinterpret_cast<const __m128i*>(kLanesOfSet.lanes[set].data())));
    const __m256i all = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(entries.features + i));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(features + count),
                        _mm256_permutevar8x32_epi32(all, lanes));
    count += kLanesOfSet.count[set];
  }
  return count;
}
#endif

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
                                    int max_octave, uint32_t* features, VectorPath path) const {
  const Circle circle(center_px, radius_px, min_octave, max_octave);
  size_t count = 0;
  ForEachRun(circle, [&](const Run& run) { count += CollectOf(circle, run, features + count, path); });
  return count;
}

size_t FeatureGrid::CollectOf(const Circle& circle, const Run& run, uint32_t* features,
                              [[maybe_unused]] VectorPath path) const {
  const Entries entries = {&x_px_[run.begin], &y_px_[run.begin], &octaves_[run.begin], &features_[run.begin],
                           run.end - run.begin};
  const float radius_squared = circle.radius_px * circle.radius_px;
  const Wanted wanted = {circle.x_px, circle.y_px, radius_squared, circle.min_octave, circle.max_octave};
#if defined(__x86_64__)
  if (Takes(VectorPath::kAvx2, path)) return CollectAvx2(entries, wanted, features);
#endif
  return Collect(entries, wanted, features);
}

FeatureGrid::Rows FeatureGrid::RowsOf(const Circle& circle) const {
  if (features_.empty() || !(circle.radius_px >= 0.0F) || !std::isfinite(circle.x_px) ||
      !std::isfinite(circle.y_px)) {
    return {};
  }
  return {ClampedCell(circle.y_px - circle.radius_px, kCellSizePx, rows_),
          ClampedCell(circle.y_px + circle.radius_px, kCellSizePx, rows_) + 1};
}

FeatureGrid::Run FeatureGrid::RunOf(const Circle& circle, int row) const {
  const double radius = circle.radius_px;
  const double top = row * kCellSizePx, bottom = top + kCellSizePx;
  double away = 0;
  if (circle.y_px < top && row > 0) away = top - circle.y_px;
  if (circle.y_px > bottom && row + 1 < rows_) away = circle.y_px - bottom;
  const double half = std::sqrt(std::max(0.0, radius * radius - away * away)) + kRoundingPx;
  return RunOf(ColumnsBetween(circle.x_px - half, circle.x_px + half), row);
}

FeatureGrid::Run FeatureGrid::ColumnsBetween(double left_px, double right_px) const {
  return {static_cast<uint32_t>(ClampedCell(left_px, kCellSizePx, columns_)),
          static_cast<uint32_t>(ClampedCell(right_px, kCellSizePx, columns_)) + 1};
}

size_t FeatureGrid::CellOf(const Eigen::Vector2d& uv_px) const {
  return CellIndex(ClampedCell(uv_px.x(), kCellSizePx, columns_), ClampedCell(uv_px.y(), kCellSizePx, rows_));
}

}  // namespace dmslam
