#include "results.h"

#include <algorithm>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "dmslam/dataset/text_table.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using State = RunResult::State;

std::optional<double> NumberIn(const Json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

std::optional<std::string> TextIn(const Json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_string()) return std::nullopt;
  return found->get<std::string>();
}

std::optional<Machine> MachineIn(const Json& summary) {
  const auto found = summary.find("machine");
  if (found == summary.end() || !found->is_object()) return std::nullopt;
  const auto cpu = TextIn(*found, "cpu");
  const auto cores = NumberIn(*found, "cores");
  if (!cpu || !cores) return std::nullopt;
  return Machine{*cpu, static_cast<int>(*cores)};
}

// In the end nothing; as it came, what it says, or nothing.
void TrackedNothing(RunResult* run) {
  run->tracked_percent = 0;
  run->tracked_online_percent = run->tracked_online_percent.value_or(0);
  run->tracked_online_after_first_map_percent = run->tracked_online_after_first_map_percent.value_or(0);
}

RunResult Failed(RunResult run, const std::string& reason) {
  run.state = State::kFailed;
  run.reason = reason;
  TrackedNothing(&run);
  return run;
}

// Nothing where it is no JSON object, as where only half of it was written.
std::optional<Json> ReadSummary(const fs::path& path) {
  Json summary = Json::parse(ReadTextFile(path.string()), nullptr, false);
  if (summary.is_discarded() || !summary.is_object()) return std::nullopt;
  return summary;
}

// Of the frames since the first pose, how many have one. Throws InputError where the file is none.
std::optional<double> OnlineAfterFirstMap(const fs::path& online, const fs::path& sequence) {
  const std::vector<StampedPose> poses = ReadTrajectory(online.string());
  std::vector<int64_t> frames_ns = ReadFrameStamps((sequence / "rgb.txt").string());
  std::erase_if(frames_ns, [&](int64_t stamp_ns) { return stamp_ns < poses.front().stamp_ns; });
  if (frames_ns.empty()) return std::nullopt;
  return ComputeCoverage(poses, frames_ns).percent;
}

EvaluationOptions ReportOptions() {
  EvaluationOptions options;
  options.rpe.resize(2);
  options.rpe[1].unit = RpeUnit::kSeconds;
  return options;
}

// A run whose final trajectory is good is done, whatever its trajectory as it came looks like.
void ReadOnlineTrajectory(const fs::path& folder, const fs::path& sequence, RunResult* run) {
  const fs::path online = folder / "trajectory_online.txt";
  if (run->tracked_online_after_first_map_percent || !fs::exists(online)) return;
  try {
    run->tracked_online_after_first_map_percent = OnlineAfterFirstMap(online, sequence);
  } catch (const InputError& error) {
    run->reason = error.what();
  }
}

void ReadTrajectoryOf(const fs::path& folder, const fs::path& sequence, RunResult* run) {
  const fs::path trajectory = folder / "trajectory.txt";
  try {
    const std::vector<StampedPose> estimate = ReadTrajectory(trajectory.string());
    const GroundTruth truth = ReadGroundTruth((sequence / "groundtruth.txt").string());
    const auto frames_ns = ReadFrameStamps((sequence / "rgb.txt").string());
    Evaluation evaluation =
        Evaluate(truth.poses, estimate, ReportOptions(), ComputeCoverage(estimate, frames_ns));
    if (!evaluation.ate.usable()) {
      run->reason = evaluation.ate.reason;
      return;
    }
    ReadOnlineTrajectory(folder, sequence, run);
    if (!run->tracked_percent) run->tracked_percent = evaluation.coverage.percent;
    run->evaluation = std::move(evaluation);
    run->state = State::kDone;
  } catch (const InputError& error) {
    run->reason = error.what();
  }
}

std::string FirstLine(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

std::optional<Spread> Collect(const std::vector<RunResult>& runs,
                              const std::function<std::optional<double>(const RunResult&)>& number) {
  std::vector<double> values;
  for (const RunResult& run : runs) {
    if (const std::optional<double> value = number(run)) values.push_back(*value);
  }
  return SpreadOf(std::move(values));
}

std::optional<Spread> CollectStatistic(const Cell& cell, Metric metric, double Statistics::*field) {
  return Collect(cell.runs, [&](const RunResult& run) -> std::optional<double> {
    const auto statistics = MetricOf(run, metric);
    if (!statistics) return std::nullopt;
    return (*statistics).*field;
  });
}

}  // namespace

RunResult ReadRun(const RunKey& key, const fs::path& out, const fs::path& sequence) {
  RunResult run;
  run.key = key;
  const fs::path folder = out / key.Folder();
  if (fs::exists(folder / "failed.txt")) return Failed(run, FirstLine(folder / "failed.txt"));
  const fs::path summary_path = folder / "summary.json";
  if (!fs::exists(summary_path)) {
    run.reason = "not run yet";
    return run;
  }
  const std::optional<Json> summary = ReadSummary(summary_path);
  if (!summary) return Failed(run, summary_path.string() + ": is not JSON; the same command runs it again");
  run.state = State::kNoTrajectory;
  run.version = TextIn(*summary, "version");
  run.machine = MachineIn(*summary);
  run.tracked_percent = NumberIn(*summary, "tracked_percent");
  run.tracked_online_percent = NumberIn(*summary, "tracked_online_percent");
  run.ate_online_m = NumberIn(*summary, "ate_rmse_online");
  run.tracked_online_after_first_map_percent = NumberIn(*summary, "tracked_online_after_first_map_percent");
  run.first_map_s = NumberIn(*summary, "first_init_s");
  run.frontend_ms_median = NumberIn(*summary, "frontend_ms_median");
  ReadTrajectoryOf(folder, sequence, &run);
  if (run.state == State::kNoTrajectory) TrackedNothing(&run);
  return run;
}

bool IsDone(const RunKey& key, const fs::path& out) {
  const fs::path folder = out / key.Folder();
  return !fs::exists(folder / "failed.txt") && fs::exists(folder / "summary.json") &&
         ReadSummary(folder / "summary.json").has_value();
}

std::optional<Statistics> MetricOf(const RunResult& run, Metric metric) {
  if (!run.evaluation) return std::nullopt;
  const Evaluation& evaluation = *run.evaluation;
  const auto rpe = [&](size_t index, bool rotation) -> std::optional<Statistics> {
    const RpeReport& report = evaluation.rpe[index];
    if (!report.usable()) return std::nullopt;
    return rotation ? report.rotation_deg : report.translation;
  };
  switch (metric) {
    case Metric::kAte:
      return evaluation.ate.statistics;
    case Metric::kRpeTranslationPerFrame:
      return rpe(0, false);
    case Metric::kRpeTranslationPerSecond:
      return rpe(1, false);
    case Metric::kRpeRotationPerFrame:
      return rpe(0, true);
    case Metric::kRpeRotationPerSecond:
      return rpe(1, true);
  }
  return std::nullopt;
}

std::optional<Spread> SpreadOf(std::vector<double> values) {
  if (values.empty()) return std::nullopt;
  const auto [min, max] = std::minmax_element(values.begin(), values.end());
  return Spread{Median(values), *min, *max, values.size()};
}

size_t Cell::Count(State state) const {
  return static_cast<size_t>(
      std::count_if(runs.begin(), runs.end(), [&](const RunResult& run) { return run.state == state; }));
}

size_t Cell::Failed() const { return Count(State::kFailed) + Count(State::kNoTrajectory); }
size_t Cell::Made() const { return runs.size() - Count(State::kMissing); }

std::optional<Spread> Cell::Rmse(Metric metric) const {
  return CollectStatistic(*this, metric, &Statistics::rmse);
}
std::optional<Spread> Cell::Mean(Metric metric) const {
  return CollectStatistic(*this, metric, &Statistics::mean);
}
std::optional<Spread> Cell::Median(Metric metric) const {
  return CollectStatistic(*this, metric, &Statistics::median);
}
std::optional<Spread> Cell::Std(Metric metric) const {
  return CollectStatistic(*this, metric, &Statistics::std);
}

std::optional<Spread> Cell::TrackedPercent() const {
  return Collect(runs, [](const RunResult& run) { return run.tracked_percent; });
}
std::optional<Spread> Cell::TrackedOnlinePercent() const {
  return Collect(runs, [](const RunResult& run) { return run.tracked_online_percent; });
}
std::optional<Spread> Cell::AteOnline() const {
  return Collect(runs, [](const RunResult& run) { return run.ate_online_m; });
}
std::optional<Spread> Cell::TrackedOnlineAfterFirstMapPercent() const {
  return Collect(runs, [](const RunResult& run) { return run.tracked_online_after_first_map_percent; });
}
std::optional<Spread> Cell::FirstMapSeconds() const {
  return Collect(runs, [](const RunResult& run) { return run.first_map_s; });
}

const RunResult* Cell::MedianRun() const {
  std::vector<const RunResult*> with_trajectory;
  for (const RunResult& run : runs) {
    if (run.evaluation) with_trajectory.push_back(&run);
  }
  if (with_trajectory.empty()) return nullptr;
  std::stable_sort(with_trajectory.begin(), with_trajectory.end(),
                   [](const RunResult* a, const RunResult* b) {
                     return a->evaluation->ate.rmse() < b->evaluation->ate.rmse();
                   });
  return with_trajectory[(with_trajectory.size() - 1) / 2];
}

const Cell* Results::Find(const std::string& sequence, const std::string& setting,
                          const std::string& profile) const {
  for (const Cell& cell : cells) {
    if (cell.sequence == sequence && cell.setting == setting && cell.profile == profile) return &cell;
  }
  return nullptr;
}

Results ReadResults(const Plan& plan, const fs::path& out) {
  Results results;
  results.plan = plan;
  for (const PlannedSequence& sequence : plan.sequences) {
    if (!sequence.present()) continue;
    for (const Setting& setting : plan.settings) {
      for (const std::string& profile : plan.profiles) {
        Cell cell{std::string(sequence.info.name), setting.name, profile, {}};
        for (int seed = 1; seed <= plan.seeds; ++seed) {
          cell.runs.push_back(
              ReadRun({cell.sequence, cell.setting, cell.profile, seed}, out, sequence.folder));
        }
        results.cells.push_back(std::move(cell));
      }
    }
  }
  return results;
}

}  // namespace dmslam
