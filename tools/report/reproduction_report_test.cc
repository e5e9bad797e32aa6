#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "compare.h"
#include "dmslam/util/check.h"
#include "figures.h"
#include "testing/wavy_path.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

/// A folder with two made-up sequences and, where asked for, results of runs on them.
class Reproduction : public ::testing::Test {
 protected:
  Reproduction() {
    root_ = fs::temp_directory_path() /
            (std::string("dmslam_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(root_);
    for (const char* name :
         {"tum/rgbd_dataset_freiburg3_walking_xyz", "tum/more/synth_walking_xyz", "tum/synth_still_xyz"}) {
      fs::create_directories(root_ / name);
      WriteTrajectory((root_ / name / "groundtruth.txt").string(), WavyPath(150, 0, 1));
      std::ofstream list(root_ / name / "rgb.txt");
      for (const StampedPose& pose : WavyPath(150, 0, 1)) list << FormatPose(pose).substr(0, 8) << " a.png\n";
    }
    options_.roots = {root_ / "tum"};
    options_.seeds = 3;
  }
  ~Reproduction() override { fs::remove_all(root_); }

  void WriteRun(const RunKey& key, double noise, const std::string& summary) {
    const fs::path folder = root_ / "out" / key.Folder();
    fs::create_directories(folder);
    std::ofstream(folder / "summary.json") << summary;
    if (noise < 0) return;
    const auto path = WavyPath(150, noise, static_cast<uint64_t>(key.seed));
    WriteTrajectory((folder / "trajectory.txt").string(), path);
    WriteTrajectory((folder / "trajectory_online.txt").string(), std::span(path).subspan(50, 75));
  }
  void WriteAllRuns(const Plan& plan) {
    for (const RunKey& key : Runs(plan)) {
      WriteRun(key, key.profile == "dm" ? 0.01 : 0.04, R"({"tracked_percent": 97.5, "first_init_s": 1.25})");
    }
  }

  fs::path root_;
  PlanOptions options_;
};

TEST_F(Reproduction, FindsSequencesInTheRootAndOneFolderDeeper) {
  const Plan plan = MakePlan(options_);
  EXPECT_EQ(plan.sequences.size(), KnownSequences().size());
  size_t present = 0;
  for (const PlannedSequence& sequence : plan.sequences) present += sequence.present() ? 1 : 0;
  EXPECT_EQ(present, 3u);
  EXPECT_EQ(Runs(plan).size(), 3u * 2 * 3 * 3);
  SavePlan(plan, root_ / "out");
  EXPECT_EQ(Runs(LoadPlan(root_ / "out")).size(), Runs(plan).size());
  options_.only = {"kitchen", "fr3_walking_xyz"};
  EXPECT_EQ(MakePlan(options_).sequences.size(), 2u);
}

TEST_F(Reproduction, ASequenceWithoutGroundTruthIsNamedBeforeAnythingRuns) {
  fs::remove(root_ / "tum/synth_still_xyz/groundtruth.txt");
  try {
    MakePlan(options_);
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("synth_still_xyz: has no groundtruth.txt"), std::string::npos)
        << error.what();
  }
  options_.only = {"fr3_walking_xyz"};
  EXPECT_EQ(MakePlan(options_).sequences.size(), 1u);
}

TEST_F(Reproduction, BadInputIsNamed) {
  options_.only = {"kitchin"};
  EXPECT_THROW(MakePlan(options_), InputError);
  options_.only.clear();
  options_.seeds = 0;
  EXPECT_THROW(MakePlan(options_), InputError);
  options_.seeds = 1;
  options_.roots = {root_ / "nowhere"};
  EXPECT_THROW(MakePlan(options_), InputError);
  EXPECT_THROW(LoadPlan(root_), InputError);
}

TEST_F(Reproduction, ReportHoldsOurFiguresThePapersAndWhatIsAbsent) {
  const Plan plan = MakePlan(options_);
  WriteAllRuns(plan);
  const Results results = ReadResults(plan, root_ / "out");
  const Cell& dm = *results.Find("fr3_walking_xyz", "defaults", "dm");
  EXPECT_EQ(dm.Count(RunResult::State::kDone), 3u);
  EXPECT_NEAR(dm.Rmse(Metric::kAte)->median, 0.01 * std::sqrt(3.0), 0.002);
  EXPECT_NEAR(dm.TrackedOnlineAfterFirstMapPercent()->median, 75.0, 1e-9);
  const std::string text = ReportMarkdown(results, std::nullopt, {});
  for (const char* part : {"*0.329*", "*0.143*", "*56.5*", "Table 2b", "Table 4", "97.5", "1.25",
                           "**absent**: https://cvg.cit.tum.de", "| fr1_xyz | *absent*",
                           "| synth_walking_xyz | fr3_walking_xyz |"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in\n" << text;
  }
  const auto json = nlohmann::json::parse(ReportJson(results, std::nullopt));
  EXPECT_EQ(json["results"].size(), 3u * 2 * 3);
  EXPECT_EQ(json["results"][0]["runs"].size(), 3u);
}

// Every row of a table has as many cells as its head.
TEST_F(Reproduction, TablesAreEven) {
  const Plan plan = MakePlan(options_);
  WriteAllRuns(plan);
  std::istringstream text(
      ReportMarkdown(ReadResults(plan, root_ / "out"), IterationTimes{1, 2, 3, "here"}, {}));
  std::string line;
  long wanted = 0;
  while (std::getline(text, line)) {
    const long bars = std::count(line.begin(), line.end(), '|');
    if (bars == 0) wanted = 0;
    if (wanted == 0) wanted = bars;
    EXPECT_EQ(bars, wanted) << line;
  }
}

TEST_F(Reproduction, RunsWithoutATrajectoryCountAndAreListed) {
  const Plan plan = MakePlan(options_);
  WriteRun(
      {"fr3_walking_xyz", "defaults", "dm", 1}, 0.01,
      R"({"tracked_percent": 90, "ate_rmse_online": 0.02, "tracked_online_after_first_map_percent": 88})");
  WriteRun({"fr3_walking_xyz", "defaults", "dm", 2}, -1, R"({"tracked_percent": null})");
  const RunKey failed{"fr3_walking_xyz", "defaults", "dm", 3};
  fs::create_directories(root_ / "out" / failed.Folder());
  std::ofstream(root_ / "out" / failed.Folder() / "failed.txt") << "it fell over\n";
  const Results results = ReadResults(plan, root_ / "out");
  const Cell& cell = *results.Find("fr3_walking_xyz", "defaults", "dm");
  EXPECT_EQ(cell.Count(RunResult::State::kNoTrajectory), 1u);
  EXPECT_EQ(cell.Count(RunResult::State::kFailed), 1u);
  EXPECT_EQ(cell.TrackedPercent()->min, 0);
  EXPECT_EQ(cell.AteOnline()->median, 0.02);
  EXPECT_EQ(cell.TrackedOnlineAfterFirstMapPercent()->max, 88);  // as the run says itself
  const std::string text = ReportMarkdown(results, std::nullopt, {});
  EXPECT_NE(text.find("it fell over"), std::string::npos);
  EXPECT_NE(text.find("| 1/3 |"), std::string::npos);
}

TEST_F(Reproduction, ABrokenSummaryIsAFailedRun) {
  const Plan plan = MakePlan(options_);
  WriteAllRuns(plan);
  const RunKey keys[] = {{"fr3_walking_xyz", "defaults", "dm", 1},
                         {"fr3_walking_xyz", "defaults", "dm", 2},
                         {"fr3_walking_xyz", "defaults", "dm", 3}};
  const fs::path out = root_ / "out";
  std::ofstream(out / keys[0].Folder() / "summary.json") << R"({"tracked_percent": 97.5, "first_)";
  std::ofstream(out / keys[1].Folder() / "summary.json") << "";
  EXPECT_FALSE(IsDone(keys[0], out));
  EXPECT_FALSE(IsDone(keys[1], out));
  EXPECT_TRUE(IsDone(keys[2], out));
  const Results results = ReadResults(plan, out);
  const Cell& cell = *results.Find("fr3_walking_xyz", "defaults", "dm");
  EXPECT_EQ(cell.Count(RunResult::State::kFailed), 2u);
  EXPECT_EQ(cell.Count(RunResult::State::kDone), 1u);
  EXPECT_EQ(cell.TrackedPercent()->median, 0);
  EXPECT_NE(ReportMarkdown(results, std::nullopt, {}).find("summary.json: is not JSON"), std::string::npos);
}

// What it was as it came is then not known; the final trajectory counts all the same.
TEST_F(Reproduction, ABrokenOnlineTrajectoryLeavesTheRunDone) {
  const Plan plan = MakePlan(options_);
  WriteAllRuns(plan);
  const RunKey empty{"fr3_walking_xyz", "defaults", "dm", 1}, broken{"fr3_walking_xyz", "defaults", "dm", 2};
  const fs::path out = root_ / "out";
  std::ofstream(out / empty.Folder() / "trajectory_online.txt") << "";
  std::ofstream(out / broken.Folder() / "trajectory_online.txt") << "0.1 0 0";
  for (const RunKey& key : {empty, broken}) {
    const RunResult run = ReadRun(key, out, plan.sequences.front().folder);
    EXPECT_EQ(run.state, RunResult::State::kDone);
    EXPECT_EQ(run.tracked_percent, 97.5);
    EXPECT_FALSE(run.tracked_online_after_first_map_percent);
    EXPECT_NE(run.reason.find("trajectory_online.txt"), std::string::npos) << run.reason;
  }
}

// A failed run is one of those over which the median goes: two of three, and nothing is tracked in the
// middle.
TEST_F(Reproduction, FailedRunsCountAsNothingTracked) {
  const std::string all = R"({"tracked_percent": 100, "tracked_online_percent": 99,
                              "tracked_online_after_first_map_percent": 98})";
  WriteRun({"fr3_walking_xyz", "defaults", "dm", 1}, 0.01, all);
  WriteRun({"fr3_walking_xyz", "defaults", "dm", 2}, -1, R"({"tracked_percent": 60})");
  const RunKey failed{"fr3_walking_xyz", "defaults", "dm", 3};
  fs::create_directories(root_ / "out" / failed.Folder());
  std::ofstream(root_ / "out" / failed.Folder() / "failed.txt") << "it fell over\n";
  const Results results = ReadResults(MakePlan(options_), root_ / "out");
  const Cell& cell = *results.Find("fr3_walking_xyz", "defaults", "dm");
  EXPECT_EQ(cell.TrackedPercent()->count, 3u);
  EXPECT_EQ(cell.TrackedPercent()->median, 0);
  EXPECT_EQ(cell.TrackedOnlinePercent()->median, 0);
  EXPECT_EQ(cell.TrackedOnlineAfterFirstMapPercent()->median, 0);
  const std::string text = ReportMarkdown(results, std::nullopt, {});
  EXPECT_NE(text.find("2 of 3 failed or gave no trajectory"), std::string::npos) << text;
  EXPECT_NE(text.find("| fr3_walking_xyz | dm | 1/3 | 2 of 3 |"), std::string::npos) << text;
  const auto json = nlohmann::json::parse(ReportJson(results, std::nullopt));
  size_t failed_runs = 0;
  for (const auto& one : json["results"]) failed_runs += one["runs_failed"].get<size_t>();
  EXPECT_EQ(failed_runs, 2u);
}

TEST_F(Reproduction, ASmallerPlanTakesNothingOutOfTheReport) {
  const Plan all = MakePlan(options_);
  SavePlan(all, root_ / "out");
  WriteAllRuns(all);
  options_.seeds = 1;
  options_.only = {"synth_walking_xyz"};
  SavePlan(MakePlan(options_), root_ / "out");
  const Plan merged = PlanOfFolder(root_ / "out");
  EXPECT_EQ(merged.seeds, 3);
  EXPECT_EQ(merged.sequences.size(), KnownSequences().size());
  EXPECT_EQ(Runs(merged).size(), Runs(all).size());
  // A sequence that is found later takes its place; one that was found stays found.
  options_.only = {"fr3_walking_xyz", "synth_xyz"};
  options_.roots = {root_ / "out"};
  EXPECT_TRUE(MergePlans(all, MakePlan(options_)).sequences.front().present());
}

// plan.json tells of one sequence and seed, the folder holds runs of three.
TEST_F(Reproduction, WhatWasRunBeyondThePlanIsShown) {
  WriteAllRuns(MakePlan(options_));
  fs::create_directories(root_ / "out/runs/synth_still_xyz/defaults/dm/seed_9.part");
  options_.seeds = 1;
  options_.only = {"fr3_walking_xyz"};
  SavePlan(MakePlan(options_), root_ / "out");
  fs::create_directories(root_ / "out/synthetic");
  fs::rename(root_ / "tum/synth_still_xyz", root_ / "out/synthetic/synth_still_xyz");
  const Plan plan = PlanOfFolder(root_ / "out");
  EXPECT_EQ(plan.seeds, 3);
  ASSERT_EQ(plan.sequences.size(), 3u);
  EXPECT_TRUE(plan.sequences[0].present());
  EXPECT_EQ(plan.sequences[1].info.name, "synth_walking_xyz");
  EXPECT_FALSE(plan.sequences[1].present());  // nobody says where it is
  EXPECT_TRUE(plan.sequences[1].has_runs);
  EXPECT_TRUE(plan.sequences[2].present());  // rendered, so it is where those are
  const std::string text = ReportMarkdown(ReadResults(plan, root_ / "out"), std::nullopt, {});
  EXPECT_NE(text.find("**Its runs are not shown**"), std::string::npos) << text;
}

TEST_F(Reproduction, WithoutAPlanTheRunsTell) {
  EXPECT_THROW(PlanOfFolder(root_ / "out"), InputError);
  WriteAllRuns(MakePlan(options_));
  const Plan plan = PlanOfFolder(root_ / "out");
  EXPECT_EQ(plan.seeds, 3);
  EXPECT_EQ(plan.sequences.size(), 3u);
  EXPECT_TRUE(Runs(plan).empty());  // nobody says where they are
  EXPECT_EQ(Runs(PlanOfFolder(root_ / "out", options_.roots)).size(), 3u * 2 * 3 * 3);
  EXPECT_THROW(PlanOfFolder(root_ / "out", {root_ / "nowhere"}), InputError);
}

TEST_F(Reproduction, VersionsAndMachinesOfTheRuns) {
  const Plan plan = MakePlan(options_);
  const std::string a = R"({"version": "0.1.0+aaaaaaaaaa", "machine": {"cpu": "Z80", "cores": 2}})";
  WriteRun({"fr3_walking_xyz", "defaults", "dm", 1}, 0.01, a);
  WriteRun({"fr3_walking_xyz", "features3000", "dm", 1}, 0.01, a);
  const std::string one = ReportMarkdown(ReadResults(plan, root_ / "out"), std::nullopt, {});
  EXPECT_NE(one.find("Version of the programs: 0.1.0+aaaaaaaaaa. Machine: Z80, 2 cores."), std::string::npos)
      << one;
  EXPECT_EQ(one.find("mix versions"), std::string::npos);
  WriteRun({"fr3_walking_xyz", "defaults", "dm", 2}, 0.01, R"({"version": "0.1.0"})");
  WriteRun({"fr3_walking_xyz", "defaults", "dm", 3}, 0.01, "{}");
  const Results results = ReadResults(plan, root_ / "out");
  const std::string text = ReportMarkdown(results, std::nullopt, {});
  EXPECT_NE(text.find("**The runs are of several versions**: 0.1.0+aaaaaaaaaa (2 runs); "), std::string::npos)
      << text;
  const size_t mixed = text.find("**These tables mix versions**: ");
  EXPECT_GT(mixed, text.find("## With default settings")) << text;  // not those with 3000 features
  const auto json = nlohmann::json::parse(ReportJson(results, std::nullopt));
  ASSERT_EQ(json["versions"].size(), 3u);
  EXPECT_EQ(json["versions"][0]["runs"], 2);
  EXPECT_EQ(json["versions"][1]["version"], "0.1.0, commit not recorded");
  EXPECT_EQ(json["versions"][2]["version"], "not recorded");
  EXPECT_EQ(json["machines_of_runs"][0]["machine"], "Z80, 2 cores");
  EXPECT_GE(json["machine_of_report"]["cores"].get<int>(), 1);
}

TEST_F(Reproduction, JsonHoldsImprovementsAndRatios) {
  const Plan plan = MakePlan(options_);
  WriteAllRuns(plan);
  const Results results = ReadResults(plan, root_ / "out");
  const auto json = nlohmann::json::parse(ReportJson(results, std::nullopt));
  ASSERT_EQ(json["improvements"].size(), 3u * 2);
  const auto& first = json["improvements"][0];
  EXPECT_EQ(first["sequence"], "fr3_walking_xyz");
  EXPECT_NEAR(first["ate_m"]["rmse_percent"].get<double>(), 75, 5);  // 0.04 to 0.01
  EXPECT_NEAR(first["paper"]["ate_rmse_percent"].get<double>(), 56.5, 0.05);
  EXPECT_EQ(first["dm_tracked_percent"]["median"], 97.5);
  EXPECT_FALSE(json["improvements"][2].contains("paper"));  // without actors
  ASSERT_EQ(json["stand_ins"].size(), 2u);
  const auto& stand_in = json["stand_ins"][0];
  EXPECT_EQ(stand_in["without_actors"], "synth_still_xyz");
  EXPECT_NEAR(stand_in["ratio"].get<double>(), 1, 1e-9);  // the same seeds, the same noise
  EXPECT_EQ(stand_in["paper_better_by_percent"], first["paper"]["ate_rmse_percent"]);
}

// A sequence that is absent says where it is to be had, or why it cannot be.
TEST(KnownSequences, EachHasItsSource) {
  for (const SequenceInfo& info : KnownSequences()) {
    const std::string source(info.source);
    EXPECT_TRUE(source.starts_with("https://") || source.starts_with("no public download page") ||
                source.starts_with("nothing to download"))
        << info.name << ": " << source;
  }
}

TEST_F(Reproduction, AComparisonOfUnequalSharesIsMarked) {
  options_.only = {"fr3_walking_xyz"};
  const Plan plan = MakePlan(options_);
  WriteAllRuns(plan);
  const auto rows = [&] {
    const std::string text = ReportMarkdown(ReadResults(plan, root_ / "out"), std::nullopt, {});
    return text.substr(text.find("## Sequences"));  // the introduction explains the mark
  };
  EXPECT_EQ(rows().find("†"), std::string::npos);
  for (const RunKey& key : Runs(plan)) {
    if (key.profile == "dm") WriteRun(key, 0.01, R"({"tracked_percent": 80.5, "first_init_s": 1.25})");
  }
  EXPECT_NE(rows().find(" † |"), std::string::npos);
}

TEST_F(Reproduction, PicturesAreDrawn) {
  options_.only = {"fr3_walking_xyz"};
  const Plan plan = MakePlan(options_);
  WriteAllRuns(plan);
  const fs::path frames =
      root_ / "out" / RunKey{"fr3_walking_xyz", "defaults", "dm", 1}.Folder() / "pictures";
  fs::create_directories(frames);
  // Of these two are after the first map, which came after 1.25 s.
  for (const char* name : {"frame_000120.png", "frame_000060.png", "frame_000000.png", "frame_000036.png"})
    std::ofstream(frames / name) << std::string(20000, 'x');
  const fs::path pairs = root_ / "out/figures/fr3_walking_xyz";
  fs::create_directories(pairs);
  std::ofstream(pairs / "pair_0_5_dlrsac.png") << std::string(20000, 'x');
  const Results results = ReadResults(plan, root_ / "out");
  const auto pictures = DrawPictures(results, root_ / "out");
  ASSERT_EQ(pictures.size(), 7u);
  EXPECT_EQ(pictures[0].title, "fr3_walking_xyz, frames 0 and 5, DLRSAC");
  EXPECT_EQ(pictures[1].title, "fr3_walking_xyz, frame 60");
  EXPECT_EQ(pictures[2].title, "fr3_walking_xyz, frame 120");
  const std::string text = ReportMarkdown(results, std::nullopt, pictures);
  EXPECT_EQ(text.find("in the folder of the runs only"), std::string::npos);
  const std::string without =
      ReportMarkdown(results, std::nullopt, {{FigureSection::kSeeds, "", "All", "pictures/all.png"}});
  EXPECT_NE(without.find("Pictures of fr3_walking_xyz are in the folder"), std::string::npos);
  EXPECT_LT(text.find("## Figure 6"), text.find("## Figure 7"));
  for (const ReportPicture& picture : pictures)
    EXPECT_NE(text.find("(" + picture.file + ")"), std::string::npos);
  for (const ReportPicture& picture : pictures)
    EXPECT_GT(fs::file_size(root_ / "out" / picture.file), 10000u);
}

}  // namespace
}  // namespace dmslam
