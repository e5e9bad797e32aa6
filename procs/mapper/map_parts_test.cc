#include "mapper/map_parts.h"

#include <gtest/gtest.h>

#include <vector>

#include "dmslam/map/replica.h"
#include "dmslam/map/testing/random_editor.h"

namespace dmslam {
namespace {

constexpr size_t kSmallPart = 4000;  // bytes: of some keyframes there are several

class MapPartsTest : public testing::Test {
 protected:
  MapPartsTest() { editor_.Steps(200); }
  const Map& map() { return editor_.map(); }
  /// Everything that comes out, one after the other in its time.
  std::vector<MapDelta> TakeAll() {
    std::vector<MapDelta> all;
    while (!parts_.empty()) {
      now_ns_ = parts_.next_ns();
      std::optional<MapDelta> next = parts_.TakeNext(now_ns_, true);
      if (!next) break;
      all.push_back(std::move(*next));
    }
    return all;
  }

  RandomEditor editor_{3};
  MapParts parts_;
  int64_t now_ns_ = 0;
};

TEST_F(MapPartsTest, TogetherAreTheMapWithTheNewestKeyframeFirst) {
  parts_.Cut(map(), kSmallPart);
  const std::vector<MapDelta> all = TakeAll();
  ASSERT_GT(all.size(), 3U);
  EXPECT_EQ(all.front().keyframes.front().id, map().keyframes().rbegin()->first);
  Replica replica(TestCamera(), Pyramid());
  for (const MapDelta& part : all) replica.Apply(part);
  ExpectSameMaps(map(), replica);
  EXPECT_TRUE(parts_.empty());
}

TEST_F(MapPartsTest, OneGoesOutAtATimeAndNotTooFast) {
  EXPECT_EQ(parts_.next_ns(), INT64_MAX);
  EXPECT_FALSE(parts_.TakeNext(0, true)) << "there is none";
  parts_.Cut(map(), kSmallPart);
  constexpr int64_t kBegin = 1'000'000'000;
  EXPECT_LE(parts_.next_ns(), kBegin) << "the first one may go at once";
  EXPECT_TRUE(parts_.TakeNext(kBegin, true));
  EXPECT_EQ(parts_.next_ns(), kBegin + MapParts::kEveryNs);
  EXPECT_FALSE(parts_.TakeNext(kBegin + MapParts::kEveryNs - 1, true));
  EXPECT_TRUE(parts_.TakeNext(kBegin + MapParts::kEveryNs, true));
}

TEST_F(MapPartsTest, WaitForRoomAndAreNotLost) {
  parts_.Cut(map(), kSmallPart);
  constexpr int64_t kBegin = 1'000'000'000;
  EXPECT_FALSE(parts_.TakeNext(kBegin, false));
  EXPECT_FALSE(parts_.TakeNext(kBegin + 1, true)) << "it is asked again as long after";
  now_ns_ = parts_.next_ns();
  EXPECT_EQ(now_ns_, kBegin + MapParts::kEveryNs);
  const auto next = parts_.TakeNext(now_ns_, true);
  ASSERT_TRUE(next);
  EXPECT_EQ(next->keyframes.front().id, map().keyframes().rbegin()->first) << "the first one";
}

TEST_F(MapPartsTest, AreDroppedForWhatIsNewer) {
  parts_.Cut(map(), kSmallPart);
  parts_.Drop();
  EXPECT_TRUE(parts_.empty());
  EXPECT_FALSE(parts_.TakeNext(1'000'000'000, true));
  EXPECT_EQ(parts_.next_ns(), INT64_MAX);
}

TEST_F(MapPartsTest, OfAnotherMapTakeTheirPlace) {
  parts_.Cut(map(), kSmallPart);
  RandomEditor other(4);
  other.Steps(100);
  parts_.Cut(other.map(), kSmallPart);
  Replica replica(TestCamera(), Pyramid());
  for (const MapDelta& part : TakeAll()) replica.Apply(part);
  ExpectSameMaps(other.map(), replica);
}

}  // namespace
}  // namespace dmslam
