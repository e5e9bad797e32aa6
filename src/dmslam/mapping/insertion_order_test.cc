#include "dmslam/mapping/insertion_order.h"

#include <gtest/gtest.h>

#include "dmslam/mapping/testing/wall_scene.h"

namespace dmslam {
namespace {

KeyframeId Id(uint32_t frame) { return WallScene::Id(frame); }

/// Keyframes are inserted in any order of their frames.
class Order : public testing::Test {
 protected:
  void Insert(std::initializer_list<uint32_t> frames) {
    for (const uint32_t frame : frames) {
      scene_.AddKeyframe(map_, frame, 0);
      order_.Add(Id(frame));
    }
  }

  WallScene scene_{3, 3};
  MapEditor map_{TestCamera(), Pyramid()};
  InsertionOrder order_;
};

TEST_F(Order, CountsKeyframesAsTheyCameNotAsTheyWereSeen) {
  Insert({50, 60, 70, 40});
  EXPECT_EQ(order_.CountSince(map_, Id(40), 3), 0);
  EXPECT_EQ(order_.CountSince(map_, Id(60), 3), 2);
  EXPECT_EQ(order_.CountSince(map_, Id(50), 2), 2) << "no more than asked for";
}

TEST_F(Order, CulledKeyframesCount) {
  Insert({50, 40, 30});
  map_.RemoveKeyframe(map_.At(Id(40)));
  EXPECT_EQ(order_.CountSince(map_, Id(50), 3), 2);
  EXPECT_EQ(order_.Newest(map_, 1, 8), (std::vector<KeyframeId>{Id(30), Id(50)}));
}

TEST_F(Order, KeyframesOfAnotherCameraDoNotCount) {
  const auto of_other = [](uint32_t frame) { return KeyframeId::Make(Id(1).session(), frame, 1); };
  for (const uint32_t frame : {10u, 20u, 30u}) {
    Insert({frame});
    Keyframe keyframe;
    keyframe.id = of_other(frame);
    keyframe.map_id = 1;
    keyframe.features = MakeFrameFeatures(FeatureSet(), map_.camera(), map_.pyramid());
    map_.AddKeyframe(std::move(keyframe));
    order_.Add(of_other(frame));
  }
  EXPECT_EQ(order_.CountSince(map_, Id(10), 10), 2);
  EXPECT_EQ(order_.CountSince(map_, of_other(20), 10), 1);
  EXPECT_EQ(order_.Newest(map_, 1, 1).size(), 2u) << "the newest of each";
}

TEST_F(Order, KeyframesOfADroppedMapDoNotCount) {
  Insert({50, 40});
  EXPECT_EQ(order_.CountSince(map_, Id(50), 3), 1);
  map_.DropMap(1);
  EXPECT_EQ(order_.CountSince(map_, Id(50), 3), 0);
}

TEST_F(Order, OfAMapOfOthersIsAssumedToBeThatOfItsStamps) {
  Insert({50, 40, 60});
  InsertionOrder assumed;
  assumed.Assume(map_);
  EXPECT_EQ(assumed.Newest(map_, 1, 8), (std::vector<KeyframeId>{Id(60), Id(50), Id(40)}));
  MapProgress progress;
  progress.settled = Id(40);
  map_.SetProgress(progress);
  assumed.Assume(map_);
  EXPECT_EQ(assumed.Newest(map_, 1, 8), (std::vector<KeyframeId>{Id(40), Id(60), Id(50)}));
}

}  // namespace
}  // namespace dmslam
