#include "dmslam/synthetic/sequence_writer.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

SequenceOptions Quick() {
  SequenceOptions options;
  options.camera = {
      .width_px = 160, .height_px = 120, .fx_px = 131, .fy_px = 131, .cx_px = 79.5, .cy_px = 59.5};
  options.frames = 6;
  options.world.actors = 1;
  options.world.scene.texture_halvings = 4;
  options.render.samples = 2;
  return options;
}

fs::path Folder(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / ("sequence_writer_" + name);
  fs::remove_all(folder);
  return folder;
}

std::map<std::string, std::string> Contents(const fs::path& folder) {
  std::map<std::string, std::string> contents;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::stringstream text;
    text << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    contents[fs::relative(entry.path(), folder).string()] = text.str();
  }
  return contents;
}

TEST(SequenceWriter, WritesWhatTheReaderReads) {
  const fs::path folder = Folder("read");
  int last = 0;
  const SequenceReport report = WriteSequence(Quick(), folder.string(), [&](int done) {
    last = done;
    return true;
  });
  EXPECT_EQ(last, 6);
  EXPECT_EQ(report.frames, 6);
  TumSequence sequence(folder.string());
  ASSERT_EQ(sequence.size(), 6u);
  EXPECT_EQ(sequence.missing(), 0u);
  ASSERT_EQ(sequence.masks().size(), 6u);
  EXPECT_EQ(sequence.StampNs(1) - sequence.StampNs(0), 33'333'000);
  const GrayImage image = DecodeGray(sequence.Read(5), "frame"), mask = LoadGray(sequence.masks()[5].path);
  EXPECT_EQ(image.width, 160);
  EXPECT_EQ(mask.data.size(), image.data.size());
  const auto truth = ReadTrajectory(*sequence.GroundTruthPath());
  ASSERT_EQ(truth.size(), 6u);
  EXPECT_EQ(truth[3].stamp_ns, sequence.StampNs(3));
  const auto camera = FindCamera(folder.string(), "");
  ASSERT_TRUE(camera);
  EXPECT_DOUBLE_EQ(camera->fx_px, 131);
  const auto loops = nlohmann::json::parse(std::ifstream(folder / "loops.json"));
  EXPECT_TRUE(loops.at("revisits").empty());
  std::ifstream coverage(folder / "coverage.txt");
  double first = -1;
  coverage >> first;
  EXPECT_GE(first, 0);
  EXPECT_LE(first, 1);
}

TEST(SequenceWriter, SameSeedSameFiles) {
  const fs::path a = Folder("a"), b = Folder("b"), c = Folder("c");
  WriteSequence(Quick(), a.string(), {});
  WriteSequence(Quick(), b.string(), {});
  EXPECT_EQ(Contents(a), Contents(b));
  SequenceOptions other = Quick();
  other.world.path.seed = 2;
  WriteSequence(other, c.string(), {});
  EXPECT_NE(Contents(a).at("groundtruth.txt"), Contents(c).at("groundtruth.txt"));
}

TEST(SequenceWriter, LensAndFormatAreHonoured) {
  const fs::path folder = Folder("lens");
  SequenceOptions options = Quick();
  options.camera.k1 = 0.26;
  options.camera.k2 = -0.9;
  options.png = options.gray = true;
  options.world.actors = 0;
  WriteSequence(options, folder.string(), {});
  TumSequence sequence(folder.string());
  EXPECT_TRUE(sequence.masks().empty());
  EXPECT_EQ(sequence.Read(0).encoding, ImageEncoding::kPng);
  EXPECT_DOUBLE_EQ(FindCamera(folder.string(), "")->k2, -0.9);
}

TEST(SequenceWriter, EndsWhenAskedTo) {
  const fs::path folder = Folder("stop");
  const SequenceReport report = WriteSequence(Quick(), folder.string(), [](int done) { return done < 2; });
  EXPECT_EQ(report.frames, 2);
  EXPECT_EQ(TumSequence(folder.string()).size(), 2u);
}

TEST(SequenceWriter, BadInputIsNamed) {
  SequenceOptions options = Quick();
  EXPECT_THROW(WriteSequence(options, "/proc/nowhere", {}), InputError);
  options.frames = 0;
  EXPECT_THROW(WriteSequence(options, Folder("bad").string(), {}), InputError);
  options = Quick();
  options.jpeg_quality = 101;
  EXPECT_THROW(WriteSequence(options, Folder("bad").string(), {}), InputError);
  options = Quick();
  options.camera.fx_px = 0;
  EXPECT_THROW(WriteSequence(options, Folder("bad").string(), {}), InputError);
}

TEST(SequenceWriter, RoundsTakeTheirFrames) {
  SequenceOptions options;
  options.world.scene.kind = SceneKind::kCorridor;
  options.world.path.kind = PathKind::kRing;
  const int frames = DefaultRoundFrames(options);
  EXPECT_GE(frames, 1500);
  EXPECT_LT(frames, 3000);
}

}  // namespace
}  // namespace dmslam
