#include "sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "dmslam/util/check.h"
#include "testing/even_tables.h"
#include "testing/wavy_path.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

/// A sweep's folder with two rendered sequences and one of the ablation's.
class SweepFolder : public ::testing::Test {
 protected:
  SweepFolder() {
    root_ = fs::temp_directory_path() /
            (std::string("dmslam_sweep_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(root_);
    for (const char* name : {"out/sequences/synth_0", "out/sequences/synth_walk_30", "data/kitchen_walk1"}) {
      fs::create_directories(root_ / name);
      WriteTrajectory((root_ / name / "groundtruth.txt").string(), WavyPath(60, 0, 1));
      std::ofstream list(root_ / name / "rgb.txt");
      for (const StampedPose& pose : WavyPath(60, 0, 1)) list << FormatPose(pose).substr(0, 8) << " a.png\n";
      std::ofstream(root_ / name / "synthetic.json")
          << R"({"mean_coverage": 0.301, "mean_moving_coverage": 0.25})";
    }
  }
  void TearDown() override { fs::remove_all(root_); }

  fs::path Write(const RunKey& key, double noise, double tracked_percent) {
    fs::path folder = root_ / "out" / key.Folder();
    fs::create_directories(folder);
    std::ofstream(folder / "summary.json") << "{\"tracked_percent\": " << tracked_percent << "}";
    if (noise > 0)
      WriteTrajectory((folder / "trajectory.txt").string(),
                      WavyPath(60, noise, static_cast<uint64_t>(key.seed)));
    return folder;
  }
  Sweep Read() const { return ReadSweep(root_ / "out", root_ / "data", 3); }

  fs::path root_;
};

TEST_F(SweepFolder, ReadsWhatIsThere) {
  Write({"synth_walk_30", "sweep", "dm", 1}, 0.01, 90);
  Write({"synth_walk_30", "sweep", "dm", 2}, -1, 0);
  const Sweep sweep = Read();
  ASSERT_EQ(sweep.points.size(), 3u);  // nobody there stands in both tables
  const SweepPoint& point = sweep.points[1];
  EXPECT_EQ(point.share_percent, 30);
  EXPECT_NEAR(point.coverage_percent, 30.1, 1e-9);
  EXPECT_NEAR(point.moving_percent, 25, 1e-9);
  EXPECT_EQ(point.dm.Count(RunResult::State::kDone), 1u);
  EXPECT_EQ(point.dm.Count(RunResult::State::kNoTrajectory), 1u);
  EXPECT_EQ(point.dm.Count(RunResult::State::kMissing), 1u);
  EXPECT_EQ(point.baseline.Count(RunResult::State::kMissing), 3u);
  EXPECT_TRUE(sweep.ablation.empty());
}

TEST_F(SweepFolder, TablesAreEvenAndSayHowManyRuns) {
  Write({"synth_0", "sweep", "dm", 1}, 0.01, 98);
  Write({"synth_0", "sweep", "dm", 2}, 0.03, 96);
  const fs::path judged = Write({"kitchen_walk1", "no_belief", "dm", 1}, 0.02, 91);
  std::ofstream(judged / "map.json") << R"({"on_people_percent": 3.25})";
  const std::string text = SweepMarkdown(Read(), "picture.png");
  for (const char* part : {"3 of 33 runs", "(3 seeds)", "| 2/2 |", "97.0 (96.0–98.0)", "| 3.25 |", "not run",
                           "(picture.png)", "`tracking.motion_belief=off`"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in\n" << text;
  }
  ExpectEvenTables(text);
}

TEST_F(SweepFolder, ReadsAllSharesThatAreRendered) {
  fs::rename(root_ / "out/sequences/synth_walk_30", root_ / "out/sequences/synth_walk_80");
  Write({"synth_walk_80", "sweep", "dm", 1}, 0.01, 90);
  const Sweep sweep = Read();
  const auto counted = [](const SweepPoint& point) { return point.dm.Count(RunResult::State::kDone) == 1; };
  EXPECT_EQ(std::ranges::count_if(sweep.points, counted), 1);
}

TEST_F(SweepFolder, FigureHasBandsOverTheSeeds) {
  Write({"synth_walk_30", "sweep", "dm", 1}, 0.01, 90);
  Write({"synth_walk_30", "sweep", "dm", 2}, 0.01, 70);
  Write({"synth_walk_30", "sweep", "dm", 3}, -1, 0);
  const PlotFigure figure = SweepFigure(Read());
  ASSERT_EQ(figure.panels.size(), 4u);
  const PlotSeries& tracked = figure.panels[2].series[0];
  ASSERT_EQ(tracked.x.size(), 2u);
  EXPECT_TRUE(std::isnan(tracked.y[0]));
  EXPECT_EQ(tracked.y[1], 70);
  EXPECT_EQ(tracked.y_low[1], 0);  // no trajectory: nothing tracked
  EXPECT_EQ(tracked.y_high[1], 90);
  EXPECT_FALSE(std::isnan(figure.panels[0].series[0].y[1]));
}

TEST_F(SweepFolder, DamageIsNamed) {
  std::ofstream(root_ / "out/sequences/synth_0/synthetic.json") << "{}";
  try {
    Read();
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("synthetic.json"), std::string::npos);
  }
}

TEST(ReplaceBetweenMarks, KeepsTheRestOfThePage) {
  const std::string begin = "<!-- written by scripts/sweep.sh -->",
                    end = "<!-- end of what scripts/sweep.sh writes -->";
  const std::string page = "# Title\n" + begin + "\nold\n" + end + "\nrest\n";
  const std::string once = ReplaceBetweenMarks(page, "new\n");
  EXPECT_EQ(once, "# Title\n" + begin + "\n\nnew\n" + end + "\nrest\n");
  EXPECT_EQ(ReplaceBetweenMarks(once, "new\n"), once);
  EXPECT_THROW(ReplaceBetweenMarks("# Title\n", "new\n"), InputError);
  EXPECT_THROW(ReplaceBetweenMarks(end + begin, "new\n"), InputError);
}

}  // namespace
}  // namespace dmslam
