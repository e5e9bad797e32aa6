#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/evaluation/report.h"
#include "dmslam/util/machine.h"
#include "plan.h"

namespace dmslam {

/// What one run gave.
struct RunResult {
  RunKey key;
  enum class State { kMissing, kFailed, kNoTrajectory, kDone } state = State::kMissing;
  std::string reason;  // where it is not kDone, or where not all of it could be read
  // From its summary.json; nothing where it does not say.
  std::optional<std::string> version;  // of the programs that made it
  std::optional<Machine> machine;      // on which it was made
  std::optional<double> tracked_percent;
  std::optional<double> tracked_online_percent;
  std::optional<double> ate_online_m;  // RMSE over the poses as they came, aligned by Sim3
  std::optional<double> first_map_s;
  std::optional<double> frontend_ms_median;
  // Frames tracked as they came, of those since the first pose.
  std::optional<double> tracked_online_after_first_map_percent;
  // Of its trajectory against the ground truth, aligned by Sim3: ATE, RPE per frame, RPE per second.
  std::optional<Evaluation> evaluation;
};

/// Reads the result of a run from its folder. `sequence` is the sequence's folder (ground truth, image list).
/// What failed or gave no trajectory has tracked nothing: its shares are 0, so that no median passes over it.
RunResult ReadRun(const RunKey& key, const std::filesystem::path& out, const std::filesystem::path& sequence);

/// Whether it needs no run any more: it did not fail, and its summary.json is whole.
bool IsDone(const RunKey& key, const std::filesystem::path& out);

/// The errors that the tables show.
enum class Metric {
  kAte,
  kRpeTranslationPerFrame,
  kRpeTranslationPerSecond,
  kRpeRotationPerFrame,
  kRpeRotationPerSecond
};

/// The statistics of one error of one run; nothing where it has none.
std::optional<Statistics> MetricOf(const RunResult& run, Metric metric);

/// Middle and ends of one number over the seeds.
struct Spread {
  double median = 0;
  double min = 0;
  double max = 0;
  size_t count = 0;
};
std::optional<Spread> SpreadOf(std::vector<double> values);

/// All seeds of one sequence under one setting and profile.
struct Cell {
  std::string sequence;
  std::string setting;
  std::string profile;
  std::vector<RunResult> runs;

  size_t Count(RunResult::State state) const;
  /// Runs that failed or gave no trajectory; and runs that were made, these among them.
  size_t Failed() const;
  size_t Made() const;
  /// Medians over the seeds of a metric's RMSE, mean, median, S.D.; and the spread of the RMSE.
  std::optional<Spread> Rmse(Metric metric) const;
  std::optional<Spread> Mean(Metric metric) const;
  std::optional<Spread> Median(Metric metric) const;
  std::optional<Spread> Std(Metric metric) const;
  std::optional<Spread> TrackedPercent() const;
  std::optional<Spread> TrackedOnlinePercent() const;
  std::optional<Spread> AteOnline() const;
  std::optional<Spread> TrackedOnlineAfterFirstMapPercent() const;
  std::optional<Spread> FirstMapSeconds() const;
  /// The run whose ATE is the (lower) middle one; null where none has a trajectory.
  const RunResult* MedianRun() const;
};

/// Everything that has been run so far.
struct Results {
  Plan plan;
  std::vector<Cell> cells;

  const Cell* Find(const std::string& sequence, const std::string& setting, const std::string& profile) const;
};
Results ReadResults(const Plan& plan, const std::filesystem::path& out);

}  // namespace dmslam
