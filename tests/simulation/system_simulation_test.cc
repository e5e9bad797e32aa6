// The whole system on a simulated network: the nodes of all processes as they are, in one thread and virtual
// time, and schedules of what goes wrong, each drawn from a seed.
//
// DMSLAM_FIRST_SCHEDULE and DMSLAM_SCHEDULES choose which seeds; DMSLAM_TELL=1 tells what happened in each.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "dmslam/console/log.h"
#include "dmslam/dataset/image.h"
#include "dmslam/dataset/trajectory.h"
#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/evaluation/ate.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/runtime/load_vocabulary.h"
#include "dmslam/synthetic/sequence_writer.h"
#include "in_process.h"
#include "simulated_system.h"

namespace dmslam::simulation {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kFrames = 60;
constexpr double kMostRmseM = 0.01;

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
    options.collector.for_people = false;
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

  /// What must hold where processes that make the map have died or moved; empty: it does.
  static std::string Loss(const Outcome& outcome) {
    if (!outcome.failure.empty()) return outcome.failure;
    std::string loss;
    if (Number(outcome, "keyframes_missing") != 0) loss += " keyframes are missing,";
    if (Number(outcome, "records_lost") != 0) loss += " records are lost,";
    if (Number(outcome, "resumed") != 0) loss += " began again from a checkpoint,";
    const Distance distance = Measure(outcome, *reference_);
    if (distance.rmse_m > kMostRmseM) loss += " poses are off by " + std::to_string(distance.rmse_m) + " m,";
    if (Lines(outcome.online) + 12 < Lines(reference_->online))
      loss += " only " + std::to_string(Lines(outcome.online)) + " frames were tracked,";
    std::set<int64_t> placed;
    for (const StampedPose& pose : Poses(outcome.trajectory)) placed.insert(pose.stamp_ns);
    for (const StampedPose& pose : Poses(outcome.online))
      if (!placed.contains(pose.stamp_ns)) loss += " a pose that was told is missing,";
    return loss;
  }

  /// Of the summary.
  static double Number(const Outcome& outcome, const std::string& key) {
    const size_t at = outcome.summary.find("\"" + key + "\":");
    return at == std::string::npos ? -1 : std::atof(outcome.summary.c_str() + at + key.size() + 3);
  }
  static int64_t Lines(const std::string& text) { return std::ranges::count(text, '\n'); }

  /// How far two runs are apart.
  struct Distance {
    double rmse_m = 1e9;
    int64_t poses = 0;
    int64_t other_keyframes = 0;  ///< that only one of them has
  };
  static Distance Measure(const Outcome& outcome, const Outcome& other) {
    Distance distance;
    distance.poses = Lines(outcome.trajectory);
    const auto poses = Poses(outcome.trajectory), others = Poses(other.trajectory);
    if (poses.empty() || others.empty()) return distance;
    const AteReport report = EvaluateAte(others, poses);
    if (report.usable()) distance.rmse_m = report.rmse() * WorldScale();
    std::set<int64_t> a, b, differing;
    for (const StampedPose& pose : Poses(outcome.keyframes)) a.insert(pose.stamp_ns);
    for (const StampedPose& pose : Poses(other.keyframes)) b.insert(pose.stamp_ns);
    std::ranges::set_symmetric_difference(a, b, std::inserter(differing, differing.end()));
    distance.other_keyframes = static_cast<int64_t>(differing.size());
    return distance;
  }
  static double WorldScale() { return 1; }
  static std::vector<StampedPose> Poses(const std::string& text) {
    const std::string path = (folder_ / "poses.txt").string();
    std::ofstream(path) << text;
    return Lines(text) > 1 ? ReadTrajectory(path) : std::vector<StampedPose>();
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

TEST_F(SystemSimulation, OtherSeedsOfTheSlamDifferByLess) {
  for (uint64_t seed = 2; seed <= 5; ++seed) {
    const Distance distance = Measure(RunUndisturbed(seed), *reference_);
    std::printf("seed %ld: %.5f m, %ld poses, %ld other keyframes\n", static_cast<long>(seed),
                distance.rmse_m, static_cast<long>(distance.poses),
                static_cast<long>(distance.other_keyframes));
  }
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
    const std::string difference = schedule.meets_writers ? Loss(outcome) : Difference(outcome);
    if (tells_) {
      const Distance distance = Measure(outcome, *reference_);
      std::printf("apart %.5f m, %ld poses, %ld other keyframes\n", distance.rmse_m,
                  static_cast<long>(distance.poses), static_cast<long>(distance.other_keyframes));
    }
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
