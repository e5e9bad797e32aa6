#include <nlohmann/json.hpp>

#include "markdown.h"

namespace dmslam {
namespace {

using Json = nlohmann::ordered_json;
using State = RunResult::State;

constexpr std::pair<Metric, const char*> kMetrics[] = {
    {Metric::kAte, "ate_m"},
    {Metric::kRpeTranslationPerFrame, "rpe_translation_per_frame_m"},
    {Metric::kRpeTranslationPerSecond, "rpe_translation_per_second_m"},
    {Metric::kRpeRotationPerFrame, "rpe_rotation_per_frame_deg"},
    {Metric::kRpeRotationPerSecond, "rpe_rotation_per_second_deg"}};

Json ToJson(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json ToJson(const std::optional<Spread>& spread) {
  if (!spread) return nullptr;
  return {{"median", spread->median}, {"min", spread->min}, {"max", spread->max}, {"runs", spread->count}};
}

Json ToJson(const Statistics& s) {
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

Json ToJson(const RunResult& run) {
  Json json = {{"seed", run.key.seed},
               {"state", StateName(run.state)},
               {"tracked_percent", ToJson(run.tracked_percent)},
               {"tracked_online_percent", ToJson(run.tracked_online_percent)},
               {"tracked_online_after_first_map_percent", ToJson(run.tracked_online_after_first_map_percent)},
               {"first_map_s", ToJson(run.first_map_s)},
               {"frontend_ms_median", ToJson(run.frontend_ms_median)}};
  if (!run.reason.empty()) json["reason"] = run.reason;
  for (const auto& [metric, name] : kMetrics) {
    if (const auto statistics = MetricOf(run, metric)) json[name] = ToJson(*statistics);
  }
  return json;
}

Json ToJson(const Cell& cell) {
  Json json = {{"sequence", cell.sequence},
               {"settings", cell.setting},
               {"profile", cell.profile},
               {"tracked_percent", ToJson(cell.TrackedPercent())},
               {"tracked_online_percent", ToJson(cell.TrackedOnlinePercent())},
               {"tracked_online_after_first_map_percent", ToJson(cell.TrackedOnlineAfterFirstMapPercent())},
               {"first_map_s", ToJson(cell.FirstMapSeconds())}};
  for (const auto& [metric, name] : kMetrics) {
    json[name] = {{"rmse", ToJson(cell.Rmse(metric))},
                  {"mean", ToJson(cell.Mean(metric))},
                  {"median", ToJson(cell.Median(metric))},
                  {"std", ToJson(cell.Std(metric))}};
  }
  json["runs"] = Json::array();
  for (const RunResult& run : cell.runs) json["runs"].push_back(ToJson(run));
  return json;
}

Json ToJson(const PlannedSequence& sequence) {
  Json json = {
      {"name", sequence.info.name}, {"present", sequence.present()}, {"source", sequence.info.source}};
  if (!sequence.info.like.empty()) json["stands_for"] = sequence.info.like;
  if (sequence.info.paper) {
    json["paper_ate_rmse_m"] = {{"orb_slam2", sequence.info.paper->orb_slam2_ate_rmse_m},
                                {"dm_slam", sequence.info.paper->dm_slam_ate_rmse_m}};
  }
  return json;
}

}  // namespace

std::string ReportJson(const Results& results, const std::optional<IterationTimes>& times) {
  Json json;
  json["seeds"] = results.plan.seeds;
  json["sequences"] = Json::array();
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
  json["results"] = Json::array();
  for (const Cell& cell : results.cells) json["results"].push_back(ToJson(cell));
  return json.dump(1) + "\n";
}

}  // namespace dmslam
