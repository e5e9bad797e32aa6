#include <nlohmann/json.hpp>

#include "compare.h"
#include "markdown.h"

namespace dmslam {
namespace {

using OrderedJson = nlohmann::ordered_json;
using State = RunResult::State;

constexpr std::pair<Metric, const char*> kMetrics[] = {
    {Metric::kAte, "ate_m"},
    {Metric::kRpeTranslationPerFrame, "rpe_translation_per_frame_m"},
    {Metric::kRpeTranslationPerSecond, "rpe_translation_per_second_m"},
    {Metric::kRpeRotationPerFrame, "rpe_rotation_per_frame_deg"},
    {Metric::kRpeRotationPerSecond, "rpe_rotation_per_second_deg"}};

OrderedJson ToJson(const std::optional<double>& value) {
  return value ? OrderedJson(*value) : OrderedJson(nullptr);
}

OrderedJson ToJson(const std::optional<Spread>& spread) {
  if (!spread) return nullptr;
  return {{"median", spread->median}, {"min", spread->min}, {"max", spread->max}, {"runs", spread->count}};
}

OrderedJson ToJson(const Statistics& s) {
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median},
          {"std", s.std},   {"min", s.min},   {"max", s.max}};
}

const char* StateName(State state) {
  switch (state) {
    case State::kMissing:
      return "missing";
    case State::kFailed:
      return "failed";
    case State::kNoTrajectory:
      return "no trajectory";
    case State::kDone:
      return "done";
  }
  return "missing";
}

OrderedJson ToJson(const Machine& machine) { return {{"cpu", machine.processor}, {"cores", machine.cores}}; }

OrderedJson ToJson(const std::vector<Origin>& origins, const char* what) {
  OrderedJson json = OrderedJson::array();
  for (const Origin& origin : origins) json.push_back({{what, origin.text}, {"runs", origin.runs}});
  return json;
}

OrderedJson ToJson(const RunResult& run) {
  OrderedJson json = {
      {"seed", run.key.seed},
      {"state", StateName(run.state)},
      {"tracked_percent", ToJson(run.tracked_percent)},
      {"tracked_online_percent", ToJson(run.tracked_online_percent)},
      {"tracked_online_after_first_map_percent", ToJson(run.tracked_online_after_first_map_percent)},
      {"ate_online_m", ToJson(run.ate_online_m)},
      {"first_map_s", ToJson(run.first_map_s)},
      {"frontend_ms_median", ToJson(run.frontend_ms_median)}};
  if (run.version) json["version"] = *run.version;
  if (run.machine) json["machine"] = ToJson(*run.machine);
  if (!run.reason.empty()) json["reason"] = run.reason;
  for (const auto& [metric, name] : kMetrics) {
    if (const auto statistics = MetricOf(run, metric)) json[name] = ToJson(*statistics);
  }
  return json;
}

OrderedJson ToJson(const Cell& cell) {
  OrderedJson json = {
      {"sequence", cell.sequence},
      {"settings", cell.setting},
      {"profile", cell.profile},
      {"runs_made", cell.Made()},
      {"runs_failed", cell.Failed()},
      {"tracked_percent", ToJson(cell.TrackedPercent())},
      {"tracked_online_percent", ToJson(cell.TrackedOnlinePercent())},
      {"tracked_online_after_first_map_percent", ToJson(cell.TrackedOnlineAfterFirstMapPercent())},
      {"ate_online_m", ToJson(cell.AteOnline())},
      {"first_map_s", ToJson(cell.FirstMapSeconds())}};
  for (const auto& [metric, name] : kMetrics) {
    json[name] = {{"rmse", ToJson(cell.Rmse(metric))},
                  {"mean", ToJson(cell.Mean(metric))},
                  {"median", ToJson(cell.Median(metric))},
                  {"std", ToJson(cell.Std(metric))}};
  }
  json["runs"] = OrderedJson::array();
  for (const RunResult& run : cell.runs) json["runs"].push_back(ToJson(run));
  return json;
}

OrderedJson ToJson(const PlannedSequence& sequence) {
  OrderedJson json = {
      {"name", sequence.info.name}, {"present", sequence.present()}, {"source", sequence.info.source}};
  if (!sequence.present() && sequence.has_runs) json["runs_not_shown"] = true;
  if (!sequence.info.like.empty()) json["stands_for"] = sequence.info.like;
  if (sequence.info.paper) {
    json["paper_ate_rmse_m"] = {{"orb_slam2", sequence.info.paper->orb_slam2_ate_rmse_m},
                                {"dm_slam", sequence.info.paper->dm_slam_ate_rmse_m}};
  }
  return json;
}

// Of dm against baseline, by the medians over the seeds [%]; the shares tracked stand beside it.
OrderedJson ImprovementJson(const PlannedSequence& sequence, const Cell& baseline, const Cell& dm) {
  const std::optional<double> paper = PaperImprovementPercent(sequence.info);
  OrderedJson json = {{"sequence", sequence.info.name},
                      {"settings", dm.setting},
                      {"baseline_tracked_percent", ToJson(baseline.TrackedPercent())},
                      {"dm_tracked_percent", ToJson(dm.TrackedPercent())}};
  for (const auto& [metric, name] : kMetrics) {
    json[name] = {{"rmse_percent", ToJson(ImprovementPercent(baseline.Rmse(metric), dm.Rmse(metric)))},
                  {"mean_percent", ToJson(ImprovementPercent(baseline.Mean(metric), dm.Mean(metric)))},
                  {"median_percent", ToJson(ImprovementPercent(baseline.Median(metric), dm.Median(metric)))},
                  {"std_percent", ToJson(ImprovementPercent(baseline.Std(metric), dm.Std(metric)))}};
  }
  if (paper) {
    const std::string_view like = sequence.info.like.empty() ? sequence.info.name : sequence.info.like;
    json["paper"] = {{"sequence", like}, {"ate_rmse_percent", *paper}};
  }
  return json;
}

OrderedJson ImprovementsJson(const Results& results) {
  OrderedJson json = OrderedJson::array();
  for (const Setting& setting : results.plan.settings) {
    for (const PlannedSequence& sequence : results.plan.sequences) {
      const std::string name(sequence.info.name);
      const Cell* baseline = results.Find(name, setting.name, "baseline");
      const Cell* dm = results.Find(name, setting.name, "dm");
      if (baseline != nullptr && dm != nullptr) json.push_back(ImprovementJson(sequence, *baseline, *dm));
    }
  }
  return json;
}

OrderedJson ToJson(const StandIn& one) {
  const Cell* still = one.dm_without_actors;
  const auto with = one.dm->Rmse(Metric::kAte), baseline = one.baseline->Rmse(Metric::kAte);
  return {{"sequence", one.sequence->info.name},
          {"stands_for", one.sequence->info.like},
          {"settings", one.dm->setting},
          {"without_actors", still == nullptr ? OrderedJson(nullptr) : OrderedJson(still->sequence)},
          {"dm_ate_rmse_m", ToJson(with)},
          {"dm_ate_rmse_without_actors_m",
           still == nullptr ? OrderedJson(nullptr) : ToJson(still->Rmse(Metric::kAte))},
          {"ratio", ToJson(one.Ratio())},
          {"dm_tracked_percent", ToJson(one.dm->TrackedPercent())},
          {"dm_tracked_after_first_map_percent", ToJson(one.dm->TrackedOnlineAfterFirstMapPercent())},
          {"baseline_ate_rmse_m", ToJson(baseline)},
          {"baseline_tracked_percent", ToJson(one.baseline->TrackedPercent())},
          {"better_by_percent", ToJson(ImprovementPercent(baseline, with))},
          {"paper_better_by_percent", ToJson(PaperImprovementPercent(one.sequence->info))}};
}

OrderedJson StandInsJson(const Results& results) {
  OrderedJson json = OrderedJson::array();
  for (const Setting& setting : results.plan.settings) {
    for (const StandIn& one : StandIns(results, setting)) json.push_back(ToJson(one));
  }
  return json;
}

}  // namespace

std::string ReportJson(const Results& results, const std::optional<IterationTimes>& times) {
  OrderedJson json;
  json["seeds"] = results.plan.seeds;
  json["versions"] = ToJson(Versions(results, nullptr), "version");
  json["machines_of_runs"] = ToJson(Machines(results), "machine");
  json["machine_of_report"] = ToJson(ThisMachine());
  json["sequences"] = OrderedJson::array();
  for (const PlannedSequence& sequence : results.plan.sequences)
    json["sequences"].push_back(ToJson(sequence));
  json["time_of_2000_iterations_ms"] = {
      {"paper", {{"ransac", kPaperRansacMs}, {"arsac", kPaperArsacMs}, {"dlrsac", kPaperDlrsacMs}}}};
  if (times) {
    json["time_of_2000_iterations_ms"]["here"] = {{"ransac", times->ransac_ms},
                                                  {"arsac", times->arsac_ms},
                                                  {"dlrsac", times->dlrsac_ms},
                                                  {"machine", times->machine}};
  }
  json["improvements"] = ImprovementsJson(results);
  json["stand_ins"] = StandInsJson(results);
  json["results"] = OrderedJson::array();
  for (const Cell& cell : results.cells) json["results"].push_back(ToJson(cell));
  return json.dump(1) + "\n";
}

}  // namespace dmslam
