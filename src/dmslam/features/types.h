#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <vector>

namespace dmslam {

/// An 8-bit grey image that somebody else owns. Row-major, `stride` bytes from row to row.
struct GrayView {
  const uint8_t* data = nullptr;
  int width = 0;
  int height = 0;
  ptrdiff_t stride = 0;

  const uint8_t* row(int y) const { return data + y * stride; }
};

/// A keypoint as it travels: position in the raw (distorted) image, in sixteenths of a pixel, so that every
/// process computes with the same numbers.
struct Keypoint {
  uint16_t x_q4 = 0;   ///< x [px] * 16
  uint16_t y_q4 = 0;   ///< y [px] * 16
  uint8_t octave = 0;  ///< pyramid level, 0 = the finest
  uint8_t angle = 0;   ///< orientation, 256 steps per turn

  double x_px() const { return x_q4 / 16.0; }
  double y_px() const { return y_q4 / 16.0; }
  auto operator<=>(const Keypoint&) const = default;
};

/// 256-bit ORB descriptor (Rublee et al., ORB, ICCV 2011).
struct alignas(32) Descriptor {
  std::array<uint64_t, 4> words{};
  auto operator<=>(const Descriptor&) const = default;
};

/// Bits set in the four words together. Where the processor that is compiled for has no instruction for it,
/// std::popcount calls a function for every word; here the words are added up before the bits of each are.
inline int CountBits(const std::array<uint64_t, 4>& words) {
#if defined(__x86_64__) && !defined(__POPCNT__)
  const auto nibbles = [](uint64_t x) {
    x -= (x >> 1) & 0x5555555555555555ULL;
    return (x & 0x3333333333333333ULL) + ((x >> 2) & 0x3333333333333333ULL);
  };
  const auto bytes = [](uint64_t x) {
    return (x & 0x0f0f0f0f0f0f0f0fULL) + ((x >> 4) & 0x0f0f0f0f0f0f0f0fULL);
  };
  const uint64_t sums =
      bytes(nibbles(words[0]) + nibbles(words[1])) + bytes(nibbles(words[2]) + nibbles(words[3]));
  const uint64_t pairs = (sums & 0x00ff00ff00ff00ffULL) + ((sums >> 8) & 0x00ff00ff00ff00ffULL);
  return static_cast<int>((pairs * 0x0001000100010001ULL) >> 48);
#else
  return std::popcount(words[0]) + std::popcount(words[1]) + std::popcount(words[2]) +
         std::popcount(words[3]);
#endif
}

/// Number of bits in which two descriptors differ, 0..256.
inline int HammingDistance(const Descriptor& a, const Descriptor& b) {
  return CountBits(
      {a.words[0] ^ b.words[0], a.words[1] ^ b.words[1], a.words[2] ^ b.words[2], a.words[3] ^ b.words[3]});
}

/// More than any two differ by: where there is none to compare with.
inline constexpr int kNoDistance = 257;

/// Keypoints of one image and their descriptors, same order and length. The other lists are as long, or empty
/// where nothing of the kind was measured. A copy lies on the heap, wherever the original lies.
struct FeatureSet {
  std::pmr::vector<Keypoint> keypoints;
  std::pmr::vector<Descriptor> descriptors;
  std::pmr::vector<float> depths_m;        ///< along the optical axis [m]; -1: not measured
  std::pmr::vector<float> depth_sigmas_m;  ///< standard deviations of the depths [m]; -1: not measured
  std::pmr::vector<float> sigmas_px;       ///< of the positions; empty: Pyramid::Sigma says it

  size_t size() const { return keypoints.size(); }
};

/// The image pyramid that keypoints' octaves refer to.
struct Pyramid {
  int levels = 8;
  double scale_factor = 1.2;

  /// The settings, for dmslam/settings: key, field, bounds, unit, what it does.
  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("features.levels", levels, 1, 16, "",
             "levels of the image pyramid (of images larger than 640 x 480: more)");
    v.Number("features.scale_factor", scale_factor, 1.05, 2, "", "between two levels");
  }

  /// Size of a pixel of level 0 in pixels of the image: below 1 where small images are enlarged first. No
  /// setting: OfImages says it.
  double finest_px = 1.0;

  /// Levels beyond `levels`, over images larger than 640 x 480: the coarsest level is about as large in all
  /// images, so that what is blurred, or near, is found in large ones, too. No setting: OfImages says it.
  int coarser_levels = 0;

  /// The same pyramid over images of this size (FinestPx, CoarserLevels).
  Pyramid OfImages(int width_px, int height_px) const;

  int NumLevels() const { return levels + coarser_levels; }

  /// Size of one pixel of a level in pixels of level 0.
  double Scale(int octave) const { return std::pow(scale_factor, octave); }
  /// How much wider than at the finest level a keypoint is searched for. With coarser levels the first ones
  /// show what an image of 640 x 480 does not: they are searched as wide as its finest.
  double SearchScale(int octave) const {
    return Scale(octave > coarser_levels ? octave - coarser_levels : 0);
  }
  /// Standard deviation of a keypoint's position [px of the image]: one pixel of its level.
  double Sigma(int octave) const { return finest_px * Scale(octave); }
  double SigmaSquared(int octave) const { return finest_px * finest_px * std::pow(scale_factor, 2 * octave); }
};

/// What a pyramid says of its levels, looked up: the same numbers.
class PyramidTable {
 public:
  explicit PyramidTable(const Pyramid& pyramid) {
    for (int octave = 0; octave < kLevels; ++octave) {
      const size_t i = static_cast<size_t>(octave);
      scales_[i] = pyramid.Scale(octave);
      search_scales_[i] = pyramid.SearchScale(octave);
      sigmas_squared_[i] = pyramid.SigmaSquared(octave);
    }
  }

  double Scale(uint8_t octave) const { return scales_[octave % kLevels]; }
  double SearchScale(uint8_t octave) const { return search_scales_[octave % kLevels]; }
  double SigmaSquared(uint8_t octave) const { return sigmas_squared_[octave % kLevels]; }

 private:
  static constexpr int kLevels = 64;  ///< no pyramid has more
  std::array<double, kLevels> scales_{}, search_scales_{}, sigmas_squared_{};
};

}  // namespace dmslam
