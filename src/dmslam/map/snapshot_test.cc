#include "dmslam/map/snapshot.h"

#include <gtest/gtest.h>

#include "dmslam/map/replica.h"
#include "dmslam/map/testing/random_editor.h"

namespace dmslam {
namespace {

TEST(Snapshot, RebuildsTheMap) {
  size_t unobserved = 0;  // landmarks whose only feature was given to another one
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    RandomEditor editor(seed);
    editor.Steps(1500);
    Replica replica(TestCamera(), Pyramid());
    const std::vector<MapDelta> parts =
        CutSnapshot(editor.map(), editor.map().keyframes().begin()->first, 8000);
    EXPECT_GT(parts.size(), 3u);
    for (const MapDelta& part : parts) replica.Apply(part);
    ExpectSameMaps(editor.map(), replica);
    for (const LandmarkId id : replica.LandmarkIdsSorted())
      unobserved += replica.At(id).observations.empty() ? 1 : 0;
  }
  EXPECT_GT(unobserved, 0u);
}

TEST(Snapshot, BeginsWithTheLocalMap) {
  RandomEditor editor(2);
  editor.Steps(1500);
  const Map& map = editor.map();
  const KeyframeId center = std::next(map.keyframes().begin(), 2)->first;
  std::vector<KeyframeId> order;
  for (const MapDelta& part : CutSnapshot(map, center, 4000)) {
    for (const KeyframeState& keyframe : part.keyframes) order.push_back(keyframe.id);
  }
  ASSERT_EQ(order.size(), map.keyframes().size());
  std::vector<KeyframeId> expected = map.BestCovisible(center, 1000, 1);
  expected.insert(expected.begin(), center);
  order.resize(expected.size());
  EXPECT_EQ(order, expected);
}

TEST(Snapshot, EveryPartNamesVersionAndProgress) {
  RandomEditor editor(2);
  editor.Steps(500);
  MapProgress progress;
  progress.frontend = {3, 77};
  editor.map().SetProgress(progress);
  editor.map().TakeDelta(MapEvent::kSettled, {}, 1);
  const std::vector<MapDelta> parts = CutSnapshot(editor.map(), {}, 4000);
  ASSERT_GT(parts.size(), 1u);
  for (const MapDelta& part : parts) {
    EXPECT_EQ(part.event, MapEvent::kSnapshot);
    EXPECT_EQ(part.version, 1u);
    EXPECT_EQ(part.progress, progress);
  }
}

TEST(Snapshot, TellsHowFarEveryCameraIs) {
  RandomEditor editor(2);
  editor.Steps(100);
  for (const CameraId camera : {0u, 1u, 4u}) {
    MapProgress progress = editor.map().progress(camera);
    progress.frontend = {3 + camera, 77 * (camera + 1)};
    progress.settled = KeyframeId::Make(1, 10 + camera, camera);
    progress.loopcloser = {9, 5};
    editor.map().SetProgress(progress);
  }
  Replica replica(TestCamera(), Pyramid());
  for (const MapDelta& part : CutSnapshot(editor.map(), {}, 1000000)) replica.Apply(part);
  EXPECT_EQ(replica.cameras(), (std::vector<CameraId>{0, 1, 4}));
  for (const CameraId camera : {0u, 1u, 4u})
    EXPECT_EQ(replica.progress(camera), editor.map().progress(camera)) << camera;
  EXPECT_EQ(replica.progress(2).frontend, StreamPosition()) << "nothing is known of it";
  editor.map().ForgetProgress();
  EXPECT_EQ(editor.map().progress(1).frontend, StreamPosition()) << "the streams are others";
}

TEST(Snapshot, OfAnEmptyMapIsOneEmptyPart) {
  const std::vector<MapDelta> parts = CutSnapshot(Map(TestCamera(), Pyramid()), {}, 1000);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_TRUE(parts.front().Empty());
}

}  // namespace
}  // namespace dmslam
