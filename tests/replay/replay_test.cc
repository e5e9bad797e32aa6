// What the frontend computes from images is recorded, and drives the cores again: trajectories and map are
// the same, byte for byte, whether images or recorded features came in, and whether one object or three cores
// with replicas of their own worked on them.
//
// With DMSLAM_REPLAY_REFERENCE=FOLDER recordings and results are kept in that folder, and a run that finds
// them there works on the recorded features alone and must give the same results: what a change of code may
// be checked with in seconds. Only with the CPU model and the libraries that made them, as others round
// otherwise.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/image.h"
#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/features/testing/kitchen_pairs.h"
#include "dmslam/settings/slam_setup.h"
#include "dmslam/synthetic/sequence_writer.h"
#include "runs.h"

namespace dmslam::replay {
namespace {

namespace fs = std::filesystem;

constexpr size_t kRenderedFrames = 100;
constexpr size_t kKitchenFrames = 100;

fs::path Project() {
  const char* source_dir = std::getenv("DMSLAM_SOURCE_DIR");
  return source_dir != nullptr ? fs::path(source_dir) : fs::current_path();
}

struct Excerpt {
  std::string name;
  std::string folder;
  Camera camera;
  size_t first = 0, count = 0;
};

SequenceOptions RenderedSequence() {
  SequenceOptions options;
  options.camera.width_px = 480;
  options.camera.height_px = 360;
  options.camera.fx_px = options.camera.fy_px = 394;
  options.camera.cx_px = 239.5;
  options.camera.cy_px = 179.5;
  options.frames = static_cast<int>(kRenderedFrames);
  options.world.path.kind = PathKind::kXyz;
  options.world.actors = 2;
  options.gray = options.png = true;
  options.masks = false;
  options.render.samples = 1;
  return options;
}

Excerpt Rendered() {
  return {"rendered", ::testing::TempDir() + "/replay_test", RenderedSequence().camera, 0, kRenderedFrames};
}

Excerpt Render() {
  Excerpt excerpt = Rendered();
  fs::remove_all(excerpt.folder);
  WriteSequence(RenderedSequence(), excerpt.folder, {});
  return excerpt;
}

Slam::Setup SetupFor(const Excerpt& excerpt) {
  const auto vocabulary =
      std::make_shared<const Vocabulary>(LoadOrbVocabulary((Project() / "data/vocabulary.dmv").string()));
  return SlamSetup(Settings(), excerpt.camera, vocabulary);
}

void ExpectSame(const Outcome& a, const Outcome& b, const std::string& what) {
  // Not EXPECT_EQ: it would print all of it.
  EXPECT_TRUE(a.final == b.final) << what << ": other final poses";
  EXPECT_TRUE(a.online == b.online) << what << ": other poses while it went on";
  EXPECT_TRUE(a.map == b.map) << what << ": another map, of " << a.keyframes << " and " << b.keyframes
                              << " keyframes, " << a.landmarks << " and " << b.landmarks << " landmarks";
}

std::string ReadText(const fs::path& path) {
  const std::vector<uint8_t> bytes = ReadFileBytes(path.string());
  return {bytes.begin(), bytes.end()};
}

void WriteText(const fs::path& path, const std::string& text) {
  WriteFileBytes(path.string(), std::vector<uint8_t>(text.begin(), text.end()));
}

/// Where recordings and results of earlier runs are; none: there are none to be compared with.
std::optional<fs::path> ReferenceFor(const Excerpt& excerpt) {
  const char* folder = std::getenv("DMSLAM_REPLAY_REFERENCE");
  if (folder == nullptr) return std::nullopt;
  return fs::path(folder) / excerpt.name;
}

/// Replays what an earlier run recorded; false: there was none.
bool CompareWithReference(const Excerpt& excerpt) {
  const std::optional<fs::path> reference = ReferenceFor(excerpt);
  if (!reference || !fs::exists(*reference / "map.bin")) return false;
  const std::optional<Recording> recording = FromBytes(ReadFileBytes((*reference / "features.bin").string()));
  EXPECT_TRUE(recording) << *reference / "features.bin"
                         << " is no recording of this version";
  if (!recording) return true;
  const Outcome kept = {ReadText(*reference / "final.txt"), ReadText(*reference / "online.txt"),
                        ReadText(*reference / "map.bin")};
  ExpectSame(kept, RunOnFeatures(SetupFor(excerpt), *recording), "the reference");
  return true;
}

void KeepReference(const Excerpt& excerpt, const Recording& recording, const Outcome& outcome) {
  const std::optional<fs::path> reference = ReferenceFor(excerpt);
  if (!reference) return;
  fs::create_directories(*reference);
  WriteFileBytes((*reference / "features.bin").string(), ToBytes(recording));
  WriteText(*reference / "final.txt", outcome.final);
  WriteText(*reference / "online.txt", outcome.online);
  WriteText(*reference / "map.bin", outcome.map);
}

/// One frame's keypoints lie a sixteenth of a pixel further right.
Recording SlightlyOther(Recording recording) {
  FrameInput& frame = recording[recording.size() / 2];
  for (Keypoint& keypoint : frame.features.keypoints)
    keypoint.x_q4 = static_cast<uint16_t>(keypoint.x_q4 + 1);
  return recording;
}

void ExpectTheSameByAllWays(const Excerpt& excerpt) {
  const Slam::Setup setup = SetupFor(excerpt);
  TumSequence frames(excerpt.folder);
  ASSERT_GE(frames.size(), excerpt.first + excerpt.count);
  Recording recorded;
  const Outcome on_images = RunOnImages(setup, frames, excerpt.first, excerpt.count, &recorded);
  EXPECT_GE(on_images.keyframes, 4u) << "too little happens in this excerpt";
  EXPECT_GT(on_images.landmarks, 300u);
  EXPECT_FALSE(on_images.online.empty());

  const std::optional<Recording> recording = FromBytes(ToBytes(recorded));
  ASSERT_TRUE(recording);
  ExpectSame(on_images, RunOnFeatures(setup, *recording), "recorded features");
  ExpectSame(on_images, RunCores(setup, *recording), "cores with replicas of their own");
  KeepReference(excerpt, *recording, on_images);
}

TEST(Replay, OfARenderedRoomWithPeople) {
  if (!CompareWithReference(Rendered())) ExpectTheSameByAllWays(Render());
}

TEST(Replay, WhatIsComparedDependsOnWhatComesIn) {
  const Excerpt excerpt = Render();
  const Slam::Setup setup = SetupFor(excerpt);
  TumSequence frames(excerpt.folder);
  Recording recording;
  const Outcome outcome = RunOnImages(setup, frames, excerpt.first, excerpt.count / 2, &recording);
  const Outcome other = RunOnFeatures(setup, SlightlyOther(recording));
  EXPECT_FALSE(outcome.final == other.final);
  EXPECT_FALSE(outcome.map == other.map);
}

void ReplayKitchen(const std::string& name) {
  const std::optional<std::string> folder = dmslam::testing::SequenceFolder(name);
  if (!folder) GTEST_SKIP() << "no sequence " << name << "; set DMSLAM_DATA to the folder that holds it";
  const Camera camera = LoadCamera((Project() / "config/kitchen.yaml").string());
  const Excerpt excerpt = {name, *folder, camera, 0, kKitchenFrames};
  if (!CompareWithReference(excerpt)) ExpectTheSameByAllWays(excerpt);
}

TEST(Replay, OfAnExcerptOfKitchen) { ReplayKitchen("kitchen"); }

TEST(Replay, OfAnExcerptOfKitchenWalk1) { ReplayKitchen("kitchen_walk1"); }

}  // namespace
}  // namespace dmslam::replay
