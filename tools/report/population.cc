#include "population.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "dmslam/dataset/text_table.h"
#include "dmslam/evaluation/coverage.h"
#include "dmslam/evaluation/statistics.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using State = PopulationRun::State;

constexpr double kNever = std::numeric_limits<double>::infinity();

/// A sequence and what is true of it.
struct Truth {
  std::vector<StampedPose> poses;
  std::vector<int64_t> frame_stamps_ns;
  std::vector<double> covered_shares;  // empty: nobody is there
};

std::vector<double> ReadShares(const fs::path& path) {
  std::vector<double> shares;
  if (!fs::exists(path)) return shares;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    char* end = nullptr;
    const double share = std::strtod(line.c_str(), &end);
    if (end == line.c_str() || !(share >= 0 && share <= 1)) {
      throw InputError(FileLine(path.string(), shares.size() + 1) + ": '" + line +
                       "' is no share of the image; write 0 to 1, one line per frame");
    }
    shares.push_back(share);
  }
  return shares;
}

Truth ReadTruth(const PopulationSequence& sequence) {
  Truth truth;
  truth.poses = ReadGroundTruth((sequence.folder / "groundtruth.txt").string()).poses;
  truth.frame_stamps_ns = ReadFrameStamps((sequence.folder / "rgb.txt").string());
  truth.covered_shares = ReadShares(sequence.folder / "coverage.txt");
  return truth;
}

/// Empty where the file is not there or holds no pose.
std::vector<StampedPose> TrajectoryIn(const fs::path& path) {
  if (!fs::exists(path)) return {};
  try {
    return ReadTrajectory(path.string());
  } catch (const InputError&) {
    return {};
  }
}

/// The other keyframe's frame where a summary does not name it: as the loop closer's note has it.
std::optional<size_t> MatchedFrameInNote(const std::string& note) {
  constexpr const char* kBefore = "sees the place of frame ";
  const size_t at = note.find(kBefore);
  if (at == std::string::npos) return std::nullopt;
  char* end = nullptr;
  const char* begin = note.c_str() + at + std::char_traits<char>::length(kBefore);
  const unsigned long frame = std::strtoul(begin, &end, 10);
  return end == begin ? std::nullopt : std::optional<size_t>(frame);
}

std::optional<Rigid3d> RelativePoseIn(const Json& correction) {
  const auto found = correction.find("T_matched_keyframe");
  if (found == correction.end() || !found->is_array() || found->size() != 7) return std::nullopt;
  std::array<double, 7> v{};
  for (size_t i = 0; i < 7; ++i) v[i] = (*found)[i].get<double>();
  return Rigid3d(Eigen::Quaterniond(v[6], v[3], v[4], v[5]).normalized(), {v[0], v[1], v[2]});
}

std::vector<ClosedLoop> LoopsIn(const Json& summary, const std::vector<int64_t>& frame_stamps_ns) {
  std::vector<ClosedLoop> loops;
  const Json corrections = summary.value("loop_closing", Json::object()).value("corrections", Json::array());
  const auto stamp_of = [&](std::optional<size_t> frame) -> std::optional<int64_t> {
    if (!frame || *frame >= frame_stamps_ns.size()) return std::nullopt;
    return frame_stamps_ns[*frame];
  };
  for (const Json& correction : corrections) {
    if (correction.value("kind", "") != "loop") continue;
    std::optional<size_t> matched = MatchedFrameInNote(correction.value("note", ""));
    if (correction.contains("matched_frame")) matched = correction["matched_frame"].get<size_t>();
    loops.push_back(
        {stamp_of(correction.value("frame", SIZE_MAX)), stamp_of(matched), RelativePoseIn(correction)});
  }
  return loops;
}

/// The keyframes' poses, and where a keyframe is gone its frame's.
std::vector<StampedPose> KeyframesOr(std::vector<StampedPose> keyframes,
                                     const std::vector<StampedPose>& frames) {
  std::map<int64_t, StampedPose> by_stamp;
  for (const StampedPose& pose : frames) by_stamp[pose.stamp_ns] = pose;
  for (const StampedPose& pose : keyframes) by_stamp[pose.stamp_ns] = pose;
  keyframes.clear();
  for (const auto& [stamp_ns, pose] : by_stamp) keyframes.push_back(pose);
  return keyframes;
}

RunVerdict Judge(const Truth& truth, const fs::path& folder, const Json& summary,
                 const VerdictLimits& limits) {
  const auto final = TrajectoryIn(folder / "trajectory.txt");
  const auto online = TrajectoryIn(folder / "trajectory_online.txt");
  const auto keyframes = KeyframesOr(TrajectoryIn(folder / "keyframes.txt"), final);
  const auto loops = LoopsIn(summary, truth.frame_stamps_ns);
  return JudgeRun({truth.poses, final, online, keyframes, truth.frame_stamps_ns, truth.covered_shares, loops},
                  limits);
}

std::string FirstLineOf(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

PopulationRun ReadOne(const PopulationSequence& sequence, const Truth& truth,
                      const PopulationSystem& system) {
  PopulationRun run;
  run.sequence = sequence;
  run.system = system.name;
  run.path_m = PathLength(truth.poses);
  const VerdictLimits limits = sequence.kind == "rendered" ? LimitsForPath(run.path_m) : VerdictLimits();
  if (!truth.covered_shares.empty())
    run.max_covered_share = *std::max_element(truth.covered_shares.begin(), truth.covered_shares.end());
  run.verdict = JudgeRun({truth.poses, {}, {}, {}, truth.frame_stamps_ns, truth.covered_shares, {}}, limits);
  run.mean_covered_share = run.verdict.mean_covered_share;
  const fs::path folder = system.runs / sequence.name;
  if (fs::exists(folder / "failed.txt")) {
    run.state = State::kFailed;
    run.reason = FirstLineOf(folder / "failed.txt");
    return run;
  }
  if (!fs::exists(folder / "summary.json")) return run;
  const Json summary = Json::parse(ReadTextFile((folder / "summary.json").string()), nullptr, false);
  if (!summary.is_object()) {
    run.state = State::kFailed;
    run.reason = (folder / "summary.json").string() + ": is not JSON; remove its folder and run it again";
    return run;
  }
  run.state = State::kDone;
  run.version = summary.value("version", "");
  run.verdict = Judge(truth, folder, summary, limits);
  return run;
}

/// Of many runs the middle one and the worst; what is missing counts as infinite.
MedianAndWorst Collect(const std::vector<const PopulationRun*>& runs,
                       const std::function<std::optional<double>(const PopulationRun&)>& number) {
  std::vector<double> values;
  for (const PopulationRun* run : runs) values.push_back(number(*run).value_or(kNever));
  if (values.empty()) return {kNever, kNever};
  std::sort(values.begin(), values.end());
  const size_t middle = values.size() / 2;
  const bool even = values.size() % 2 == 0;
  return {even ? 0.5 * (values[middle - 1] + values[middle]) : values[middle], values.back()};
}

PopulationRow RowOf(const std::string& title, const std::string& system,
                    const std::vector<const PopulationRun*>& all) {
  PopulationRow row;
  row.title = title;
  row.system = system;
  std::vector<const PopulationRun*> runs;
  for (const PopulationRun* run : all) {
    if (run->state == State::kMissing) {
      ++row.missing;
    } else {
      runs.push_back(run);
    }
  }
  row.sequences = runs.size();
  const auto ate = [](std::optional<double> ate_m, const PopulationRun& run) -> std::optional<double> {
    if (!ate_m) return std::nullopt;
    return *ate_m / run.AteUnit();
  };
  row.online_ate = Collect(runs, [&](const auto& run) { return ate(run.verdict.online_ate_m, run); });
  row.final_ate = Collect(runs, [&](const auto& run) { return ate(run.verdict.final_ate_m, run); });
  row.wrong_poses_s = Collect(runs, [](const auto& run) { return std::optional(run.verdict.wrong_poses_s); });
  row.first_map_s = Collect(runs, [](const auto& run) { return run.verdict.first_map_s; });
  for (const PopulationRun* run : runs) {
    const RunVerdict& verdict = run->verdict;
    row.loops += verdict.loops;
    row.false_loops += verdict.false_loops;
    row.unknown_loops += verdict.unknown_loops;
    row.wrong_first_maps += verdict.wrong_first_map ? 1 : 0;
    if (!verdict.success()) continue;
    ++row.successes;
    row.most_wrong_poses_in_success_s = std::max(row.most_wrong_poses_in_success_s, verdict.wrong_poses_s);
  }
  return row;
}

std::vector<std::string> SystemsOf(const std::vector<PopulationRun>& runs) {
  std::vector<std::string> systems;
  for (const PopulationRun& run : runs) {
    if (std::find(systems.begin(), systems.end(), run.system) == systems.end()) systems.push_back(run.system);
  }
  return systems;
}

}  // namespace

const std::vector<CoverageClass>& CoverageClasses() {
  static const std::vector<CoverageClass> classes = {{0.0, 0.1, "below 10 %"},
                                                     {0.1, 0.4, "10 to 40 %"},
                                                     {0.4, 0.6, "40 to 60 %"},
                                                     {0.6, 1.1, "60 % and more"}};
  return classes;
}

std::vector<PopulationSequence> ReadPopulation(const fs::path& list) {
  std::vector<PopulationSequence> sequences;
  std::set<std::string> names;
  ForEachRow(ReadTextFile(list.string()), "\t", [&](size_t line, std::span<const std::string_view> fields) {
    const std::string where = FileLine(list.string(), line);
    if (fields.size() != 4)
      throw InputError(where + ": write half, name, kind and folder, separated by tabs");
    PopulationSequence sequence{std::string(fields[0]), std::string(fields[1]), std::string(fields[2]),
                                fs::path(std::string(fields[3]))};
    if (sequence.kind != "composited" && sequence.kind != "rendered")
      throw InputError(where + ": kind '" + sequence.kind + "'; write composited or rendered");
    if (!names.insert(sequence.name).second)
      throw InputError(where + ": " + sequence.name + " is listed twice; give it another name");
    sequences.push_back(std::move(sequence));
  });
  if (sequences.empty()) throw InputError(list.string() + ": lists no sequence");
  return sequences;
}

PopulationSystem ParsePopulationSystem(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw InputError("--runs " + text + ": write NAME=FOLDER");
  return {text.substr(0, equals), text.substr(equals + 1)};
}

std::vector<PopulationRun> ReadPopulationRuns(const std::vector<PopulationSequence>& sequences,
                                              const std::vector<PopulationSystem>& systems) {
  std::vector<PopulationRun> runs;
  for (const PopulationSequence& sequence : sequences) {
    if (!fs::exists(sequence.folder / "rgb.txt")) continue;
    const Truth truth = ReadTruth(sequence);
    try {
      for (const PopulationSystem& system : systems) runs.push_back(ReadOne(sequence, truth, system));
    } catch (const InputError& error) {
      throw InputError(sequence.folder.string() + ": " + error.what());
    }
  }
  return runs;
}

std::vector<PopulationRow> PopulationRows(const std::vector<PopulationRun>& runs) {
  std::vector<PopulationRow> rows;
  const auto add = [&](const CoverageClass& coverage) {
    for (const std::string& system : SystemsOf(runs)) {
      std::vector<const PopulationRun*> chosen;
      for (const PopulationRun& run : runs) {
        const bool inside = run.mean_covered_share >= coverage.from && run.mean_covered_share < coverage.to;
        if (inside && run.system == system) chosen.push_back(&run);
      }
      if (!chosen.empty()) rows.push_back(RowOf(coverage.title, system, chosen));
    }
  };
  for (const CoverageClass& coverage : CoverageClasses()) add(coverage);
  add({0.0, 1.1, "all"});
  return rows;
}

}  // namespace dmslam
