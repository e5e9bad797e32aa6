#include "dmslam/map/landmark_table.h"

#include <gtest/gtest.h>

#include <map>
#include <utility>
#include <vector>

#include "dmslam/util/random.h"

namespace dmslam {
namespace {

Landmark Make(uint16_t epoch, uint64_t number) {
  Landmark landmark;
  landmark.id = LandmarkId::Make(epoch, number);
  landmark.map_id = static_cast<MapId>(number);
  return landmark;
}

TEST(LandmarkTable, KnowsNobodyAtFirst) {
  LandmarkTable table;
  EXPECT_EQ(table.size(), 0u);
  EXPECT_EQ(table.Find(LandmarkId::Make(1, 1)), nullptr);
  table.Erase(LandmarkId::Make(1, 1));
  EXPECT_EQ(table.size(), 0u);
}

/// Many are added and erased, by numbers of two epochs that run beside each other.
TEST(LandmarkTable, AgreesWithAMap) {
  Random random(5);
  LandmarkTable table;
  std::map<LandmarkId, const Landmark*> expected;
  for (int round = 0; round < 20'000; ++round) {
    const auto epoch = static_cast<uint16_t>(1 + random.Next() % 2);
    const LandmarkId id = LandmarkId::Make(epoch, 1 + random.Next() % 900);
    if (expected.contains(id)) {
      table.Erase(id);
      expected.erase(id);
    } else {
      expected[id] = &table.Insert(Make(epoch, id.number()));
    }
  }
  ASSERT_EQ(table.size(), expected.size());
  for (uint64_t number = 1; number <= 900; ++number) {
    for (const uint16_t epoch : {uint16_t{1}, uint16_t{2}}) {
      const LandmarkId id = LandmarkId::Make(epoch, number);
      const auto there = expected.find(id);
      EXPECT_EQ(table.Find(id), there == expected.end() ? nullptr : there->second);
    }
  }
  size_t visited = 0;
  table.ForEach([&](const Landmark& landmark) {
    ++visited;
    EXPECT_EQ(expected.at(landmark.id), &landmark);
  });
  EXPECT_EQ(visited, expected.size());
}

TEST(LandmarkTable, VisitsThoseThatAreAskedForInTheirOrder) {
  LandmarkTable table;
  for (uint64_t number = 1; number <= 100; ++number) table.Insert(Make(1, number));
  for (const size_t count : {0u, 1u, 7u, 8u, 9u, 100u}) {  // some are fetched ahead
    std::vector<LandmarkId> asked, visited;
    for (size_t i = 0; i < count; ++i) asked.push_back(LandmarkId::Make(1, 1 + 37 * i % 100));
    table.ForEachOf(asked, [&](const Landmark& landmark) {
      EXPECT_EQ(&landmark, table.Find(landmark.id));
      visited.push_back(landmark.id);
    });
    EXPECT_EQ(visited, asked);
  }
}

TEST(LandmarkTable, ACopyIsAnother) {
  LandmarkTable table;
  for (uint64_t number = 1; number <= 100; ++number) table.Insert(Make(1, number));
  LandmarkTable copy(table);
  table.Find(LandmarkId::Make(1, 7))->map_id = 1000;
  table.Erase(LandmarkId::Make(1, 8));
  EXPECT_EQ(copy.size(), 100u);
  EXPECT_EQ(copy.Find(LandmarkId::Make(1, 7))->map_id, 7u);
  EXPECT_NE(copy.Find(LandmarkId::Make(1, 8)), nullptr);
  const Landmark* stays = copy.Find(LandmarkId::Make(1, 9));
  const LandmarkTable moved(std::move(copy));
  EXPECT_EQ(moved.Find(LandmarkId::Make(1, 9)), stays);
}

}  // namespace
}  // namespace dmslam
