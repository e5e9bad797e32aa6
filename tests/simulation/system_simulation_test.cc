// The whole system on a simulated network: the nodes of all processes as they are, in one thread and virtual
// time, and schedules of what goes wrong, each drawn from a seed.
//
// DMSLAM_FIRST_SCHEDULE and DMSLAM_SCHEDULES choose which seeds; DMSLAM_TELL=1 tells what happened in each.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "dmslam/console/log.h"
#include "dmslam/dataset/image.h"
#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/runtime/load_vocabulary.h"
#include "dmslam/synthetic/sequence_writer.h"
#include "in_process.h"
#include "simulated_system.h"

namespace dmslam::simulation {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kFrames = 60;

int64_t FromEnvironment(const char* name, int64_t otherwise) {
  const char* value = std::getenv(name);
  return value == nullptr ? otherwise : std::atoll(value);
}

/// In memory where there is such a place: journals are synced once a virtual second.
fs::path ScratchFolder() {
  const std::string name = "dmslam_simulation_" + std::to_string(getpid());
  return (fs::is_directory("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path()) / name;
}

SequenceOptions SmallSequence() {
  SequenceOptions options;
  options.camera.width_px = 320;
  options.camera.height_px = 240;
  options.camera.fx_px = options.camera.fy_px = 262.5;
  options.camera.cx_px = 159.5;
  options.camera.cy_px = 119.5;
  options.camera.fps = 15;
  options.frames = static_cast<int>(kFrames);
  options.world.duration_s = kFrames / 15.0;
  options.world.path.kind = PathKind::kXyz;
  options.world.actors = 1;
  options.gray = true;
  options.masks = false;
  options.jpeg_quality = 80;
  options.render.samples = 1;
  return options;
}

std::shared_ptr<const Vocabulary> ShippedVocabulary() {
  const char* source_dir = std::getenv("DMSLAM_SOURCE_DIR");
  const fs::path project = source_dir != nullptr ? fs::path(source_dir) : fs::current_path();
  return std::make_shared<const Vocabulary>(LoadOrbVocabulary((project / "data/vocabulary.dmv").string()));
}

Settings SmallSettings(uint64_t seed) {
  return LoadSettings("", {"features.count=500", "seed=" + std::to_string(seed)});
}

class SystemSimulation : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    tells_ = FromEnvironment("DMSLAM_TELL", 0) > 0;
    SetUpLog("system_simulation", !tells_);
    folder_ = ScratchFolder();
    WriteSequence(SmallSequence(), (folder_ / "sequence").string(), {});
    workload_ = std::make_unique<Workload>();
    workload_->camera = SmallSequence().camera;
    workload_->vocabulary = ShippedVocabulary();
    workload_->settings = SmallSettings(1);
    TumSequence frames((folder_ / "sequence").string());
    for (size_t i = 0; i < frames.size(); ++i) {
      StoredFrame& stored = workload_->frames.emplace_back(StoredFrame{frames.StampNs(i), frames.Read(i)});
      stored.image.encoding = DetectEncoding(stored.image.bytes);
    }
    reference_ = std::make_unique<Outcome>(RunUndisturbed(1));
  }
  static void TearDownTestSuite() {
    workload_.reset();
    reference_.reset();
    fs::remove_all(folder_);
  }

  /// All nodes on a bus that loses nothing.
  static Outcome RunUndisturbed(uint64_t seed) {
    const std::string out = (folder_ / "undisturbed").string();
    fs::create_directories(out);
    InProcessOptions options;
    options.node.settings = SmallSettings(seed);
    options.player.session = 1;
    options.player.camera = workload_->camera;
    options.player.sequence = "simulated";
    options.collector.out_dir = out;
    options.collector.ground_truth = {"-"};
    options.collector.table = false;
    options.vocabulary = workload_->vocabulary;
    Outcome outcome;
    RunInProcess(options, std::make_unique<TumSequence>((folder_ / "sequence").string()), &outcome.failure);
    ReadResults(out, &outcome);
    return outcome;
  }

  static Outcome Run(const Schedule& schedule) {
    return RunSchedule(*workload_, schedule, (folder_ / "run").string());
  }

  /// What differs from the undisturbed run; empty: nothing.
  static std::string Difference(const Outcome& outcome) {
    if (!outcome.failure.empty()) return outcome.failure;
    std::string difference;
    if (outcome.trajectory != reference_->trajectory) difference += " another trajectory,";
    if (outcome.online != reference_->online) difference += " another one online,";
    if (outcome.keyframes != reference_->keyframes) difference += " other keyframes,";
    if (outcome.map != reference_->map) difference += " another map,";
    return difference;
  }

  static fs::path folder_;
  static std::unique_ptr<Workload> workload_;
  static std::unique_ptr<Outcome> reference_;
  static bool tells_;
};

fs::path SystemSimulation::folder_;
std::unique_ptr<Workload> SystemSimulation::workload_;
std::unique_ptr<Outcome> SystemSimulation::reference_;
bool SystemSimulation::tells_ = false;

TEST_F(SystemSimulation, WhereNothingGoesWrongItIsTheRunInOneProcess) {
  ASSERT_EQ(reference_->failure, "");
  EXPECT_GT(std::ranges::count(reference_->keyframes, '\n'), 6);
  EXPECT_GT(std::ranges::count(reference_->online, '\n'), 30);
  EXPECT_EQ(Difference(Run(CalmSchedule())), "");
}

TEST_F(SystemSimulation, EverySchedulesPromisesAreKept) {
  const int64_t first = FromEnvironment("DMSLAM_FIRST_SCHEDULE", 1);
  const int64_t count = FromEnvironment("DMSLAM_SCHEDULES", 100);
  int64_t diverged = 0;
  for (int64_t seed = first; seed < first + count; ++seed) {
    const Schedule schedule = DrawSchedule(static_cast<uint64_t>(seed), kFrames);
    const auto began = std::chrono::steady_clock::now();
    const Outcome outcome = Run(schedule);
    const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    const std::string difference = Difference(outcome);
    if (tells_)
      std::printf("schedule %ld: %s\n%s%.3f s for %.1f s, %ld turns, %ld sent, %ld delivered, %ld lost\n",
                  static_cast<long>(seed), schedule.ToText().c_str(), outcome.story.c_str(), took_s,
                  outcome.virtual_s, static_cast<long>(outcome.turns),
                  static_cast<long>(outcome.network.sent), static_cast<long>(outcome.network.delivered),
                  static_cast<long>(outcome.network.lost));
    EXPECT_EQ(difference, "") << "schedule " << seed << ": " << schedule.ToText() << "\n" << outcome.story;
    diverged += !difference.empty();
    ASSERT_LT(diverged, 20) << "enough of them";
  }
}

}  // namespace
}  // namespace dmslam::simulation
