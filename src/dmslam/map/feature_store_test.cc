#include "dmslam/map/feature_store.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "dmslam/map/replica.h"
#include "dmslam/map/snapshot.h"
#include "dmslam/map/testing/random_editor.h"

namespace dmslam {
namespace {

constexpr size_t kFeatures = 500;

/// Of one keyframe's features and a half.
FeatureStoreOptions RoomForOne() {
  Random random(1);
  return {1.5e-6 * static_cast<double>(BytesOf(*RandomFeatures(random, kFeatures)))};
}

void ExpectSameFeatures(const FrameFeatures& a, const FrameFeatures& b) {
  EXPECT_EQ(a.set.keypoints, b.set.keypoints);
  EXPECT_EQ(a.set.descriptors, b.set.descriptors);
  EXPECT_EQ(a.set.depths_m, b.set.depths_m);
  EXPECT_EQ(a.set.depth_sigmas_m, b.set.depth_sigmas_m);
  EXPECT_EQ(a.set.sigmas_px, b.set.sigmas_px);
  EXPECT_EQ(a.uv_px, b.uv_px);
  EXPECT_EQ(a.sigmas_px, b.sigmas_px);
  std::vector<uint32_t> in_a, in_b;
  a.grid.FindInRadius({320, 240}, 100, 0, 8, &in_a);
  b.grid.FindInRadius({320, 240}, 100, 0, 8, &in_b);
  EXPECT_EQ(in_a, in_b);
}

/// A map made of a random one's deltas, whose features lie where `store` puts them.
Replica ReplicaOf(RandomEditor* editor, const std::shared_ptr<FeatureStore>& store, int rounds) {
  Replica replica(TestCamera(), Pyramid());
  replica.KeepFeaturesIn(store);
  for (int round = 0; round < rounds; ++round) {
    editor->Steps(25);
    replica.Apply(editor->map().TakeDelta(MapEvent::kSettled, {}, 1));
  }
  return replica;
}

void ExpectSameFeatures(const Map& a, const Map& b) {
  ASSERT_EQ(a.keyframes().size(), b.keyframes().size());
  for (const auto& [id, keyframe] : a.keyframes()) ExpectSameFeatures(*keyframe.features, *b.At(id).features);
}

TEST(FeatureStore, WhatIsNotTooMuchStaysWhereItIs) {
  FeatureStore store({}, "/no/such/folder");
  Random random(2);
  const std::shared_ptr<const FrameFeatures> features = RandomFeatures(random, kFeatures);
  EXPECT_EQ(store.Keep(features), features);
  EXPECT_EQ(store.bytes_in_file(), 0u);
  EXPECT_EQ(store.TakeProblem(), "");
}

TEST(FeatureStore, FurtherOnesLieInTheFileBitForBit) {
  FeatureStore store(RoomForOne(), testing::TempDir());
  Random random(3);
  std::vector<std::shared_ptr<const FrameFeatures>> made, kept;
  for (int i = 0; i < 100; ++i) {
    FeatureSet set = RandomFeatures(random, kFeatures)->set;
    for (size_t k = 0; k < set.size() && i % 2 == 0; ++k) {
      set.depths_m.push_back(static_cast<float>(random.Uniform(1, 9)));
      set.depth_sigmas_m.push_back(static_cast<float>(random.Uniform(0.1, 0.2)));
      set.sigmas_px.push_back(static_cast<float>(random.Uniform(0.5, 2)));
    }
    made.push_back(MakeFrameFeatures(std::move(set), TestCamera(), Pyramid()));
    kept.push_back(store.Keep(made.back()));
  }
  EXPECT_EQ(kept.front(), made.front());
  EXPECT_NE(kept.back(), made.back());
  EXPECT_LE(store.bytes_in_memory(), static_cast<size_t>(RoomForOne().memory_mb * 1e6));
  EXPECT_GT(store.bytes_in_file(), 98 * kFeatures * sizeof(Descriptor));
  store.LetGo();
  for (size_t i = 0; i < made.size(); ++i) ExpectSameFeatures(*made[i], *kept[i]);
}

TEST(FeatureStore, WhatIsDroppedMakesRoomInMemory) {
  FeatureStore store(RoomForOne(), testing::TempDir());
  Random random(4);
  std::shared_ptr<const FrameFeatures> first = store.Keep(RandomFeatures(random, kFeatures));
  EXPECT_GT(store.bytes_in_memory(), 0u);
  std::shared_ptr<const FrameFeatures> second = store.Keep(RandomFeatures(random, kFeatures));
  EXPECT_GT(store.bytes_in_file(), 0u);
  first.reset();
  second.reset();
  EXPECT_EQ(store.bytes_in_memory(), 0u);
  EXPECT_EQ(store.bytes_in_file(), 0u);
  const std::shared_ptr<const FrameFeatures> third = RandomFeatures(random, kFeatures);
  EXPECT_EQ(store.Keep(third), third);
}

TEST(FeatureStore, ACopyOutlivesItAndLeavesTheFile) {
  auto store = std::make_unique<FeatureStore>(FeatureStoreOptions{0.0}, testing::TempDir());
  Random random(5);
  const std::shared_ptr<const FrameFeatures> made = RandomFeatures(random, kFeatures);
  std::shared_ptr<const FrameFeatures> kept = store->Keep(made);
  ASSERT_NE(kept, made);
  store.reset();
  ExpectSameFeatures(*made, *kept);
  const FrameFeatures copy = *kept;
  kept.reset();
  ExpectSameFeatures(*made, copy);
}

TEST(FeatureStore, ADiskWithoutRoomIsToldOnceAndNothingIsLost) {
  FeatureStore store(RoomForOne(), testing::TempDir());
  Random random(6);
  std::vector<std::shared_ptr<const FrameFeatures>> made, kept;
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit former{};
  getrlimit(RLIMIT_FSIZE, &former);
  const auto keep_another = [&] {
    made.push_back(RandomFeatures(random, kFeatures));
    kept.push_back(store.Keep(made.back()));
  };
  const rlimit small{1024, former.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  for (int i = 0; i < 10; ++i) keep_another();
  const std::string problem = store.TakeProblem();
  setrlimit(RLIMIT_FSIZE, &former);
  EXPECT_NE(problem.find(testing::TempDir()), std::string::npos) << problem;
  EXPECT_EQ(store.TakeProblem(), "") << "told once";
  EXPECT_EQ(store.bytes_in_file(), 0u);
  keep_another();
  EXPECT_GT(store.bytes_in_file(), 0u) << "there is room again";
  for (size_t i = 0; i < made.size(); ++i) ExpectSameFeatures(*made[i], *kept[i]);
}

TEST(FeatureStore, AMapInItIsTheSameMap) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    RandomEditor editor(seed);
    const auto store = std::make_shared<FeatureStore>(FeatureStoreOptions{0.0}, testing::TempDir());
    const Replica replica = ReplicaOf(&editor, store, 20);
    EXPECT_GT(store->bytes_in_file(), 0u);
    store->LetGo();
    ExpectSameMaps(editor.map(), replica);
    ExpectSameFeatures(editor.map(), replica);
    Replica late(TestCamera(), Pyramid());
    for (const MapDelta& part : CutSnapshot(replica, replica.keyframes().rbegin()->first, 10000))
      late.Apply(part);
    ExpectSameFeatures(editor.map(), late);
  }
}

TEST(FeatureStore, CopiesOfAMapShareItAndItIsEmptyWithTheLast) {
  RandomEditor editor(7);
  const auto store = std::make_shared<FeatureStore>(FeatureStoreOptions{0.0}, testing::TempDir());
  Replica replica = ReplicaOf(&editor, store, 10);
  const size_t bytes = store->bytes_in_file();
  {
    const Replica copy = replica;
    EXPECT_EQ(store->bytes_in_file(), bytes);
    replica.Clear();
    EXPECT_EQ(store->bytes_in_file(), bytes) << "the copy has it still";
    std::thread([&] { ExpectSameFeatures(editor.map(), copy); }).join();
  }
  EXPECT_EQ(store->bytes_in_file(), 0u);
  EXPECT_EQ(replica.feature_store(), store) << "what comes after it lies there, too";
}

TEST(FeatureStore, TakesOverWhatAMapHasAlready) {
  RandomEditor editor(8);
  Replica replica = ReplicaOf(&editor, nullptr, 10);
  const auto store = std::make_shared<FeatureStore>(FeatureStoreOptions{0.0}, testing::TempDir());
  replica.KeepFeaturesIn(store);
  EXPECT_GT(store->bytes_in_file(), 0u);
  EXPECT_EQ(store->bytes_in_memory(), 0u);
  ExpectSameFeatures(editor.map(), replica);
}

}  // namespace
}  // namespace dmslam
