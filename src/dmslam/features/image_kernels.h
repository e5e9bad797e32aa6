#pragma once

#include <cstddef>
#include <cstdint>

namespace dmslam {

/// Which instructions work on the pixels. All give the same result, bit for bit.
enum class SimdPath {
  kBest,      ///< the fastest that this CPU has
  kPortable,  ///< plain C++
  kSse2,      ///< x86-64 baseline
  kAvx2,
};

/// Bytes beyond the last pixel of a row that a kernel may read or write; rows of buffers are at least this
/// much longer.
inline constexpr int kRowPadding = 64;

/// Eight neighbouring pixels of a resized row: where their sources begin, which of the 16 bytes from there
/// are the left and right source of each, and the weights of these in 64ths.
struct ResizeBlock {
  int32_t source_begin = 0;
  uint8_t pick[16] = {};
  int8_t weight[16] = {};
};

/// Position and FAST score of a corner within its level.
struct Corner {
  int16_t x = 0;
  int16_t y = 0;
  int16_t score = 0;
};

/// Rows of FAST scores y-1, y, y+1, for the suppression of non-maxima.
struct ScoreRows {
  const uint8_t* above;
  const uint8_t* here;
  const uint8_t* below;
};

/// The inner loops of the extractor. Buffers: rows `stride` bytes apart, see kRowPadding.
struct ImageKernels {
  /// FAST-9 scores of the pixels [x_begin, x_end) of a row, zero in all others of [0, x_end + kRowPadding /
  /// 2). The score is the largest t such that nine contiguous pixels of the circle of 16 are all brighter, or
  /// all darker, than the centre by at least t; where it would not exceed `threshold` zero is written.
  /// Returns whether any is not zero. (Rosten, Drummond, Machine learning for high-speed corner detection,
  /// ECCV 2006.)
  bool (*fast_scores)(const uint8_t* row, ptrdiff_t stride, int x_begin, int x_end, int threshold,
                      uint8_t* scores);

  /// Corners of a row: scores that exceed the four neighbours before them in reading order and are not below
  /// the four behind them. Appends at most (x_end - x_begin) / 2 + 1 corners at `out`; returns how many.
  int (*local_maxima)(const ScoreRows& rows, int x_begin, int x_end, int y, Corner* out);

  /// One row of the resized image: pixels blended from rows `upper` and `lower` with `lower_weight` / 64 of
  /// the lower, then along the row as `blocks` say. `blended` holds a source row. Writes 8 * num_blocks
  /// pixels.
  void (*resize_row)(const uint8_t* upper, const uint8_t* lower, int lower_weight, int source_width,
                     const ResizeBlock* blocks, int num_blocks, uint8_t* blended, uint8_t* out);

  /// Triangle filter of seven taps (1 2 3 4 3 2 1) / 16, sigma 1.58, down the columns: `rows` are the seven
  /// source rows.
  void (*blur_down)(const uint8_t* const* rows, int width, uint8_t* out);
  /// The same along a row; reads `source` from -3 to width + 2.
  void (*blur_along)(const uint8_t* source, int width, uint8_t* out);

  /// FAST-9 scores, whatever their size, of the 3 x 3 pixels around `pixel`, in reading order.
  void (*scores_around)(const uint8_t* pixel, ptrdiff_t stride, uint8_t* scores);

  /// First moments of the disc of radius 15 around `center`: sums of x * pixel and of y * pixel.
  void (*disc_moments)(const uint8_t* center, ptrdiff_t stride, int* moment_x, int* moment_y);

  /// 256 comparisons within the patch of 31 x 31 pixels around `center`: bit i is set when the pixel at
  /// places[2 i] is darker than the one at places[2 i + 1]; place = (y + 15) * 32 + x + 15. Writes four
  /// words.
  void (*compare_pairs)(const uint8_t* center, ptrdiff_t stride, const uint16_t* places, uint64_t* words);
};

/// True when this CPU can run `path`.
bool HasSimdPath(SimdPath path);

/// The kernels of a path; throws InvariantError when the CPU cannot run it.
const ImageKernels& KernelsOn(SimdPath path);

}  // namespace dmslam
