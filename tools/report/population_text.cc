#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "dmslam/util/format.h"
#include "population.h"

namespace dmslam {
namespace {

using OrderedJson = nlohmann::ordered_json;
using State = PopulationRun::State;

constexpr const char* kNone = "–";

std::string Number(double value, int decimals) {
  return std::isfinite(value) ? Format("%.*f", decimals, value) : kNone;
}
std::string Number(const std::optional<double>& value, int decimals) {
  return value ? Number(*value, decimals) : kNone;
}
std::string Number(const MedianAndWorst& numbers, int decimals) {
  return Number(numbers.median, decimals) + " / " + Number(numbers.worst, decimals);
}

int AteDecimals(bool rendered) { return rendered ? 2 : 4; }

std::string FalseLoops(size_t false_loops, size_t loops, size_t unknown) {
  std::string text = Format("%zu / %zu", false_loops, loops);
  if (unknown > 0) text += Format(" (%zu unknown)", unknown);
  return text;
}

std::string SummaryTable(const std::vector<PopulationRun>& runs, bool rendered) {
  const char* unit = rendered ? "% of the path" : "m";
  std::string text = Format(
      "| covered | system | succeed | ATE online [%s] | ATE final [%s] | wrong poses [s] | most in a success "
      "[s] | "
      "false loops / all | wrong first maps | first map [s] "
      "|\n|---|---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
      unit, unit);
  for (const PopulationRow& row : PopulationRows(runs)) {
    const double percent =
        row.sequences == 0 ? 0
                           : 100.0 * static_cast<double>(row.successes) / static_cast<double>(row.sequences);
    text += Format("| %s | %s | %zu of %zu (%.0f %%)", row.title.c_str(), row.system.c_str(), row.successes,
                   row.sequences, percent);
    if (row.missing > 0) text += Format("; %zu not run", row.missing);
    text += " | " + Number(row.online_ate, AteDecimals(rendered)) + " | " +
            Number(row.final_ate, AteDecimals(rendered)) + " | " + Number(row.wrong_poses_s, 1) + " | " +
            Number(row.most_wrong_poses_in_success_s, 1) + " | " +
            FalseLoops(row.false_loops, row.loops, row.unknown_loops) + " | " +
            Format("%zu", row.wrong_first_maps) + " | " + Number(row.first_map_s, 1) + " |\n";
  }
  return text;
}

std::string ResultText(const PopulationRun& run) {
  if (run.state == State::kMissing) return "not run";
  if (run.state == State::kFailed) return "failed: " + run.reason;
  if (run.verdict.success()) return "success";
  std::string text;
  for (const Shortfall shortfall : run.verdict.shortfalls)
    text += (text.empty() ? "" : ", ") + ShortfallName(shortfall);
  return text;
}

std::string SequenceTable(const std::vector<PopulationRun>& runs, bool rendered) {
  const char* unit = rendered ? "% of the path" : "m";
  std::string text = Format(
      "| sequence | covered %% (mean, most) | system | success, or what is missed | ATE online / final [%s] "
      "| "
      "tracked online, where the room shows / final %% | wrong poses [s] | false loops / all | first map [s] "
      "|\n"
      "|---|---:|---|---|---:|---:|---:|---:|---:|\n",
      unit);
  for (const PopulationRun& run : runs) {
    const RunVerdict& v = run.verdict;
    const auto ate = [&](std::optional<double> ate_m) {
      return ate_m ? Number(*ate_m / run.AteUnit(), AteDecimals(rendered)) : kNone;
    };
    text += Format("| %s | %.0f, %.0f | %s | %s | ", run.sequence.name.c_str(), 100 * run.mean_covered_share,
                   100 * run.max_covered_share, run.system.c_str(), ResultText(run).c_str());
    if (run.state == State::kMissing) {
      text += " | | | | |\n";
      continue;
    }
    text += ate(v.online_ate_m) + " / " + ate(v.final_ate_m) + " | " +
            Number(100 * v.tracked_online_share, 1) + " / " + Number(100 * v.tracked_share, 1) + " | " +
            Number(v.wrong_poses_s, 1) + " | " + FalseLoops(v.false_loops, v.loops, v.unknown_loops) + " | " +
            Number(v.first_map_s, 1) + (v.wrong_first_map ? " (wrong)" : "") + " |\n";
  }
  return text;
}

std::string Versions(const std::vector<PopulationRun>& runs) {
  std::vector<std::string> versions;
  for (const PopulationRun& run : runs) {
    if (run.state != State::kDone) continue;
    std::string named = run.system + ": " + (run.version.empty() ? "not recorded" : run.version);
    if (std::find(versions.begin(), versions.end(), named) == versions.end()) versions.push_back(named);
  }
  std::string text;
  for (const std::string& version : versions) text += (text.empty() ? "" : "; ") + version;
  return text;
}

/// The runs of each kind and half, in that order, where there are any.
struct Part {
  std::string kind, half;
  std::vector<PopulationRun> runs;
  bool rendered() const { return kind == "rendered"; }
};

std::vector<Part> PartsOf(const std::vector<PopulationRun>& all) {
  std::vector<Part> parts;
  for (const PopulationRun& run : all) {
    const auto same = [&](const Part& part) {
      return part.kind == run.sequence.kind && part.half == run.sequence.half;
    };
    auto part = std::find_if(parts.begin(), parts.end(), same);
    if (part == parts.end()) part = parts.insert(part, {run.sequence.kind, run.sequence.half, {}});
    part->runs.push_back(run);
  }
  return parts;
}

OrderedJson ToJson(double value) { return std::isfinite(value) ? OrderedJson(value) : OrderedJson(nullptr); }
OrderedJson ToJson(const std::optional<double>& value) {
  return value ? ToJson(*value) : OrderedJson(nullptr);
}
OrderedJson ToJson(const MedianAndWorst& numbers) {
  return {{"median", ToJson(numbers.median)}, {"worst", ToJson(numbers.worst)}};
}

OrderedJson ToJson(const PopulationRow& row) {
  return {{"covered", row.title},
          {"system", row.system},
          {"sequences", row.sequences},
          {"not_run", row.missing},
          {"successes", row.successes},
          {"ate_online", ToJson(row.online_ate)},
          {"ate_final", ToJson(row.final_ate)},
          {"wrong_poses_s", ToJson(row.wrong_poses_s)},
          {"most_wrong_poses_in_success_s", row.most_wrong_poses_in_success_s},
          {"loops", row.loops},
          {"false_loops", row.false_loops},
          {"unknown_loops", row.unknown_loops},
          {"wrong_first_maps", row.wrong_first_maps},
          {"first_map_s", ToJson(row.first_map_s)}};
}

OrderedJson ToJson(const PopulationRun& run) {
  const RunVerdict& v = run.verdict;
  OrderedJson json = {{"sequence", run.sequence.name},
                      {"system", run.system},
                      {"path_m", run.path_m},
                      {"covered_mean", run.mean_covered_share},
                      {"covered_most", run.max_covered_share},
                      {"state", run.state == State::kDone     ? "done"
                                : run.state == State::kFailed ? "failed"
                                                              : "not run"}};
  if (!run.reason.empty()) json["reason"] = run.reason;
  if (run.state == State::kMissing) return json;
  json["version"] = run.version;
  json["success"] = v.success();
  json["missed"] = OrderedJson::array();
  for (const Shortfall shortfall : v.shortfalls) json["missed"].push_back(ShortfallName(shortfall));
  json["ate_online_m"] = ToJson(v.online_ate_m);
  json["ate_final_m"] = ToJson(v.final_ate_m);
  json["tracked_online_where_room_shows"] = v.tracked_online_share;
  json["tracked_final"] = v.tracked_share;
  json["wrong_poses_s"] = v.wrong_poses_s;
  json["loops"] = v.loops;
  json["false_loops"] = v.false_loops;
  json["unknown_loops"] = v.unknown_loops;
  json["first_map_s"] = ToJson(v.first_map_s);
  json["wrong_first_map"] = v.wrong_first_map;
  return json;
}

}  // namespace

std::string PopulationMarkdown(const std::vector<PopulationRun>& runs, bool details) {
  std::string text = "# Population\n\n" + Versions(runs) +
                     ". Two numbers in a cell: median / worst. ATE is the RMSE after one Sim3 alignment.\n";
  for (const Part& part : PartsOf(runs)) {
    text += Format("\n## %s, %s half\n\n", part.kind.c_str(), part.half.c_str());
    text += SummaryTable(part.runs, part.rendered());
    if (part.half == "report" && !details) continue;
    text += "\n";
    text += SequenceTable(part.runs, part.rendered());
  }
  return text;
}

std::string PopulationJson(const std::vector<PopulationRun>& runs, bool details) {
  OrderedJson json = OrderedJson::array();
  for (const Part& part : PartsOf(runs)) {
    OrderedJson rows = OrderedJson::array(), single = OrderedJson::array();
    for (const PopulationRow& row : PopulationRows(part.runs)) rows.push_back(ToJson(row));
    for (const PopulationRun& run : part.runs) single.push_back(ToJson(run));
    OrderedJson one = {{"kind", part.kind},
                       {"half", part.half},
                       {"ate_unit", part.rendered() ? "percent of the path" : "m"},
                       {"classes", rows}};
    if (part.half != "report" || details) one["runs"] = single;
    json.push_back(one);
  }
  return json.dump(1) + "\n";
}

}  // namespace dmslam
