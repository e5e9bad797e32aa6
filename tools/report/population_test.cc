#include "population.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "dmslam/util/check.h"
#include "testing/even_tables.h"
#include "testing/wavy_path.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

/// Four sequences of two seconds with more and more people, and runs of two systems on them.
class PopulationFolder : public ::testing::Test {
 protected:
  PopulationFolder() {
    root_ = fs::temp_directory_path() / (std::string("dmslam_population_") +
                                         ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(root_);
    AddSequence("develop", "few", "composited", 0.3);
    AddSequence("develop", "many", "composited", 0.5);
    AddSequence("report", "secret", "composited", 0.3);
    AddSequence("develop", "drawn", "rendered", 0.2);
  }
  ~PopulationFolder() override { fs::remove_all(root_); }

  void AddSequence(const std::string& half, const std::string& name, const std::string& kind,
                   double covered) {
    const fs::path folder = root_ / "sequences" / name;
    fs::create_directories(folder);
    const auto truth = WavyPath(60, 0, 1);
    WriteTrajectory((folder / "groundtruth.txt").string(), truth);
    std::ofstream frames(folder / "rgb.txt"), coverage(folder / "coverage.txt");
    for (const StampedPose& pose : truth) {
      frames << FormatPose(pose).substr(0, FormatPose(pose).find(' ')) << " a.png\n";
      coverage << covered << "\n";
    }
    std::ofstream(root_ / "list", std::ios::app)
        << half << '\t' << name << '\t' << kind << '\t' << folder.string() << '\n';
  }
  void AddRun(const std::string& system, const std::string& name, double noise,
              const std::string& corrections = "[]") {
    const fs::path folder = root_ / system / name;
    fs::create_directories(folder);
    for (const char* file : {"trajectory.txt", "trajectory_online.txt", "keyframes.txt"})
      WriteTrajectory((folder / file).string(), WavyPath(60, noise, 1));
    std::ofstream(folder / "summary.json")
        << R"({"version": "1.2", "loop_closing": {"corrections": )" << corrections << "}}";
  }
  std::vector<PopulationRun> Read() const {
    return ReadPopulationRuns(ReadPopulation(root_ / "list"),
                              {{"dm", root_ / "dm"}, {"baseline", root_ / "baseline"}});
  }
  static const PopulationRow* Find(const std::vector<PopulationRow>& rows, const std::string& title,
                                   const std::string& system) {
    const auto row = std::find_if(rows.begin(), rows.end(),
                                  [&](const auto& r) { return r.title == title && r.system == system; });
    return row == rows.end() ? nullptr : &*row;
  }

  fs::path root_;
};

std::vector<PopulationRun> OfDevelopKitchen(std::vector<PopulationRun> runs) {
  std::erase_if(runs, [](const PopulationRun& run) {
    return run.sequence.kind != "composited" || run.sequence.half != "develop";
  });
  return runs;
}

TEST_F(PopulationFolder, RowsCountByClassAndSystem) {
  AddRun("dm", "few", 0.001);
  AddRun("dm", "many", 0.1);
  AddRun("baseline", "few", 0.001);
  const auto rows = PopulationRows(OfDevelopKitchen(Read()));
  ASSERT_EQ(rows.size(), 6u);
  EXPECT_EQ(Find(rows, "10 to 40 %", "dm")->successes, 1u);
  EXPECT_EQ(Find(rows, "40 to 60 %", "dm")->successes, 0u);
  EXPECT_GT(Find(rows, "40 to 60 %", "dm")->wrong_poses_s.worst, 0.5);
  EXPECT_EQ(Find(rows, "all", "dm")->sequences, 2u);
  EXPECT_EQ(Find(rows, "all", "dm")->successes, 1u);
  EXPECT_EQ(Find(rows, "all", "baseline")->sequences, 1u);
  EXPECT_EQ(Find(rows, "all", "baseline")->missing, 1u);
  EXPECT_NEAR(Find(rows, "all", "dm")->online_ate.median, 0.5 * (0.0017 + 0.17), 0.02);
}

TEST_F(PopulationFolder, AFailedRunIsNoSuccessAndTheWorst) {
  AddRun("dm", "few", 0.001);
  fs::create_directories(root_ / "dm/many");
  std::ofstream(root_ / "dm/many/failed.txt") << "exit status 1: no camera\n";
  const auto runs = Read();
  const auto rows = PopulationRows(OfDevelopKitchen(runs));
  EXPECT_EQ(Find(rows, "all", "dm")->sequences, 2u);
  EXPECT_EQ(Find(rows, "all", "dm")->successes, 1u);
  EXPECT_TRUE(std::isinf(Find(rows, "all", "dm")->final_ate.worst));
  EXPECT_NE(PopulationMarkdown(runs, false).find("failed: exit status 1: no camera"), std::string::npos);
}

TEST_F(PopulationFolder, RenderedOnesAreMeasuredByTheirPath) {
  AddRun("dm", "drawn", 0.001);
  const auto runs = Read();
  const auto run = std::find_if(runs.begin(), runs.end(),
                                [](const auto& r) { return r.sequence.name == "drawn" && r.system == "dm"; });
  // About two metres: 0.5 % of them are a centimetre.
  EXPECT_NEAR(run->path_m, 2, 0.2);
  EXPECT_TRUE(run->verdict.success());
  EXPECT_NEAR(run->AteUnit(), 0.02, 0.002);
  AddRun("dm", "drawn", 0.01);  // within 2 cm in the mean, but beyond 0.5 %
  const auto again = Read();
  EXPECT_FALSE(std::find_if(again.begin(), again.end(), [](const auto& r) {
                 return r.sequence.name == "drawn" && r.system == "dm";
               })->verdict.success());
}

TEST_F(PopulationFolder, LoopsComeFromTheSummary) {
  AddRun("dm", "few", 0.0,
         R"([{"frame": 50, "kind": "loop", "note": "frame 50 sees the place of frame 3 again: all"},
             {"frame": 51, "kind": "global adjustment", "note": ""},
             {"frame": 55, "kind": "loop", "note": "frame 55 sees the place of frame 3 again: all",
              "matched_frame": 4, "T_matched_keyframe": [5, 0, 0, 0, 0, 0, 1]},
             {"frame": 56, "kind": "loop", "note": "nothing is named"}])");
  const auto rows = PopulationRows(OfDevelopKitchen(Read()));
  EXPECT_EQ(Find(rows, "all", "dm")->loops, 3u);
  EXPECT_EQ(Find(rows, "all", "dm")->false_loops, 1u);
  EXPECT_EQ(Find(rows, "all", "dm")->unknown_loops, 1u);
}

TEST_F(PopulationFolder, TheReportHalfShowsNoSingleSequence) {
  for (const char* name : {"few", "many", "secret", "drawn"}) AddRun("dm", name, 0.001);
  const auto runs = Read();
  EXPECT_EQ(PopulationMarkdown(runs, false).find("secret"), std::string::npos);
  EXPECT_EQ(PopulationJson(runs, false).find("secret"), std::string::npos);
  EXPECT_NE(PopulationMarkdown(runs, true).find("secret"), std::string::npos);
  EXPECT_NE(PopulationJson(runs, true).find("secret"), std::string::npos);
  EXPECT_NE(PopulationMarkdown(runs, false).find("composited, report half"), std::string::npos);
  const auto json = nlohmann::json::parse(PopulationJson(runs, false));
  EXPECT_EQ(json.size(), 3u);
  EXPECT_EQ(json[0]["runs"].size(), 4u);
}

TEST_F(PopulationFolder, TablesAreEven) {
  for (const char* name : {"few", "many", "secret", "drawn"}) AddRun("dm", name, 0.02);
  ExpectEvenTables(PopulationMarkdown(Read(), true));
}

TEST_F(PopulationFolder, DamageIsNamed) {
  const auto says = [](const auto& action, const std::string& part) {
    try {
      action();
      ADD_FAILURE() << "nothing was refused";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  says([] { ParsePopulationSystem("dm"); }, "NAME=FOLDER");
  std::ofstream(root_ / "bad") << "develop\tx\tcomposited\n";
  says([&] { ReadPopulation(root_ / "bad"); }, "bad:1");
  std::ofstream(root_ / "bad") << "develop\tx\tpainted\t/\n";
  says([&] { ReadPopulation(root_ / "bad"); }, "painted");
  std::ofstream(root_ / "sequences/few/coverage.txt") << "0.1\nnothing\n";
  says([&] { Read(); }, "coverage.txt:2");
  std::ofstream(root_ / "sequences/few/coverage.txt") << "0.1\n";
  says([&] { Read(); }, "few");
}

}  // namespace
}  // namespace dmslam
