#include "dmslam/evaluation/report.h"

#include <nlohmann/json.hpp>

#include "dmslam/util/format.h"

namespace dmslam {
namespace {

using Json = nlohmann::ordered_json;

std::string DeltaName(const RpeOptions& options) {
  const std::string unit(RpeUnitName(options.unit));
  if (options.delta == 1) return "per " + unit.substr(0, unit.size() - 1);
  return Format("per %g %s", options.delta, unit.c_str());
}

std::string Row(const std::string& name, const Statistics& s) {
  return Format("%-28s %10.6f %10.6f %10.6f %10.6f %10.6f %10.6f %12.6f\n", name.c_str(), s.rmse, s.mean,
                s.median, s.std, s.min, s.max, s.sse);
}

std::string CoverageText(const Coverage& coverage) {
  if (!coverage.percent) return Format("%zu poses; of how many frames is not known", coverage.poses);
  std::string text =
      Format("%.1f %% (%zu poses, %zu frames)", *coverage.percent, coverage.poses, *coverage.frames);
  if (coverage.time_to_first_pose_s)
    text += Format("; first pose after %.2f s", *coverage.time_to_first_pose_s);
  if (coverage.poses_of_no_frame > 0)
    text += Format("; %zu poses belong to no frame", coverage.poses_of_no_frame);
  return text;
}

Json ToJson(const Statistics& s) {
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"std", s.std},
          {"min", s.min},   {"max", s.max},   {"sse", s.sse}};
}

Json ToJson(const Sim3d& transform) {
  const Eigen::Quaterniond& q = transform.rotation;
  const Eigen::Vector3d& t = transform.translation;
  return {{"scale", transform.scale},
          {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}},
          {"translation", {t.x(), t.y(), t.z()}}};
}

template <typename T>
Json OrNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json ToJson(const Coverage& coverage) {
  return {{"poses", coverage.poses},
          {"frames", OrNull(coverage.frames)},
          {"percent", OrNull(coverage.percent)},
          {"time_to_first_pose_s", OrNull(coverage.time_to_first_pose_s)},
          {"poses_of_no_frame", coverage.poses_of_no_frame}};
}

Json ToJson(const RpeOptions& options, const RpeReport& report) {
  Json json = {
      {"delta", options.delta}, {"unit", RpeUnitName(options.unit)}, {"motions", report.motions.size()}};
  if (!report.usable()) {
    json["reason"] = report.reason;
    return json;
  }
  json["translation"] = ToJson(report.translation);
  json["rotation_deg"] = ToJson(report.rotation_deg);
  return json;
}

}  // namespace

Evaluation Evaluate(std::span<const StampedPose> ground_truth, std::span<const StampedPose> estimate,
                    const EvaluationOptions& options, const Coverage& coverage) {
  Evaluation evaluation;
  evaluation.options = options;
  evaluation.coverage = coverage;
  evaluation.ate = EvaluateAte(ground_truth, estimate, {options.alignment, options.max_difference_ns});
  for (RpeOptions& rpe : evaluation.options.rpe) {
    rpe.alignment = options.alignment;
    rpe.max_difference_ns = options.max_difference_ns;
    evaluation.rpe.push_back(EvaluateRpe(ground_truth, estimate, rpe));
  }
  return evaluation;
}

std::string EvaluationTable(const Evaluation& evaluation) {
  const AteReport& ate = evaluation.ate;
  if (!ate.usable()) return "no result: " + ate.reason + "\n";
  std::string table =
      Format("alignment %s, scale %.9g, %zu pairs\n",
             std::string(AlignmentName(evaluation.options.alignment)).c_str(), ate.scale(), ate.pairs.size());
  table += "covered: " + CoverageText(evaluation.coverage) + "\n\n";
  table += Format("%-28s %10s %10s %10s %10s %10s %10s %12s\n", "", "RMSE", "mean", "median", "std", "min",
                  "max", "SSE");
  table += Row("ATE [m]", ate.statistics);
  std::string without;
  for (size_t i = 0; i < evaluation.rpe.size(); ++i) {
    const std::string name = DeltaName(evaluation.options.rpe[i]);
    const RpeReport& rpe = evaluation.rpe[i];
    if (!rpe.usable()) {
      without += "RPE " + name + ": none, " + rpe.reason + "\n";
      continue;
    }
    table += Row("RPE " + name + " [m]", rpe.translation);
    table += Row("RPE " + name + " [deg]", rpe.rotation_deg);
  }
  return table + without;
}

std::string EvaluationJson(const Evaluation& evaluation) {
  const AteReport& ate = evaluation.ate;
  Json json;
  json["alignment"] = AlignmentName(evaluation.options.alignment);
  json["max_difference_s"] = 1e-9 * static_cast<double>(evaluation.options.max_difference_ns);
  json["pairs"] = ate.pairs.size();
  json["coverage"] = ToJson(evaluation.coverage);
  if (!ate.usable()) {
    json["reason"] = ate.reason;
    return json.dump(1) + "\n";
  }
  json["ate"] = ToJson(ate.statistics);
  json["ground_truth_from_estimate"] = ToJson(ate.ground_truth_from_estimate);
  json["rpe"] = Json::array();
  for (size_t i = 0; i < evaluation.rpe.size(); ++i) {
    json["rpe"].push_back(ToJson(evaluation.options.rpe[i], evaluation.rpe[i]));
  }
  return json.dump(1) + "\n";
}

std::string EvaluationSummary(const Evaluation& evaluation) {
  const AteReport& ate = evaluation.ate;
  if (!ate.usable()) return "no result: " + ate.reason;
  std::string text =
      Format("ATE RMSE %.4f m (%s, scale %.3f), %zu pairs", ate.rmse(),
             std::string(AlignmentName(evaluation.options.alignment)).c_str(), ate.scale(), ate.pairs.size());
  if (evaluation.coverage.percent) {
    text += Format(", %.1f %% of %zu frames", *evaluation.coverage.percent, *evaluation.coverage.frames);
  }
  return text;
}

}  // namespace dmslam
