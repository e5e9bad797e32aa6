#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "in_process.h"
#include "small_workload.h"
#include "viewer/log_playback.h"

namespace dmslam::simulation {
namespace {

namespace fs = std::filesystem;

/// A short run in one process that keeps a log of all that is said. All cameras see the same.
std::string RecordSmallRun(const fs::path& folder, size_t cameras) {
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
  std::vector<AnotherCamera> others;
  for (size_t i = 1; i < cameras; ++i) {
    others.push_back({options.player, std::make_unique<StoredFrames>(&workload.frames)});
    options.collector.ground_truth.emplace_back("-");
  }
  EXPECT_EQ(
      RunInProcess(options, std::make_unique<StoredFrames>(&workload.frames), &problem, std::move(others)), 0)
      << problem;
  return options.record;
}

/// What a browser gets of all that is drawn, see ViewerScene::Encode.
class Drawn {
 public:
  explicit Drawn(const Exchange& exchange) : bytes_(exchange.EncodeScene(0, 0)) {}
  template <typename Word = uint32_t>
  Word At(size_t index) const {
    Word word{};
    std::memcpy(&word, &bytes_.at(4 * index), sizeof(word));
    return word;
  }
  uint32_t landmarks() const { return At(5); }
  uint32_t keyframes() const { return At(6); }
  uint32_t frames() const { return At(8); }
  size_t CamerasAt() const {
    return 10 + 9 * landmarks() + 12 * keyframes() + 2 * At(7) + 7 * frames() + 5 * At(9);
  }

 private:
  std::vector<uint8_t> bytes_;
};

/// The newest of a kind that browsers are told of.
nlohmann::json Newest(Exchange* exchange, const std::string& kind) {
  const std::string said = exchange->hub().Join()->Next(std::chrono::milliseconds(0));
  const std::string head = "event: " + kind + "\ndata: ";
  const size_t at = said.find(head);
  if (at == std::string::npos) return {};
  return nlohmann::json::parse(
      said.substr(at + head.size(), said.find('\n', at + head.size()) - at - head.size()));
}

TEST(RecordedRunTest, TheViewerShowsTheMapOfARunInOneProcess) {
  const fs::path folder = fs::path(testing::TempDir()) / "recorded_run_test";
  const std::string log = RecordSmallRun(folder, 1);
  Exchange exchange;
  LogPlayback playback(log, {}, {}, &exchange);
  playback.Fulfil({playback.duration_s(), false, std::nullopt}, 1);
  const Drawn drawn(exchange);
  EXPECT_GE(drawn.landmarks(), 100u);
  EXPECT_GE(drawn.keyframes(), 3u);
  EXPECT_GE(drawn.frames(), 20u);
  ASSERT_EQ(drawn.At(drawn.CamerasAt() + 1), 1u) << "one camera";
  // Back in haste, where map and camera are shown but once: it is told of among what is drawn, where that has
  // it.
  playback.Fulfil({0.6 * playback.duration_s(), std::nullopt, std::nullopt}, 2);
  const Drawn before(exchange);
  const size_t at = before.CamerasAt();
  ASSERT_EQ(before.At(at + 1), 1u);
  const nlohmann::json pose = Newest(&exchange, "pose");
  ASSERT_TRUE(pose.contains("p")) << pose.dump();
  EXPECT_EQ(pose["arrangement"], before.At(at));
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(pose["p"][i].get<float>(), before.At<float>(at + 3 + i), 1e-6);
  fs::remove_all(folder);
}

TEST(RecordedRunTest, TheViewerLosesNothingOfARunOfTwoCameras) {
  const fs::path folder = fs::path(testing::TempDir()) / "recorded_run_of_two_test";
  const std::string log = RecordSmallRun(folder, 2);
  Exchange exchange;
  LogPlayback playback(log, {}, {}, &exchange);
  playback.Fulfil({playback.duration_s(), false, std::nullopt}, 1);
  const Drawn drawn(exchange);
  EXPECT_GE(drawn.frames(), 100u) << "of twice sixty";
  EXPECT_EQ(drawn.At(drawn.CamerasAt() + 1), 2u);
  const nlohmann::json viewer = Newest(&exchange, "status")["processes"].back();
  EXPECT_EQ(viewer["name"], "viewer");
  EXPECT_EQ(viewer["lost"], 0) << "records that it does not listen to come no more";
  EXPECT_EQ(viewer["queue"], 0);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace dmslam::simulation
