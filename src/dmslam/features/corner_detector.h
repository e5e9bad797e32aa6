#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/features/image_kernels.h"
#include "dmslam/features/image_pyramid.h"

namespace dmslam {

/// Finds the FAST-9 corners of an image, each a maximum of the score among its eight neighbours (Rosten,
/// Drummond, ECCV 2006).
class CornerDetector {
 public:
  /// Corners whose score exceeds `threshold`, at least `border_px` >= 4 away from the image's edges, in
  /// reading order, into `corners` (cleared first). Reuses memory.
  void Detect(const PaddedImage& image, int threshold, int border_px, const ImageKernels& kernels,
              std::vector<Corner>* corners);

 private:
  std::vector<uint8_t> scores_;  ///< three rows in turn
  std::vector<Corner> row_corners_;
};

/// Chooses corners that are strong and spread over the image.
///
/// The image is divided into square cells. In each cell corners are ranked by score, and one of rank r (0 =
/// best) competes with score * decay^r: decay 1 takes the strongest wherever they are, decay 0 one of each
/// cell after the other. In a cell that has a corner above the strong threshold, those below it do not
/// compete at all.
class CornerSelector {
 public:
  struct Options {
    int cell_size_px = 32;
    int strong_threshold = 20;
    double rank_decay = 0.8;
  };

  /// At most `count` of `corners` (in reading order), into `chosen` in reading order. Ties go to the earlier
  /// corner. Reuses memory.
  void Select(std::span<const Corner> corners, int count, int width, int height, const Options& options,
              std::vector<Corner>* chosen);

  /// Makes room for that many corners.
  void Reserve(size_t num_corners);

 private:
  struct Candidate {
    float worth;
    uint32_t index;
  };

  void SortIntoCells(std::span<const Corner> corners, int width, int height, int cell_size_px);
  void RankCell(std::span<uint64_t> cell, const Options& options);

  std::vector<uint32_t> column_of_, row_of_;  ///< of cells, for each x, y
  std::vector<uint32_t> cell_starts_;
  std::vector<uint64_t> by_cell_;  ///< each corner's score and index, sorted by cell
  std::vector<Candidate> candidates_;
};

}  // namespace dmslam
