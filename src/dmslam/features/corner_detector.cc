#include "dmslam/features/corner_detector.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

/// The stronger one is the lesser, then the one with the lesser index.
uint64_t Rank(const Corner& corner, uint32_t index) {
  const int less = INT16_MAX - corner.score;
  return static_cast<uint64_t>(less) << 32 | index;
}
int ScoreOf(uint64_t rank) { return INT16_MAX - static_cast<int>(rank >> 32); }
uint32_t IndexOf(uint64_t rank) { return static_cast<uint32_t>(rank); }

/// The cell of each coordinate below `length`; returns how many cells there are.
uint32_t ListCells(int length, int cell_size, std::vector<uint32_t>* cells) {
  cells->clear();
  uint32_t count = 0;
  for (int begin = 0; begin < length; begin += cell_size)
    cells->insert(cells->end(), static_cast<size_t>(std::min(cell_size, length - begin)), count++);
  return count;
}

}  // namespace

void CornerDetector::Detect(const PaddedImage& image, int threshold, int border_px,
                            const ImageKernels& kernels, std::vector<Corner>* corners) {
  DMSLAM_CHECK(border_px >= 4, "the circle and its neighbours must lie in the image");
  corners->clear();
  const int x_begin = border_px, x_end = image.width() - border_px;
  const int y_begin = border_px, y_end = image.height() - border_px;
  if (x_begin >= x_end || y_begin >= y_end) return;
  const size_t row_size = static_cast<size_t>(image.width()) + kRowPadding;
  scores_.assign(3 * row_size, 0);
  row_corners_.resize(static_cast<size_t>(x_end - x_begin) / 2 + 1);
  uint8_t* rows[3] = {scores_.data(), scores_.data() + row_size, scores_.data() + 2 * row_size};
  bool any_here = false;  // in the row whose corners come next, which is rows[1]
  for (int y = y_begin; y <= y_end; ++y) {
    bool any_below = false;
    if (y < y_end) {
      any_below = kernels.fast_scores(image.row(y), image.stride(), x_begin, x_end, threshold, rows[2]);
    } else {
      std::memset(rows[2], 0, row_size);
    }
    if (any_here) {
      const int count =
          kernels.local_maxima({rows[0], rows[1], rows[2]}, x_begin, x_end, y - 1, row_corners_.data());
      corners->insert(corners->end(), row_corners_.begin(), row_corners_.begin() + count);
    }
    any_here = any_below;
    std::rotate(rows, rows + 1, rows + 3);
  }
}

void CornerSelector::Select(std::span<const Corner> corners, int count, int width, int height,
                            const Options& options, std::vector<Corner>* chosen) {
  chosen->clear();
  if (count <= 0 || corners.empty()) return;
  SortIntoCells(corners, width, height, options.cell_size_px);
  candidates_.clear();
  for (size_t cell = 0; cell + 1 < cell_starts_.size(); ++cell) {
    const uint32_t begin = cell_starts_[cell], end = cell_starts_[cell + 1];
    if (begin < end) RankCell(std::span(by_cell_).subspan(begin, end - begin), options);
  }
  if (candidates_.size() > static_cast<size_t>(count)) {
    std::nth_element(candidates_.begin(), candidates_.begin() + count, candidates_.end(),
                     [](const Candidate& a, const Candidate& b) {
                       return a.worth != b.worth ? a.worth > b.worth : a.index < b.index;
                     });
    candidates_.resize(static_cast<size_t>(count));
  }
  std::sort(candidates_.begin(), candidates_.end(),
            [](const Candidate& a, const Candidate& b) { return a.index < b.index; });
  for (const Candidate& candidate : candidates_) chosen->push_back(corners[candidate.index]);
}

void CornerSelector::Reserve(size_t num_corners) {
  by_cell_.reserve(num_corners);
  candidates_.reserve(num_corners);
}

void CornerSelector::SortIntoCells(std::span<const Corner> corners, int width, int height, int cell_size_px) {
  const uint32_t columns = ListCells(width, cell_size_px, &column_of_);
  const uint32_t rows = ListCells(height, cell_size_px, &row_of_);
  const auto cell_of = [&](const Corner& corner) {
    return row_of_[static_cast<size_t>(corner.y)] * columns + column_of_[static_cast<size_t>(corner.x)];
  };
  cell_starts_.assign(size_t{columns} * rows + 1, 0);
  for (const Corner& corner : corners) ++cell_starts_[cell_of(corner)];
  uint32_t end = 0;
  for (uint32_t& start : cell_starts_) {
    end += start;
    start = end;
  }
  by_cell_.resize(corners.size());
  for (size_t i = corners.size(); i-- > 0;)
    by_cell_[--cell_starts_[cell_of(corners[i])]] = Rank(corners[i], static_cast<uint32_t>(i));
}

void CornerSelector::RankCell(std::span<uint64_t> cell, const Options& options) {
  std::sort(cell.begin(), cell.end());
  const bool has_strong = ScoreOf(cell.front()) > options.strong_threshold;
  const float decay = static_cast<float>(options.rank_decay);
  float factor = 1.0F;
  for (const uint64_t rank : cell) {
    const int score = ScoreOf(rank);
    if (has_strong && score <= options.strong_threshold) break;
    candidates_.push_back({static_cast<float>(score) * factor, IndexOf(rank)});
    factor *= decay;
  }
}

}  // namespace dmslam
