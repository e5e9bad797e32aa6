#include "dmslam/map/landmark_set.h"

#include <gtest/gtest.h>

#include <set>

#include "dmslam/util/random.h"

namespace dmslam {
namespace {

TEST(LandmarkSet, HoldsNothingAtFirst) {
  LandmarkSet set;
  EXPECT_FALSE(set.Holds({0}));
  EXPECT_FALSE(set.Holds({1}));
  set.Finish();
  EXPECT_FALSE(set.Holds({0}));
  EXPECT_FALSE(set.Holds({5}));
}

TEST(LandmarkSet, HoldsWhatWasAddedHoweverFarApart) {
  for (const uint64_t range : {100ULL, 5'000ULL, 40'000ULL, 1ULL << 50}) {
    Random random(3);
    LandmarkSet set;
    for (int round = 0; round < 3; ++round) {  // memory is used again
      set.Clear();
      std::set<LandmarkId> expected;
      const uint64_t first = 1 + random.Next() % range;
      for (int i = 0; i < 60; ++i) {
        const LandmarkId id{first + random.Next() % range};
        expected.insert(id);
        set.Add(id);
      }
      set.Finish();
      EXPECT_EQ(set.size(), 60u);
      for (const LandmarkId id : expected) EXPECT_TRUE(set.Holds(id)) << range;
      for (int i = 0; i < 500; ++i) {
        const LandmarkId id{first - 1 + random.Next() % (range + 2)};
        EXPECT_EQ(set.Holds(id), expected.contains(id)) << range;
      }
      EXPECT_EQ(set.Holds({0}), expected.contains({0}));
      EXPECT_EQ(set.Holds({UINT64_MAX}), expected.contains({UINT64_MAX}));
    }
  }
}

TEST(LandmarkSet, MayGrowWhenItWasFinished) {
  LandmarkSet set;
  set.Add({100});
  set.Finish();
  set.Add({7});
  set.Add({900'000'000});
  set.Finish();
  for (const uint64_t id : {7, 100, 900'000'000}) EXPECT_TRUE(set.Holds({id}));
  EXPECT_FALSE(set.Holds({8}));
}

}  // namespace
}  // namespace dmslam
