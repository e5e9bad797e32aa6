#include <gtest/gtest.h>

#include "dmslam/features/types.h"

namespace dmslam {
namespace {

TEST(PyramidTable, SaysWhatThePyramidSaysToTheLastBit) {
  Pyramid large;
  large.levels = 16;
  large.scale_factor = 1.37;
  large.finest_px = 0.55;
  large.coarser_levels = 5;
  for (const Pyramid& pyramid : {Pyramid(), large}) {
    const PyramidTable table(pyramid);
    for (uint8_t octave = 0; octave < pyramid.NumLevels(); ++octave) {
      EXPECT_EQ(table.Scale(octave), pyramid.Scale(octave));
      EXPECT_EQ(table.SearchScale(octave), pyramid.SearchScale(octave));
      EXPECT_EQ(table.SigmaSquared(octave), pyramid.SigmaSquared(octave));
    }
  }
}

}  // namespace
}  // namespace dmslam
