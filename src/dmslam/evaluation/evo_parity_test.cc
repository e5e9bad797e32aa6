// Equality with what the `evo` package computes on real trajectories (trajectories/expected.json of the data
// folder).
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "dmslam/evaluation/ate.h"
#include "dmslam/evaluation/rpe.h"

namespace dmslam {
namespace {

// expected.json gives nine decimals, so a figure may be off by half of the last one.
constexpr double kRelative = 1e-6;
constexpr double kRounding = 0.5001e-9;

std::filesystem::path TrajectoryFolder() {
  const char* data = std::getenv("DMSLAM_DATA");
  if (data != nullptr) return std::filesystem::path(data) / "trajectories";
  const char* source = std::getenv("DMSLAM_SOURCE_DIR");
  return std::filesystem::path(source != nullptr ? source : ".") / ".." / "shared" / "data" / "trajectories";
}

double Value(const Statistics& statistics, const std::string& name) {
  if (name == "rmse") return statistics.rmse;
  if (name == "mean") return statistics.mean;
  if (name == "median") return statistics.median;
  if (name == "std") return statistics.std;
  if (name == "min") return statistics.min;
  if (name == "max") return statistics.max;
  if (name == "sse") return statistics.sse;
  ADD_FAILURE() << "expected.json asks for an unknown statistic '" << name << "'";
  return 0;
}

void ExpectEqual(double found, double wanted, const std::string& what) {
  EXPECT_LE(std::abs(found - wanted), kRelative * std::abs(wanted) + kRounding)
      << what << ": " << found << ", evo has " << wanted;
}

// Compares every figure of one entry; returns how many there were.
int CompareFigures(const nlohmann::json& entry, const Statistics& statistics, double scale,
                   const std::string& what) {
  int compared = 0;
  for (const auto& [name, wanted] : entry.items()) {
    ExpectEqual(name == "scale" ? scale : Value(statistics, name), wanted.get<double>(), what + "." + name);
    ++compared;
  }
  return compared;
}

int CompareTrajectory(const std::string& name, const nlohmann::json& expected) {
  const auto folder = TrajectoryFolder();
  const auto ground_truth =
      ReadGroundTruth((folder / expected["ground_truth"].get<std::string>()).string()).poses;
  const auto estimate = ReadTrajectory((folder / expected["estimate"].get<std::string>()).string());
  int compared = 0;
  for (const auto& [key, entry] : expected.items()) {
    if (key == "ground_truth" || key == "estimate") continue;
    const std::string what = name + "." + key;
    const Alignment alignment = key.ends_with("se3") ? Alignment::kSe3 : Alignment::kSim3;
    const AteReport ate = EvaluateAte(ground_truth, estimate, {alignment, 20'000'000});
    RpeOptions rpe_options;
    rpe_options.alignment = alignment;
    const RpeReport rpe = EvaluateRpe(ground_truth, estimate, rpe_options);
    if (key == "pairs") {
      EXPECT_EQ(ate.pairs.size(), entry.get<size_t>()) << what;
      ++compared;
    } else if (key.starts_with("ate_")) {
      compared += CompareFigures(entry, ate.statistics, ate.scale(), what);
    } else if (key.starts_with("rpe_1frame_trans_")) {
      compared += CompareFigures(entry, rpe.translation, 0, what);
    } else if (key.starts_with("rpe_1frame_rot_deg_")) {
      compared += CompareFigures(entry, rpe.rotation_deg, 0, what);
    } else {
      ADD_FAILURE() << "expected.json has an entry this test does not know: " << what;
    }
  }
  return compared;
}

TEST(EvoParity, EveryEntryOfExpectedJson) {
  const auto path = TrajectoryFolder() / "expected.json";
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "no " << path << "; set DMSLAM_DATA to the data folder to compare with evo";
  }
  const nlohmann::json expected = nlohmann::json::parse(std::ifstream(path));
  ASSERT_GE(expected.size(), 5u);
  int compared = 0;
  for (const auto& [name, entry] : expected.items()) compared += CompareTrajectory(name, entry);
  EXPECT_GE(compared, 5 * (1 + 2 * (8 + 7 + 7)));
  RecordProperty("figures_compared", compared);
}

}  // namespace
}  // namespace dmslam
