#include "dmslam/map/neighbourhood.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "dmslam/map/testing/random_editor.h"

namespace dmslam {
namespace {

std::vector<LandmarkId> SeenByAny(const Map& map, const std::vector<KeyframeId>& keyframes) {
  std::set<LandmarkId> seen;
  for (const KeyframeId id : keyframes) {
    for (const LandmarkId landmark : map.At(id).landmarks) {
      if (landmark.valid()) seen.insert(landmark);
    }
  }
  return {seen.begin(), seen.end()};
}

TEST(Neighbourhood, LandmarksThatSeveralKeyframesSeeAreListedOnce) {
  RandomEditor editor(3);
  editor.Steps(2000);
  const Map& map = editor.map();
  std::vector<KeyframeId> ids;
  std::vector<const Keyframe*> keyframes;
  for (const auto& [id, keyframe] : map.keyframes()) {
    ids.push_back(id);
    keyframes.push_back(&keyframe);
  }
  const std::vector<LandmarkId> expected = SeenByAny(map, ids);
  ASSERT_GT(expected.size(), 20u);
  EXPECT_EQ(LandmarksSeenBy(map, ids), expected);
  std::vector<LandmarkId> found;
  for (const Landmark* landmark : LandmarksSeenBy(map, keyframes)) found.push_back(landmark->id);
  EXPECT_EQ(found, expected);
}

TEST(Neighbourhood, AroundAKeyframeAreItsOwnLandmarksAndThoseOfItsBestNeighbours) {
  RandomEditor editor(5);
  editor.Steps(2000);
  const Map& map = editor.map();
  size_t with_neighbours = 0;
  for (const auto& [id, keyframe] : map.keyframes()) {
    std::vector<KeyframeId> near = map.BestCovisible(id, 2, 1);
    with_neighbours += near.empty() ? 0 : 1;
    near.push_back(id);
    EXPECT_EQ(LandmarksAround(map, id, 2, 1), SeenByAny(map, near));
    EXPECT_EQ(LandmarksAround(map, id, 2, 1 << 20), SeenByAny(map, {id})) << "nobody shares so many";
  }
  EXPECT_GT(with_neighbours, 0u);
}

}  // namespace
}  // namespace dmslam
