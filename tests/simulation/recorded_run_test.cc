#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>

#include "in_process.h"
#include "small_workload.h"
#include "viewer/log_playback.h"

namespace dmslam::simulation {
namespace {

namespace fs = std::filesystem;

/// A short run in one process that keeps a log of all that is said.
std::string RecordSmallRun(const fs::path& folder) {
  const Workload workload = MakeSmallWorkload((folder / "sequence").string());
  InProcessOptions options;
  options.node.settings = SmallSettings(1);
  options.player.session = 1;
  options.player.camera = workload.camera;
  options.player.sequence = "recorded";
  options.collector.out_dir = (folder / "out").string();
  options.collector.ground_truth = {"-"};
  options.collector.for_people = false;
  options.vocabulary = workload.vocabulary;
  options.record = (folder / "run.lcmlog").string();
  fs::create_directories(options.collector.out_dir);
  std::string problem;
  EXPECT_EQ(RunInProcess(options, std::make_unique<StoredFrames>(&workload.frames), &problem), 0) << problem;
  return options.record;
}

/// A number of the bytes that a browser gets, see ViewerScene::Encode.
uint32_t WordAt(const Exchange& exchange, size_t index) {
  const std::vector<uint8_t> bytes = exchange.EncodeScene(0, 0);
  uint32_t word = 0;
  std::memcpy(&word, &bytes.at(4 * index), sizeof(word));
  return word;
}

TEST(RecordedRunTest, TheViewerShowsTheMapOfARunInOneProcess) {
  const fs::path folder = fs::path(testing::TempDir()) / "recorded_run_test";
  const std::string log = RecordSmallRun(folder);
  Exchange exchange;
  LogPlayback playback(log, {}, {}, &exchange);
  playback.Fulfil({playback.duration_s(), false, std::nullopt}, 1);
  EXPECT_GE(WordAt(exchange, 5), 100u) << "landmarks";
  EXPECT_GE(WordAt(exchange, 6), 3u) << "keyframes";
  EXPECT_GE(WordAt(exchange, 8), 20u) << "frames on the path";
  fs::remove_all(folder);
}

}  // namespace
}  // namespace dmslam::simulation
