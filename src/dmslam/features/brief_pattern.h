#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace dmslam {

/// One comparison of a descriptor: is the pixel at (x0, y0) darker than the one at (x1, y1)? Offsets from the
/// keypoint in an upright patch [px of its level], within the disc of radius 15.
struct BriefTest {
  int8_t x0, y0, x1, y1;
};

/// The 256 comparisons, in the order of the descriptor's bits. Learned by tools/learn_brief_pattern.
const std::array<BriefTest, 256>& BriefPattern();

/// A set of comparisons turned to every orientation of a keypoint (256 steps per turn), as places in a patch
/// of 32 bytes per row (see ImageKernels::compare_pairs).
class SteeredPattern {
 public:
  explicit SteeredPattern(std::span<const BriefTest> tests);

  /// The places of all tests at an orientation, two per test.
  const uint16_t* Places(uint8_t angle) const { return places_.data() + angle * 2 * num_tests_; }

 private:
  size_t num_tests_;
  std::vector<uint16_t> places_;
};

}  // namespace dmslam
