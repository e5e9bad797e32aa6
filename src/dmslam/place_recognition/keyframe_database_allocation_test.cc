// A keyframe is added between two frames: it must not have to make the table of all words.
#include <gtest/gtest.h>

#include <utility>

#include "dmslam/place_recognition/keyframe_database.h"
#include "dmslam/util/testing/allocations.h"

namespace dmslam {
namespace {

constexpr uint32_t kWords = 100'000;
constexpr std::size_t kSmall = 4096;

/// The largest allocation of adding a keyframe.
std::size_t LargestOfAdding(KeyframeDatabase* database, uint32_t frame) {
  BowVector words = {{7, 0.5F}, {kWords - 1, 0.5F}};
  testing::allocations = {};
  database->Add(KeyframeId::Make(1, frame), std::move(words));
  return testing::allocations.largest;
}

TEST(KeyframeDatabaseAllocation, TheTableOfWordsIsThereBeforeTheFirstKeyframe) {
  KeyframeDatabase unprepared;
  EXPECT_GT(LargestOfAdding(&unprepared, 1), kSmall) << "the counter works";
  KeyframeDatabase database({}, kWords);
  EXPECT_LE(LargestOfAdding(&database, 1), kSmall);
  database.Clear();
  EXPECT_LE(LargestOfAdding(&database, 1), kSmall) << "it stays when the map is forgotten";
}

}  // namespace
}  // namespace dmslam
