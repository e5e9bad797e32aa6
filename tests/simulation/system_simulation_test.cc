// The whole system on a simulated network: the nodes of all processes as they are, in one thread and virtual
// time, and schedules of what goes wrong, each drawn from a seed.
//
// DMSLAM_FIRST_SCHEDULE and DMSLAM_SCHEDULES choose which seeds; DMSLAM_TELL=1 tells what happened in each.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "comparison.h"
#include "dmslam/console/log.h"
#include "simulated_system.h"
#include "small_workload.h"

namespace dmslam::simulation {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kFramesLost = 3;  // while something moves
constexpr int64_t kFramesLostByFrontend = 12;
constexpr int64_t kRecordsLost =
    10;  // that were on their way when their writer died, by each of their readers
constexpr uint32_t kFirstMapFrame =
    15;  // a frontend that dies before it loses all that it had for the first map
constexpr double kBetweenKeyframesS = 1;  // in the sequence of these tests
constexpr int64_t kMs = 1'000'000;
constexpr int64_t kSecond = 1000 * kMs;

Fault Kill(const std::string& process, uint32_t at_frame, int64_t lasts_ns, int64_t after_ns = 0) {
  Fault fault;
  fault.kind = Fault::Kind::kKill;
  fault.process = process;
  fault.at_frame = at_frame;
  fault.after_ns = after_ns;
  fault.lasts_ns = lasts_ns;
  return fault;
}

Fault Full(uint32_t at_frame, int64_t lasts_ns) {
  Fault fault;
  fault.kind = Fault::Kind::kFullDisk;
  fault.process = "collector";
  fault.at_frame = at_frame;
  fault.lasts_ns = lasts_ns;
  return fault;
}

Fault Cut(int host, uint32_t at_frame, int64_t lasts_ns) {
  Fault fault;
  fault.kind = Fault::Kind::kPartition;
  fault.host = host;
  fault.at_frame = at_frame;
  fault.lasts_ns = lasts_ns;
  return fault;
}

int64_t FromEnvironment(const char* name, int64_t otherwise) {
  const char* value = std::getenv(name);
  return value == nullptr ? otherwise : std::atoll(value);
}

double ProcessorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// In memory where there is such a place: journals are synced once a virtual second.
fs::path ScratchFolder() {
  const std::string name = "dmslam_simulation_" + std::to_string(getpid());
  return (fs::is_directory("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path()) / name;
}

/// Made once: a sequence, and what becomes of it where nothing goes wrong.
class SystemSimulation : public ::testing::Test {
 protected:
  struct Common {
    explicit Common(bool all_is_told) : tells(all_is_told), folder(ScratchFolder()) {
      workload = MakeSmallWorkload((folder / "sequence").string());
      undisturbed = Undisturbed(workload.settings);
    }
    ~Common() { fs::remove_all(folder); }
    Common(const Common&) = delete;
    Common& operator=(const Common&) = delete;

    Outcome Undisturbed(const Settings& settings, size_t start = 0) const {
      return RunUndisturbed(workload, settings, (folder / "undisturbed").string(), start);
    }
    bool tells;
    fs::path folder;
    Workload workload;
    Outcome undisturbed;
  };

  static void SetUpTestSuite() {
    const bool tells = FromEnvironment("DMSLAM_TELL", 0) > 0;
    SetUpLog("system_simulation", !tells);
    common_ = std::make_unique<Common>(tells);
  }
  static void TearDownTestSuite() { common_.reset(); }

  static Outcome Run(const Schedule& schedule) {
    return RunSchedule(common_->workload, schedule, (common_->folder / "run").string());
  }
  static uint32_t NumFrames() { return static_cast<uint32_t>(common_->workload.frames.size()); }

  /// How far any two runs are apart in which nothing went wrong: a few features more or fewer, begun a few
  /// frames later.
  static double Spread() {
    static const double spread = [] {
      std::vector<Outcome> runs{common_->undisturbed};
      for (const int features : {480, 490, 510, 520})
        runs.push_back(common_->Undisturbed(SmallSettings(1, features)));
      for (const size_t start : {3u, 6u, 9u}) runs.push_back(common_->Undisturbed(SmallSettings(1), start));
      double most = 0;
      for (const Outcome& run : runs) {
        for (const Outcome& other : runs) {
          if (&run != &other) most = std::max(most, Measure(run, other, common_->folder.string()).rmse);
        }
      }
      if (common_->tells) std::printf("undisturbed runs: at most %.5f apart\n", most);
      return most;
    }();
    return spread;
  }
  /// How far poses as they were told are from what they are refined to: a frontend that dies takes along what
  /// it would have refined them with.
  static double UnrefinedApart() {
    Outcome as_told = common_->undisturbed;
    as_told.trajectory = as_told.online;
    return Apart(as_told);
  }
  static double Apart(const Outcome& outcome) {
    const Distance distance = Measure(outcome, common_->undisturbed, common_->folder.string());
    if (common_->tells)
      std::printf("undisturbed: %.5f apart, %ld tracked, %ld other keyframes\n", distance.rmse,
                  static_cast<long>(distance.tracked), static_cast<long>(distance.other_keyframes));
    return distance.rmse;
  }

  /// What may be lost with who dies or moves.
  static Allowance AllowedBy(const Fault& fault) {
    Allowance allowed;
    if (fault.kind != Fault::Kind::kKill && fault.kind != Fault::Kind::kMove) return allowed;
    const bool frontend = fault.process == "frontend";
    const bool dies = fault.kind == Fault::Kind::kKill && (frontend || fault.process == "loopcloser");
    if (dies) allowed.records_lost = kRecordsLost;
    if (dies && frontend) allowed.most_apart = UnrefinedApart();
    allowed.frames_lost = frontend ? kFramesLostByFrontend : kFramesLost;
    if (frontend && fault.at_frame < kFirstMapFrame) allowed.frames_lost += NumFrames();
    return allowed;
  }
  /// One that drops the map is asked for again, and then it is not there.
  static bool Costs(const Outcome::Forged& forged) {
    return MayCost(forged.content) && forged.content != Content::kReset;
  }
  /// A forged next frame costs that frame, a forged next record what stood in its place.
  static Allowance AllowedBy(const Outcome::Forged& forged) {
    Allowance allowed;
    if (!Costs(forged)) return allowed;
    allowed.frames_lost = kFramesLost;
    if (forged.frame < kFirstMapFrame) allowed.frames_lost += kFirstMapFrame;
    if (forged.content == Content::kNextRecord) allowed.keyframes_missing = 1;
    return allowed;
  }
  static Allowance AllowedBy(const Outcome::Resumed& resumed) {
    Allowance allowed;
    if (resumed.anew) return allowed;
    allowed.resumed = !resumed.complete;
    allowed.most_apart = UnrefinedApart();
    allowed.frames_lost = kFramesLostByFrontend;
    return allowed;
  }
  static Allowance AllowedBy(const Schedule& schedule, const Outcome& outcome) {
    Allowance sum;
    sum.most_apart = Spread();
    const auto add = [&sum](const Allowance& allowed) {
      sum.most_apart = std::max(sum.most_apart, allowed.most_apart);
      sum.frames_lost += allowed.frames_lost;
      sum.records_lost += allowed.records_lost;
      sum.keyframes_missing += allowed.keyframes_missing;
      sum.resumed += allowed.resumed;
    };
    for (const Fault& fault : schedule.faults) add(AllowedBy(fault));
    for (const Outcome::Forged& forged : outcome.forged) add(AllowedBy(forged));
    for (const Outcome::Resumed& resumed : outcome.resumed) add(AllowedBy(resumed));
    return sum;
  }

  /// Where nobody kept the collector from its work, no change of the map is older than the checkpoint's age,
  /// but for the keyframe that comes next.
  static std::string TooOldACheckpoint(const Schedule& schedule, const Outcome& outcome) {
    using Kind = Fault::Kind;
    const bool was_kept_from_it = std::ranges::any_of(schedule.faults, [](const Fault& fault) {
      return fault.kind != Kind::kKillAll && fault.kind != Kind::kPowerCut && fault.kind != Kind::kContent;
    });
    const auto& frames = common_->workload.frames;
    const auto is_too_old = [&](const Outcome::Resumed& time) {
      if (time.anew || time.complete || !time.last_frame || !time.newest_keyframe) return false;
      const double age_s =
          static_cast<double>(frames[*time.last_frame].stamp_ns - frames[*time.newest_keyframe].stamp_ns) *
          1e-9;
      return age_s > schedule.checkpoint_s + kBetweenKeyframesS;
    };
    return !was_kept_from_it && std::ranges::any_of(outcome.resumed, is_too_old)
               ? " the checkpoint is too old,"
               : "";
  }
  static bool WasResumed(const Outcome& outcome) {
    return std::ranges::any_of(outcome.resumed, [](const Outcome::Resumed& time) { return !time.anew; });
  }

  /// Why the promises are not kept; empty: they are.
  static std::string Broken(const Schedule& schedule, const Outcome& outcome) {
    if (outcome.restarts > 0 && !schedule.MeetsDeaths()) return " a process had to be started again";
    // Who holds something together may lose it together: that is named.
    const std::string folder = common_->folder.string();
    const std::string by_resuming = LossByResuming(outcome, folder) + TooOldACheckpoint(schedule, outcome);
    if (schedule.at_once && NamesLosses(outcome)) return Unnamed(outcome, folder) + by_resuming;
    const bool costly = std::ranges::any_of(outcome.forged, Costs);
    if (!schedule.meets_writers && !costly && !WasResumed(outcome))
      return Difference(outcome, common_->undisturbed);
    return Loss(outcome, common_->undisturbed, AllowedBy(schedule, outcome), folder) + by_resuming;
  }

  static void Tell(const Schedule& schedule, const Outcome& outcome) {
    const Distance distance = Measure(outcome, common_->undisturbed, common_->folder.string());
    std::printf(
        "schedule %ld: %s\n%s%.1f s, %ld turns, %ld sent, %ld delivered, %ld lost; apart %.5f, %ld "
        "tracked, %ld placed, %ld other keyframes\n",
        static_cast<long>(schedule.seed), schedule.ToText().c_str(), outcome.story.c_str(), outcome.virtual_s,
        static_cast<long>(outcome.turns), static_cast<long>(outcome.network.sent),
        static_cast<long>(outcome.network.delivered), static_cast<long>(outcome.network.lost), distance.rmse,
        static_cast<long>(distance.tracked), static_cast<long>(distance.placed),
        static_cast<long>(distance.other_keyframes));
  }

  /// Of the frame whose pose is the first one in a trajectory's text.
  static uint32_t IndexOfFirstPose(const std::string& trajectory) {
    const double stamp_s = std::atof(trajectory.c_str() + trajectory.find('\n') + 1);
    const auto& frames = common_->workload.frames;
    const auto is_it = [&](const StoredFrame& frame) {
      return std::abs(static_cast<double>(frame.stamp_ns) * 1e-9 - stamp_s) < 1e-3;
    };
    return static_cast<uint32_t>(std::ranges::find_if(frames, is_it) - frames.begin());
  }

  static std::unique_ptr<Common> common_;
};

std::unique_ptr<SystemSimulation::Common> SystemSimulation::common_;

TEST_F(SystemSimulation, WhereNothingGoesWrongItIsTheRunInOneProcess) {
  ASSERT_EQ(common_->undisturbed.failure, "");
  const Distance distance = Measure(common_->undisturbed, common_->undisturbed, common_->folder.string());
  EXPECT_GE(distance.tracked, 40) << "too little happens in this sequence";
  EXPECT_GE(std::ranges::count(common_->undisturbed.keyframes, '\n'), 7);
  const Outcome calm = Run(CalmSchedule());
  EXPECT_EQ(Difference(calm, common_->undisturbed), "");
  EXPECT_EQ(Number(calm, "records_without_room"), 0);
}

TEST_F(SystemSimulation, TheSameSeedGivesTheSameRun) {
  const Schedule schedule = DrawSchedule(30, NumFrames());
  const Outcome a = Run(schedule), b = Run(schedule);
  EXPECT_EQ(a.story, b.story);
  EXPECT_EQ(a.turns, b.turns);
  EXPECT_EQ(a.network.delivered, b.network.delivered);
  EXPECT_EQ(Difference(a, b), "");
}

/// In lock-step the first frame waits for who keeps what is told of it: a frontend that dies soon takes no
/// more of it along than one that dies later.
TEST_F(SystemSimulation, WhoBeginsLateMissesNothingOfAFrontendThatDies) {
  for (const uint64_t seed : {1, 3}) {
    Schedule schedule = CalmSchedule();
    schedule.seed = seed;
    schedule.at_once = true;
    schedule.latest_start_ns = 4 * kSecond;
    schedule.faults = {Kill("frontend", 30, kSecond / 10)};
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    ASSERT_EQ(outcome.failure, "") << outcome.story;
    const Distance distance = Measure(outcome, common_->undisturbed, common_->folder.string());
    const Distance calm = Measure(common_->undisturbed, common_->undisturbed, common_->folder.string());
    EXPECT_GE(distance.tracked, calm.tracked - kFramesLostByFrontend) << outcome.story;
  }
}

/// What only a frontend has that dies is lost; that is counted.
TEST_F(SystemSimulation, WhatADeadFrontendHadNotDeliveredIsCounted) {
  Schedule schedule = CalmSchedule();
  schedule.at_once = true;
  schedule.num_hosts = 2;
  schedule.host_of["collector"] = 1;
  schedule.faults = {Cut(1, 30, 3 * kSecond), Kill("frontend", 40, kSecond / 2)};
  const Outcome outcome = Run(schedule);
  if (common_->tells) Tell(schedule, outcome);
  ASSERT_EQ(outcome.failure, "") << outcome.story;
  EXPECT_GE(Number(outcome, "records_lost"), 5) << outcome.summary;
}

/// In real time nobody waits for the collector: whether the next frontend begins before it or after it. The
/// map says how far the dead one had told. (The next one comes too late to track anything here.)
TEST_F(SystemSimulation, WhatAFrontendToldThatDiedBeforeTheCollectorCameIsCounted) {
  for (const uint32_t frame : {16u, 30u}) {
    Schedule schedule = CalmSchedule();
    schedule.at_once = true;
    schedule.realtime = true;
    schedule.begins_ns["collector"] = 4 * kSecond;
    schedule.faults = {Kill("frontend", frame, kSecond / 10)};
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    EXPECT_GE(Number(outcome, "records_lost"), frame) << outcome.story << outcome.summary;
  }
}

/// ... and where it only comes late, it misses nothing.
TEST_F(SystemSimulation, ACollectorThatComesLateMissesNothingOfAFrontendThatLives) {
  Schedule schedule = CalmSchedule();
  schedule.at_once = true;
  schedule.realtime = true;
  schedule.begins_ns["collector"] = 4 * kSecond;
  const Outcome outcome = Run(schedule);
  if (common_->tells) Tell(schedule, outcome);
  EXPECT_EQ(outcome.failure, "") << outcome.story;
  EXPECT_EQ(Number(outcome, "records_lost"), 0) << outcome.story;
}

/// The mapper, and the collector half a second later, at the very end: whatever they had told whom until
/// then.
TEST_F(SystemSimulation, MapperAndCollectorMayDieTogetherAtTheEnd) {
  for (const int64_t after_ms : {0, 60, 150, 250, 350, 700}) {
    Schedule schedule = CalmSchedule();
    schedule.at_once = true;
    schedule.seed = static_cast<uint64_t>(after_ms);
    schedule.faults = {Kill("mapper", NumFrames(), 4 * kSecond, after_ms * kMs),
                       Kill("collector", NumFrames(), 4 * kSecond, kSecond / 20)};
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    const Allowance allowed{Spread(), kFramesLost, 0, 0};
    EXPECT_EQ(Loss(outcome, common_->undisturbed, allowed, common_->folder.string()), "")
        << after_ms << " ms\n"
        << outcome.story;
  }
}

/// ... or the collector alone, when all others may have gone.
TEST_F(SystemSimulation, TheCollectorMayDieWhenAllOthersHaveEnded) {
  for (const int64_t after_ms : {0, 60, 150, 250, 350, 500}) {
    Schedule schedule = CalmSchedule();
    schedule.at_once = true;
    schedule.seed = static_cast<uint64_t>(after_ms);
    schedule.faults = {Kill("collector", NumFrames(), 40 * kSecond, after_ms * kMs)};
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    EXPECT_EQ(Difference(outcome, common_->undisturbed), "") << after_ms << " ms\n" << outcome.story;
  }
}

/// ... and who comes when the player is gone, too, has not heard how many frames there were, some of which
/// never came to the frontend.
TEST_F(SystemSimulation, ACollectorThatComesAfterTheEndCountsTheFramesThatNobodyTracked) {
  Schedule schedule = CalmSchedule();
  schedule.at_once = true;
  schedule.realtime = true;
  schedule.network.loss = 0.1;
  schedule.faults = {Kill("collector", NumFrames() - 2, 40 * kSecond),
                     Kill("player", NumFrames(), 600 * kSecond, kSecond)};
  const Outcome outcome = Run(schedule);
  if (common_->tells) Tell(schedule, outcome);
  ASSERT_EQ(outcome.failure, "") << outcome.story;
  EXPECT_LT(Number(outcome, "frames_received"), NumFrames());
  EXPECT_EQ(Number(outcome, "frames"), NumFrames());
  const auto told = static_cast<double>(std::ranges::count(outcome.online, '\n') - 1);
  EXPECT_NEAR(Number(outcome, "tracked_online_percent"), 100 * told / NumFrames(), 1e-6);
  EXPECT_NEAR(Number(outcome, "tracked_online_after_first_map_percent"),
              100 * told / (NumFrames() - IndexOfFirstPose(outcome.online)), 1e-6);
}

/// Also who dies while no collector is there, and whatever the one before had counted.
TEST_F(SystemSimulation, RestartsAndFramesAreCountedWhoeverCountsThem) {
  const std::vector<std::vector<Fault>> runs = {
      {Kill("mapper", 12, kSecond / 10), Kill("collector", 30, kSecond / 10)},
      {Kill("collector", 30, 2 * kSecond), Kill("mapper", 31, kSecond / 10)},
      {Kill("loopcloser", 12, kSecond / 10), Kill("collector", 30, kSecond / 10),
       Kill("mapper", 50, kSecond / 10)}};
  for (const std::vector<Fault>& faults : runs) {
    Schedule schedule = CalmSchedule();
    schedule.at_once = true;
    schedule.faults = faults;
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    ASSERT_EQ(outcome.failure, "") << outcome.story;
    EXPECT_EQ(Number(outcome, "restarts"), static_cast<double>(faults.size())) << outcome.story;
    EXPECT_EQ(Number(outcome, "frames_processed"), NumFrames()) << outcome.story;
    EXPECT_EQ(Number(outcome, "keyframes_missing"), 0) << outcome.story;
  }
}

/// What the disk does not take is not acknowledged: the frontend still has it.
TEST_F(SystemSimulation, ACollectorMayDieWhileItsDiskIsFull) {
  Schedule schedule = CalmSchedule();
  schedule.at_once = true;
  schedule.faults = {Full(20, 5 * kSecond), Kill("collector", 50, kSecond / 2)};
  const Outcome outcome = Run(schedule);
  if (common_->tells) Tell(schedule, outcome);
  EXPECT_EQ(Difference(outcome, common_->undisturbed), "") << outcome.story;
}

TEST_F(SystemSimulation, TheEndWaitsForRoomOnTheDisk) {
  for (const bool dies : {false, true}) {
    Schedule schedule = CalmSchedule();
    schedule.at_once = true;
    schedule.faults = {Full(50, 15 * kSecond)};
    if (dies) schedule.faults.push_back(Kill("collector", NumFrames(), kSecond / 2, 2 * kSecond));
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    EXPECT_EQ(Difference(outcome, common_->undisturbed), "") << outcome.story;
    EXPECT_GT(outcome.virtual_s, 10) << "the disk was not full at the end";
  }
}

TEST_F(SystemSimulation, WhereNoRoomComesTheRunEndsAndSaysWhy) {
  Schedule schedule = CalmSchedule();
  schedule.at_once = true;
  schedule.faults = {Full(50, 600 * kSecond)};
  const Outcome outcome = Run(schedule);
  if (common_->tells) Tell(schedule, outcome);
  EXPECT_NE(outcome.failure.find("collector has ended with 1"), std::string::npos) << outcome.failure;
  EXPECT_NE(outcome.failure.find("frame poses"), std::string::npos) << outcome.failure;
  EXPECT_LT(outcome.virtual_s, 120);
}

/// In the middle of a keyframe, whatever of it the others have heard: the frontend tells it again.
TEST_F(SystemSimulation, AMapperMayDieInTheMiddleOfAKeyframe) {
  for (int records = 1; records <= 7; ++records) {
    Schedule schedule = CalmSchedule();
    schedule.at_once = true;
    schedule.realtime = true;
    schedule.seed = static_cast<uint64_t>(records);
    schedule.network.loss = 0.02;
    schedule.faults = {Kill("mapper", 24, kSecond / 10)};
    schedule.faults[0].records = records;
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    EXPECT_EQ(outcome.failure, "") << outcome.story;
    EXPECT_GE(Number(outcome, "keyframes_proposed"), 7);
    EXPECT_EQ(Number(outcome, "keyframes_missing"), 0) << "after " << records << " records";
    EXPECT_EQ(Number(outcome, "keyframes_lost_with_frontend"), 0);
    EXPECT_EQ(Number(outcome, "records_lost"), 0);
  }
}

/// The keyframe that waits for the next mapper: that hears it from its frontend, or, where it comes too late
/// for that, from the next frontend, who has it from the collector. Where that dies too it is lost, and named
/// as what it is.
TEST_F(SystemSimulation, AKeyframeThatWaitsForAMapperOutlivesItsFrontendOrIsNamed) {
  for (const uint32_t frame : {22u, 34u}) {
    for (const int64_t after_ms : {200, 300, 400, 1000, -300}) {
      const bool nobody_has_it = after_ms < 0;
      Schedule schedule = CalmSchedule();
      schedule.at_once = true;
      schedule.realtime = true;
      schedule.faults = {Kill("mapper", frame, kSecond / 10),
                         Kill("frontend", frame, kSecond / 10, std::abs(after_ms) * kMs)};
      if (nobody_has_it) schedule.faults.push_back(Kill("collector", frame, kSecond / 10));
      const Outcome outcome = Run(schedule);
      if (common_->tells) Tell(schedule, outcome);
      EXPECT_EQ(outcome.failure, "") << outcome.story;
      EXPECT_EQ(Number(outcome, "keyframes_missing"), 0) << after_ms << " ms\n" << outcome.story;
      EXPECT_EQ(Number(outcome, "keyframes_lost_with_frontend"), nobody_has_it ? 1 : 0) << after_ms;
      EXPECT_LE(Number(outcome, "records_lost"), kRecordsLost);
    }
  }
}

/// The player begins from the front, and no frontend is there yet that could say how far the run is.
TEST_F(SystemSimulation, PlayerAndFrontendThatDieTogetherDoNotGoBack) {
  for (const bool realtime : {false, true}) {
    Schedule schedule = CalmSchedule();
    schedule.at_once = true;
    schedule.realtime = realtime;
    schedule.faults = {Kill("frontend", 40, 3 * kSecond / 2), Kill("player", 40, kSecond / 10)};
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    ASSERT_EQ(outcome.failure, "") << outcome.story;
    EXPECT_EQ(Number(outcome, "keyframes_missing"), 0) << outcome.story;
    EXPECT_EQ(Number(outcome, "frames"), NumFrames());
    // Of what the dead frontend had done that is counted which it had told: hardly anything in lock-step.
    const int64_t told = realtime ? 40 : kFramesLost;
    EXPECT_LE(Number(outcome, "frames_processed"), NumFrames() - 40 + told + kFramesLost) << outcome.story;
  }
}

/// The mapper's stream begins with the checkpoint, and is kept while the loop closer lacks it: the second
/// collector hears the same beginning.
TEST_F(SystemSimulation, CollectorsThatFollowEachOtherCountOneResume) {
  Schedule schedule = CalmSchedule();
  schedule.at_once = true;
  Fault all_die = Kill("", 21, kSecond);
  all_die.kind = Fault::Kind::kKillAll;
  Fault stands_still = Kill("loopcloser", 21, 2 * kSecond, kSecond + 10 * kMs);
  stands_still.kind = Fault::Kind::kPause;
  schedule.faults = {all_die, stands_still, Kill("collector", 21, kSecond / 10, kSecond)};
  const Outcome outcome = Run(schedule);
  if (common_->tells) Tell(schedule, outcome);
  ASSERT_EQ(outcome.failure, "") << outcome.story;
  ASSERT_EQ(outcome.resumed.size(), 1u);
  EXPECT_FALSE(outcome.resumed[0].anew);
  EXPECT_EQ(Number(outcome, "resumed"), 1) << outcome.story;
}

/// The collector has a later term of the frontend's in its journal, and nobody is left who could name it.
TEST_F(SystemSimulation, AllMayDieAndBeginAgainOnAClockThatIsBehind) {
  Schedule schedule = CalmSchedule();
  schedule.at_once = true;
  Fault set_back;
  set_back.kind = Fault::Kind::kClockStep;
  set_back.at_frame = 30;
  set_back.step_us = -3'600'000'000;
  schedule.faults = {set_back};
  for (const std::string& role : Roles())
    schedule.faults.push_back(Kill(role, 30, role == "player" ? 4 * kSecond : kSecond / 2));
  const Outcome outcome = Run(schedule);
  if (common_->tells) Tell(schedule, outcome);
  EXPECT_EQ(outcome.failure, "") << outcome.story;
  EXPECT_EQ(Number(outcome, "frames"), NumFrames());
  EXPECT_EQ(Unnamed(outcome, common_->folder.string()), "") << outcome.story;
}

/// Mapper and collector have just come back and name no term of the frontend's; the map says how far an
/// earlier one had come, whose clock was ahead.
TEST_F(SystemSimulation, AFrontendMayBeginOnAClockThatIsBehind) {
  Schedule schedule = CalmSchedule();
  schedule.at_once = true;
  schedule.num_hosts = 2;
  for (const std::string& role : Roles()) schedule.host_of[role] = 1;
  Fault set_back;
  set_back.kind = Fault::Kind::kClockStep;
  set_back.at_frame = 20;
  set_back.step_us = -3'600'000'000;
  Fault frontend = Kill("frontend", 36, 3 * kSecond);
  frontend.host = 0;
  Fault collector = Kill("collector", 36, kSecond / 20), mapper = Kill("mapper", 36, kSecond / 2);
  collector.host = mapper.host = 1;
  schedule.faults = {set_back, collector, mapper, frontend};
  const Outcome outcome = Run(schedule);
  if (common_->tells) Tell(schedule, outcome);
  EXPECT_EQ(outcome.failure, "") << outcome.story;
  EXPECT_EQ(Number(outcome, "frames"), NumFrames());
}

/// A collector that comes back takes at once what the frontend has kept for it: that may die soon after.
TEST_F(SystemSimulation, AFrontendMayDieSoonAfterTheCollectorIsBack) {
  for (const uint64_t seed : {1u, 2u, 3u, 4u}) {
    Schedule schedule = CalmSchedule();
    schedule.at_once = true;
    schedule.seed = seed;
    schedule.network.loss = 0.08;
    schedule.network.max_delay_ns = 33 * kMs;
    schedule.faults = {Kill("collector", 20, 2 * kSecond),
                       Kill("frontend", 20, kSecond / 5, 2 * kSecond + 700 * kMs)};
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    ASSERT_EQ(outcome.failure, "") << outcome.story;
    EXPECT_LE(Number(outcome, "records_lost"), kRecordsLost) << outcome.story;
  }
}

/// Before the first checkpoint nothing of the map is left. Its keyframes are named as what they are, whether
/// the next collector comes before the next map begins or behind it.
TEST_F(SystemSimulation, AllWhoHoldTheMapMayDieBeforeTheFirstCheckpoint) {
  for (const int64_t away_ms : {100, 3000}) {
    Schedule schedule = CalmSchedule();
    schedule.at_once = true;
    schedule.checkpoint_s = 0;
    schedule.faults = {Kill("collector", 30, away_ms * kMs), Kill("loopcloser", 30, 400 * kMs),
                       Kill("mapper", 30, 200 * kMs), Kill("frontend", 30, 300 * kMs),
                       Kill("collector", 55, kSecond / 10)};  // ... and the one after it counts no more
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    ASSERT_EQ(outcome.failure, "") << outcome.story;
    EXPECT_EQ(Number(outcome, "keyframes_missing"), 0) << away_ms << " ms\n" << outcome.story;
    EXPECT_GE(Number(outcome, "keyframes_lost_in_crash"), 5) << outcome.story;
    EXPECT_EQ(Number(outcome, "resumed"), 1) << outcome.story;
  }
}

/// Whoever resumes a run makes safe what it goes on from: those who had written it may have been killed
/// before they did.
TEST_F(SystemSimulation, ThePowerMayFailBeforeAResumedRunHasBegun) {
  for (const uint64_t seed : {1u, 2u, 3u}) {
    Schedule schedule = CalmSchedule();
    schedule.seed = seed;
    schedule.checkpoint_s = 0.3;
    Fault all_die = Kill("", 30, 5 * kSecond), power_cut = Kill("", 30, 5 * kSecond, 20 * kMs);
    all_die.kind = Fault::Kind::kKillAll;
    power_cut.kind = Fault::Kind::kPowerCut;
    schedule.faults = {all_die, power_cut};
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    ASSERT_EQ(outcome.failure, "") << outcome.story;
    ASSERT_EQ(outcome.resumed.size(), 1u);
    EXPECT_EQ(LossByResuming(outcome, common_->folder.string()), "") << outcome.story;
    EXPECT_EQ(Number(outcome, "resumed"), 1);
  }
}

/// The old one says its last words when the other has come: the map ends with it.
TEST_F(SystemSimulation, AFrontendMayBeMovedAtTheVeryEnd) {
  for (const int64_t after_ms : {0, 3, 10, 30, 100, 200, 400}) {
    Schedule schedule = CalmSchedule();
    schedule.at_once = true;
    Fault move = Kill("frontend", NumFrames(), 0, after_ms * kMs);
    move.kind = Fault::Kind::kMove;
    Fault stands_still = Kill("collector", NumFrames(), 7 * kSecond, 10 * kMs);
    stands_still.kind = Fault::Kind::kPause;
    schedule.faults = {move, stands_still};
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    EXPECT_EQ(outcome.failure, "") << after_ms << " ms\n" << outcome.story;
  }
}

/// ... or when the old one has just said that all is done: nobody waits for a frame that does not come.
TEST_F(SystemSimulation, AFrontendMayBeMovedAsItSaysThatItIsDone) {
  for (const uint32_t frame : {38u, 44u, 50u}) {
    Schedule schedule = CalmSchedule();
    schedule.network.loss = 0.02;
    schedule.network.max_delay_ns = 2 * kMs;
    Fault move = Kill("frontend", frame, 0);
    move.kind = Fault::Kind::kMove;
    schedule.faults = {move};
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    EXPECT_EQ(outcome.failure, "") << "frame " << frame << "\n" << outcome.story;
  }
}

/// The one that comes has not the features of the frames before: the old one refines their poses while it
/// still can.
TEST_F(SystemSimulation, AFrontendThatIsMovedLateLeavesRefinedPoses) {
  Schedule schedule = CalmSchedule();
  schedule.network.loss = 0.2;
  Fault move = Kill("frontend", NumFrames() - 7, 0);
  move.kind = Fault::Kind::kMove;
  schedule.faults = {move};
  const Outcome outcome = Run(schedule);
  if (common_->tells) Tell(schedule, outcome);
  const Allowance allowed{Spread(), kFramesLost};
  EXPECT_EQ(Loss(outcome, common_->undisturbed, allowed, common_->folder.string()), "") << outcome.story;
}

/// Of the two that come, the one that is superseded at once has written nothing.
TEST_F(SystemSimulation, AFrontendMayBeMovedTwiceAtOnce) {
  for (const int64_t seed : {145, 150, 160, 163, 164}) {
    Schedule schedule = CalmSchedule();
    schedule.seed = static_cast<uint64_t>(seed);
    schedule.network.loss = 0.15;
    schedule.network.max_delay_ns = 3 * kMs;
    Fault move = Kill("frontend", 38, 0), again = Kill("frontend", 38, 0, seed * kMs);
    move.kind = again.kind = Fault::Kind::kMove;
    schedule.faults = {move, again};
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    ASSERT_EQ(outcome.failure, "") << outcome.story;
    EXPECT_EQ(Number(outcome, "records_lost"), 0) << outcome.story;
  }
}

Fault Forge(Content content, uint32_t at_frame, int64_t after_ns = 0) {
  Fault fault;
  fault.kind = Fault::Kind::kContent;
  fault.content = content;
  fault.at_frame = at_frame;
  fault.after_ns = after_ns;
  return fault;
}

/// It is asked for again, and the frontend knows nothing of it.
TEST_F(SystemSimulation, OneForgedResetOfTheMapCostsNothing) {
  for (const uint32_t frame : {25u, 40u, NumFrames()}) {
    Schedule schedule = CalmSchedule();
    schedule.network.duplication = 0.5;
    schedule.network.max_delay_ns = 60 * kMs;
    schedule.faults = {Forge(Content::kReset, frame)};
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    ASSERT_EQ(outcome.forged.size(), 1u);
    EXPECT_EQ(Difference(outcome, common_->undisturbed), "") << outcome.story;
    EXPECT_EQ(Number(outcome, "resets"), 0);
  }
}

/// ... and so is a session of other settings where the true one is lost on its way.
TEST_F(SystemSimulation, OneForgedSessionEndsNobody) {
  for (const uint64_t seed : {17u, 31u, 32u, 33u}) {  // the first two: lost on its way to the loop closer
    Schedule schedule = CalmSchedule();
    schedule.seed = seed;
    schedule.network.loss = 0.1;
    schedule.faults = {Forge(Content::kSession, 3)};
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    EXPECT_EQ(Difference(outcome, common_->undisturbed), "") << seed << "\n" << outcome.story;
  }
}

TEST_F(SystemSimulation, EverySchedulesPromisesAreKept) {
  const int64_t first = FromEnvironment("DMSLAM_FIRST_SCHEDULE", 1);
  const int64_t count = FromEnvironment("DMSLAM_SCHEDULES", 100);
  std::map<Fault::Kind, int64_t> faults;
  std::map<Content, int64_t> forged;
  int64_t lost = 0, broken = 0, of_writers = 0, at_once = 0, resumed = 0;
  const double began_s = ProcessorSeconds();
  for (int64_t seed = first; seed < first + count && broken < 20; ++seed) {
    const Schedule schedule = DrawSchedule(static_cast<uint64_t>(seed), NumFrames());
    const Outcome outcome = Run(schedule);
    if (common_->tells) Tell(schedule, outcome);
    for (const Fault& fault : schedule.faults) ++faults[fault.kind];
    for (const Outcome::Forged& message : outcome.forged) ++forged[message.content];
    lost += outcome.network.lost;
    of_writers += schedule.meets_writers;
    at_once += schedule.at_once;
    resumed += WasResumed(outcome);
    const std::string why = Broken(schedule, outcome);
    broken += !why.empty();
    EXPECT_EQ(why, "") << "schedule " << seed << ": " << schedule.ToText() << "\n" << outcome.story;
  }
  std::printf(
      "%ld schedules, %ld of them with deaths or moves of who makes the map, %ld with several at once, %ld "
      "resumed; %ld not as promised; %ld messages lost; %.2f s of processor time each\n",
      static_cast<long>(count), static_cast<long>(of_writers), static_cast<long>(at_once),
      static_cast<long>(resumed), static_cast<long>(broken), static_cast<long>(lost),
      (ProcessorSeconds() - began_s) / static_cast<double>(count));
  if (count < 100) return;
  for (const auto& [kind, times] : faults) EXPECT_GT(times, 5) << "of kind " << static_cast<int>(kind);
  EXPECT_EQ(faults.size(), 11u) << "the schedules really try what they are for";
  EXPECT_GT(at_once, 5);
  EXPECT_GT(resumed, 5);
  EXPECT_EQ(forged.size(), static_cast<size_t>(kNumContents));
}

}  // namespace
}  // namespace dmslam::simulation
