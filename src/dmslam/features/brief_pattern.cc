#include "dmslam/features/brief_pattern.h"

#include <cmath>
#include <numbers>

namespace dmslam {
namespace {

constexpr std::array<BriefTest, 256> kPattern = {{
#include "dmslam/features/brief_pattern_table.inc"
}};

/// Place of a point turned by an angle (clockwise on the screen, as y points down).
uint16_t PlaceOf(int x, int y, double cosine, double sine) {
  const long turned_x = std::lround(cosine * x - sine * y);
  const long turned_y = std::lround(sine * x + cosine * y);
  return static_cast<uint16_t>((turned_y + 15) * 32 + turned_x + 15);
}

}  // namespace

const std::array<BriefTest, 256>& BriefPattern() { return kPattern; }

SteeredPattern::SteeredPattern(std::span<const BriefTest> tests) : num_tests_(tests.size()) {
  places_.reserve(256 * 2 * num_tests_);
  for (int angle = 0; angle < 256; ++angle) {
    const double radians = angle * 2.0 * std::numbers::pi / 256.0;
    const double cosine = std::cos(radians), sine = std::sin(radians);
    for (const BriefTest& test : tests) {
      places_.push_back(PlaceOf(test.x0, test.y0, cosine, sine));
      places_.push_back(PlaceOf(test.x1, test.y1, cosine, sine));
    }
  }
}

}  // namespace dmslam
