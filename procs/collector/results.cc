#include "collector/results.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>

#include "collector/map_ply.h"
#include "dmslam/evaluation/statistics.h"
#include "dmslam/evaluation/trajectory_plot.h"
#include "dmslam/evaluation/uncertain_trajectory.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "dmslam/util/machine.h"
#include "dmslam/util/output_file.h"

namespace dmslam {
namespace {

using Json = nlohmann::ordered_json;

double Percent(size_t part, int64_t whole) {
  return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

Json Quantiles(const DurationHistogram& durations) {
  return {
      {"p50", durations.Quantile(0.5)}, {"p95", durations.Quantile(0.95)}, {"p99", durations.Quantile(0.99)}};
}

/// Of each quarter of the run: whether frames take longer as it goes on.
Json QuantilesOfQuarters(const DurationHistory& durations) {
  Json quarters = Json::array();
  for (int i = 0; i < 4; ++i) quarters.push_back(Quantiles(durations.Between(0.25 * i, 0.25 * (i + 1))));
  return quarters;
}

/// Of camera 1: "1:123".
std::string FrameName(KeyframeId id) {
  const std::string frame = std::to_string(id.frame_index());
  return id.camera() == 0 ? frame : std::to_string(id.camera()) + ":" + frame;
}

/// The covisibility graph: a line "frame frame landmarks" for each two keyframes that share landmarks; "loop"
/// behind it where a loop was closed between them.
void WriteGraph(const std::string& path, const Map& map) {
  std::ostringstream file;
  file << "# frame frame shared_landmarks [loop]\n";
  for (const auto& [id, keyframe] : map.keyframes()) {
    for (const auto& [other, shared] : keyframe.covisible) {
      if (other < id) continue;
      const auto& loops = keyframe.loop_edges;
      const bool loop = std::binary_search(loops.begin(), loops.end(), other);
      file << FrameName(id) << " " << FrameName(other) << " " << shared << (loop ? " loop\n" : "\n");
    }
  }
  WriteFile(path, file.str());
}

/// Depth of the scene where a pose was told, by what its keyframe sees; 1 where nothing is left of that.
double DepthAt(const Map& map, const FramePose& pose) {
  const std::optional<Map::ResolvedPose> reference = map.ResolvePose(*pose.reference);
  if (!reference) return 1.0;
  return map.MedianDepth(*reference->keyframe).value_or(1.0) * pose.reference_scale / reference->scale;
}

std::optional<Matrix6d> CovarianceOf(const std::vector<double>& upper) {
  return upper.empty() ? std::nullopt : std::optional(FromUpperTriangle(upper));
}

/// The poses as they were told while it went on, and how well they were known.
std::vector<ToldPose> ToldPoses(const TrajectoryBuilder& builder) {
  std::vector<ToldPose> poses;
  for (const auto& [frame, pose] : builder.frame_poses()) {
    if (frame.camera != 0 || !pose.HasPose() || pose.state == TrackingState::kLocalizedLater) continue;
    poses.push_back({{pose.stamp_ns, pose.T_cam_world.Inverse()},
                     frame.index,
                     static_cast<int>(pose.state),
                     pose.map_id.value_or(0),
                     pose.reference->frame_index(),
                     pose.T_cam_reference,
                     pose.reference_scale,
                     DepthAt(builder.map(), pose),
                     CovarianceOf(pose.covariance),
                     pose.step_from,
                     CovarianceOf(pose.step_covariance)});
  }
  return poses;
}

Json LoopJson(const RunRecord& run) {
  const LoopcloserStatus& status = run.loopcloser;
  Json json;
  json["places_named"] = status.candidates;
  json["refused_consistency"] = status.refused_consistency;
  json["refused_geometry"] = status.refused_geometry;
  json["global_adjustments"] = status.global_adjustments;
  Json corrections = Json::array();
  const bool several = run.cameras.size() > 1;
  for (const CorrectionRecord& correction : run.corrections) {
    const char* kind = correction.event == MapEvent::kCorrected          ? "loop"
                       : correction.event == MapEvent::kGloballyAdjusted ? "global adjustment"
                                                                         : "refused";
    corrections.push_back(
        {{"frame", correction.keyframe.frame_index()}, {"kind", kind}, {"note", correction.note}});
    if (several) corrections.back()["camera"] = correction.keyframe.camera();
    if (!correction.matched) continue;
    if (several) corrections.back()["matched_camera"] = correction.matched->camera();
    const Eigen::Vector3d& t = correction.T_matched_keyframe.translation;
    const Eigen::Quaterniond& q = correction.T_matched_keyframe.rotation;
    corrections.back()["matched_frame"] = correction.matched->frame_index();
    corrections.back()["T_matched_keyframe"] = {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
  }
  json["corrections"] = corrections;
  return json;
}

struct Errors {
  std::optional<AteReport> final, online;
  std::vector<StampedPose> ground_truth;
};

/// From the file, or as it was heard; none: empty.
std::vector<StampedPose> GroundTruthOf(const CameraRecord& camera) {
  return camera.ground_truth.empty() ? camera.heard_ground_truth : ReadGroundTruth(camera.ground_truth).poses;
}

Errors Evaluate(std::vector<StampedPose> ground_truth, const TrajectoryBuilder::Trajectories& trajectories) {
  Errors errors;
  if (ground_truth.empty()) return errors;
  errors.ground_truth = std::move(ground_truth);
  AteReport final = EvaluateAte(errors.ground_truth, trajectories.final);
  AteReport online = EvaluateAte(errors.ground_truth, trajectories.online);
  if (final.usable()) errors.final = std::move(final);
  if (online.usable()) errors.online = std::move(online);
  return errors;
}

struct CameraResults {
  const CameraRecord* run = nullptr;
  TrajectoryBuilder::Trajectories trajectories;
  int64_t processed = 0;  ///< frames of which a frontend said where the camera was, or that it did not know
  Errors errors;
};

/// Not evaluated yet.
std::vector<CameraResults> ResultsOfCameras(const RunRecord& run, const TrajectoryBuilder& builder) {
  std::vector<CameraResults> cameras;
  for (const CameraRecord& camera : run.cameras)
    cameras.push_back({&camera, builder.Build(static_cast<CameraId>(cameras.size())), 0, {}});
  for (const auto& [frame, pose] : builder.frame_poses()) {
    if (frame.camera < cameras.size()) ++cameras[frame.camera].processed;
  }
  return cameras;
}

/// "DIR/NAME.txt", and of camera 1 "DIR/NAME_1.txt".
std::string CameraFile(const std::string& dir, const std::string& name, size_t camera) {
  return dir + "/" + name + (camera == 0 ? "" : "_" + std::to_string(camera)) + ".txt";
}

constexpr int64_t kBetweenCamerasNs = int64_t{1} << 55;  // a year: what is between no two stamps of one

/// So that the stamps of several cameras, which go at the same time, can be told apart.
void AppendShifted(const std::vector<StampedPose>& poses, size_t camera, std::vector<StampedPose>* all) {
  for (StampedPose pose : poses) {
    pose.stamp_ns += kBetweenCamerasNs * static_cast<int64_t>(camera);
    all->push_back(pose);
  }
}

/// Of all cameras, with one similarity for all: the world is one.
std::optional<AteReport> EvaluateJointly(const std::vector<CameraResults>& cameras,
                                         std::vector<StampedPose> TrajectoryBuilder::Trajectories::*which) {
  std::vector<StampedPose> truth, poses;
  for (size_t i = 0; i < cameras.size(); ++i) {
    AppendShifted(cameras[i].errors.ground_truth, i, &truth);
    AppendShifted(cameras[i].trajectories.*which, i, &poses);
  }
  if (truth.empty()) return std::nullopt;
  AteReport report = EvaluateAte(truth, poses);
  return report.usable() ? std::optional(std::move(report)) : std::nullopt;
}

Json NumberOrNull(const std::optional<AteReport>& report) {
  return report ? Json(report->rmse()) : Json(nullptr);
}

PlotFigure FigureOf(const RunRecord& run, const CameraResults& results) {
  const auto& [camera, trajectories, processed, errors] = results;
  const std::string title = camera->sequence + ", " + run.mode + ", seed " + std::to_string(run.seed);
  if (errors.final) {
    char subtitle[120];
    std::snprintf(subtitle, sizeof(subtitle), "ATE RMSE %.4f m, %.1f %% of %lld frames placed",
                  errors.final->rmse(), Percent(trajectories.final.size(), camera->frames.published),
                  static_cast<long long>(camera->frames.published));
    return TrajectoryFigure(errors.ground_truth, trajectories.final, *errors.final, title, subtitle);
  }
  PlotFigure figure;
  figure.title = title;
  figure.subtitle = "no ground truth: map units";
  PlotSeries path;
  path.label = "camera";
  for (const StampedPose& pose : trajectories.final) {
    path.x.push_back(pose.T_world_cam.translation.x());
    path.y.push_back(pose.T_world_cam.translation.z());
  }
  PlotPanel panel;
  panel.title = "seen from above";
  panel.x_label = "x [map units]";
  panel.y_label = "z [map units]";
  panel.equal_aspect = true;
  panel.series = {path};
  figure.panels = {panel};
  return figure;
}

Json HealthJson(const RunRecord& run, double ProcessHealth::*field) {
  Json json = Json::object();
  for (const auto& [process, health] : run.health) json[process] = health.*field;
  return json;
}

/// What a process's memory grew by from keyframe to keyframe, between the tenth and the last [MB]; null where
/// the run was too short to tell.
Json MemoryGrowthJson(const RunRecord& run) {
  Json json = Json::object();
  for (const auto& [process, growth] : run.memory) {
    if (!growth.first || growth.last.keyframes <= growth.first->keyframes) {
      json[process] = nullptr;
      continue;
    }
    const double keyframes = static_cast<double>(growth.last.keyframes - growth.first->keyframes);
    json[process] = (growth.last.rss_mb - growth.first->rss_mb) / keyframes;
  }
  return json;
}

Json OtherMapsJson(const TrajectoryBuilder::Trajectories& t) {
  Json others = Json::array();
  for (const auto& [map_id, frames] : t.other_maps) others.push_back({{"map", map_id}, {"frames", frames}});
  return others;
}

/// Of each camera its own: two cameras may have frames in one map.
Json OtherMapsOfAllJson(const std::vector<CameraResults>& cameras) {
  Json all = Json::array();
  for (size_t camera = 0; camera < cameras.size(); ++camera) {
    for (Json other : OtherMapsJson(cameras[camera].trajectories)) {
      other["camera"] = camera;
      all.push_back(std::move(other));
    }
  }
  return all;
}

/// How many frames were played from the one on that was tracked first: also those that left no record, since
/// they never came to the frontend. Before that one there are as many of them as indices are missing.
int64_t FramesSinceFirstMap(const RunRecord& run, const TrajectoryBuilder& builder, int64_t first_stamp_ns) {
  const PlayedFrames& frames = run.first().frames;
  int64_t recorded = 0, before = 0;
  std::optional<uint32_t> first;
  for (const auto& [frame, pose] : builder.frame_poses()) {
    if (frame.camera != 0) continue;
    ++recorded;
    if (pose.stamp_ns < first_stamp_ns) {
      ++before;
    } else if (!first) {
      first = frame.index;
    }
  }
  const int64_t unrecorded = std::max<int64_t>(0, frames.published - recorded);
  const int64_t gaps =
      std::max<int64_t>(0, int64_t{first.value_or(0)} - frames.first_index.value_or(0) - before);
  return frames.published - before - std::min(gaps, unrecorded);
}

/// When the sequence's first frame was taken; none: no frame has left a record. Where the first ones left
/// none, since they never came to the frontend: by their number, at the median rate of those that did.
std::optional<int64_t> FirstStampNs(const RunRecord& run, const TrajectoryBuilder& builder) {
  std::optional<std::pair<uint32_t, int64_t>> first, last;
  std::vector<double> ns_per_frame;
  for (const auto& [frame, pose] : builder.frame_poses()) {
    if (frame.camera != 0) continue;
    if (!first) first = {frame.index, pose.stamp_ns};
    if (last)
      ns_per_frame.push_back(static_cast<double>(pose.stamp_ns - last->second) / (frame.index - last->first));
    last = {frame.index, pose.stamp_ns};
  }
  if (!first) return std::nullopt;
  const uint32_t played_first = run.first().frames.first_index.value_or(first->first);
  if (first->first <= played_first || ns_per_frame.empty()) return first->second;
  return first->second - std::llround(Median(ns_per_frame) * (first->first - played_first));
}

Json TrackingJson(const RunRecord& run, const TrajectoryBuilder& builder,
                  const TrajectoryBuilder::Trajectories& t) {
  Json json;
  const std::optional<int64_t> first_stamp_ns = FirstStampNs(run, builder);
  const int64_t after_first =
      t.online.empty() ? 0 : FramesSinceFirstMap(run, builder, t.online.front().stamp_ns);
  json["tracked_online_percent"] = Percent(t.online.size(), run.first().frames.published);
  json["tracked_online_after_first_map_percent"] = Percent(t.online.size(), after_first);
  json["tracked_percent"] = Percent(t.final.size(), run.first().frames.published);
  if (!t.online.empty() && first_stamp_ns) {
    json["first_init_s"] = static_cast<double>(t.online.front().stamp_ns - *first_stamp_ns) * 1e-9;
  } else {
    json["first_init_s"] = nullptr;
  }
  json["map"] = t.map_id ? Json(*t.map_id) : Json();
  json["other_maps"] = OtherMapsJson(t);
  return json;
}

/// The map that holds most frames of all cameras; null where this one has nothing in it.
Json MapOfCameraJson(const TrajectoryBuilder::Trajectories& t) {
  const bool has_part = !t.final.empty() || !t.online.empty() || !t.keyframes.empty();
  return t.map_id && has_part ? Json(*t.map_id) : Json();
}

/// Lost is what was played, and was neither worked on nor skipped: it was dropped on its way, or there was no
/// frontend, or one that died with it.
Json CameraJson(CameraId number, const CameraResults& results) {
  const auto& [camera, t, processed, errors] = results;
  const int64_t played = camera->frames.published, skipped = camera->frontend.frames_skipped;
  Json json;
  json["camera"] = number;
  json["sequence"] = camera->sequence;
  json["frames"] = played;
  json["frames_missing"] = camera->frames.missing;
  json["frames_processed"] = processed;
  json["frames_skipped"] = skipped;
  json["frames_lost"] = std::max<int64_t>(0, played - processed - skipped);
  json["frames_tracked_online"] = t.online.size();
  json["frames_tracked"] = t.final.size();
  json["tracked_online_percent"] = Percent(t.online.size(), camera->frames.published);
  json["tracked_percent"] = Percent(t.final.size(), camera->frames.published);
  json["keyframes"] = t.keyframes.size();
  json["map"] = MapOfCameraJson(t);
  json["other_maps"] = OtherMapsJson(t);
  json["ate_rmse_final"] = NumberOrNull(errors.final);
  json["ate_rmse_online"] = NumberOrNull(errors.online);
  return json;
}

/// Of several cameras: each, and all together. What stands above them of the first one is the same there.
Json CamerasJson(const std::vector<CameraResults>& results) {
  using Trajectories = TrajectoryBuilder::Trajectories;
  Json json;
  Json cameras = Json::array();
  for (size_t i = 0; i < results.size(); ++i)
    cameras.push_back(CameraJson(static_cast<CameraId>(i), results[i]));
  for (const char* key : {"frames", "frames_processed", "frames_skipped", "frames_lost"})
    json[key] = cameras.front()[key];
  json["cameras"] = cameras;
  json["other_maps"] = OtherMapsOfAllJson(results);
  json["ate_rmse_joint"] = NumberOrNull(EvaluateJointly(results, &Trajectories::final));
  json["ate_rmse_joint_online"] = NumberOrNull(EvaluateJointly(results, &Trajectories::online));
  return json;
}

Json TimingJson(const RunRecord& run) {
  const FrameDurations& durations = run.durations;
  Json json;
  json["frontend_ms_median"] = durations.step.Quantile(0.5);
  json["frontend_ms_p95"] = durations.step.Quantile(0.95);
  json["frontend_without_decoding_ms"] = Quantiles(durations.apart);
  json["decode_ms"] = Quantiles(durations.decode);
  json["extract_ms"] = Quantiles(durations.extract);
  json["image_to_pose_ms"] = Quantiles(durations.image_to_pose.All());
  json["image_to_pose_ms_by_quarter"] = QuantilesOfQuarters(durations.image_to_pose);
  json["keyframe_to_landmarks_ms"] = Quantiles(run.keyframes.to_landmarks);
  json["keyframe_to_adjusted_ms"] = Quantiles(run.keyframes.to_adjusted);
  return json;
}

Json MachineJson(const Machine& machine) { return {{"cpu", machine.processor}, {"cores", machine.cores}}; }

/// What was played, and what of it reached the frontend.
Json PlayedJson(const RunRecord& run) {
  const PlayedFrames& frames = run.first().frames;
  const FrontendStatus& frontend = run.first().frontend;
  Json json;
  json["sequence"] = run.first().sequence;
  json["seed"] = run.seed;
  json["mode"] = run.mode;
  json["profile"] = run.profile;
  json["frames"] = frames.published;
  json["frames_missing"] = frames.missing;
  json["frames_blacked_out"] = frames.blacked;
  json["frames_jumped"] = frames.jumped;
  json["frames_processed"] = frontend.frames_processed;
  json["frames_skipped"] = frontend.frames_skipped;
  json["frames_received"] = frontend.frames_received;
  const bool counted = run.end_heard && run.restarts == 0;  // counts since the last status die with a process
  const int64_t lost = frames.published - frontend.frames_received;
  json["frames_lost"] = counted ? Json(std::max<int64_t>(0, lost)) : Json(nullptr);
  return json;
}

Json MapJson(const RunRecord& run, const TrajectoryBuilder& builder, const TrajectoryBuilder::Trajectories& t,
             const Errors& errors) {
  Json json;
  json["resets"] = run.resets;
  json["relocalisations"] = run.first().frontend.relocalisations;
  json["keyframes"] = t.keyframes.size();
  json["landmarks"] = builder.map().num_landmarks();
  json["loops"] = run.loopcloser.loops_closed;
  json["loop_closing"] = LoopJson(run);
  json["ate_rmse_final"] = NumberOrNull(errors.final);
  json["ate_rmse_online"] = NumberOrNull(errors.online);
  json["scale_final"] = errors.final ? Json(errors.final->scale()) : Json(nullptr);
  return json;
}

/// What died, came back and was lost.
Json FailuresJson(const RunRecord& run) {
  Json json;
  json["restarts"] = run.restarts;
  json["resumed"] = run.resumes;
  json["disk_problems"] = run.disk_problems;
  if (!run.end_problem.empty()) json["end_problem"] = run.end_problem;
  json["keyframes_proposed"] = run.keyframes.proposed;
  json["keyframes_missing"] = run.keyframes.missing;
  json["keyframes_lost_in_crash"] = run.keyframes.lost_in_crash;
  json["keyframes_lost_with_frontend"] = run.keyframes.lost_with_frontend;
  return json;
}

/// The streams between the processes, over all of them.
Json StreamsJson(const RunRecord& run) {
  ProcessHealth sum;
  int64_t dropped = 0;
  for (const auto& [process, health] : run.health) {
    sum.records_lost += health.records_lost;
    sum.records_repaired += health.records_repaired;
    sum.dropped_foreign += health.dropped_foreign;
    sum.dropped_overflow += health.dropped_overflow;
    dropped += health.dropped_malformed + health.dropped_checksum + health.dropped_foreign;
    sum.written_bytes += health.written_bytes;
    sum.resent_bytes += health.resent_bytes;
  }
  Json json;
  json["records_lost"] = sum.records_lost;
  json["records_repaired"] = sum.records_repaired;
  json["records_without_room"] = sum.dropped_overflow;
  json["dropped_of_other_sessions"] = sum.dropped_foreign;
  json["messages_dropped"] = dropped;
  json["recovery_p50_ms"] = HealthJson(run, &ProcessHealth::recovery_p50_ms);
  json["recovery_p99_ms"] = HealthJson(run, &ProcessHealth::recovery_p99_ms);
  json["payload_bytes"] = sum.written_bytes;
  json["resent_bytes"] = sum.resent_bytes;
  return json;
}

Json SummaryJson(const RunRecord& run, const TrajectoryBuilder& builder,
                 const TrajectoryBuilder::Trajectories& t, const Errors& errors) {
  Json json;
  json["version"] = BuildVersion();
  json["machine"] = MachineJson(ThisMachine());
  json.update(PlayedJson(run));
  json.update(TrackingJson(run, builder, t));
  json.update(MapJson(run, builder, t, errors));
  json.update(TimingJson(run));
  json.update(FailuresJson(run));
  json.update(StreamsJson(run));
  json["max_rss_mb"] = HealthJson(run, &ProcessHealth::rss_mb);
  json["rss_growth_mb_per_keyframe"] = MemoryGrowthJson(run);
  return json;
}

/// The summary as lines of a name and a value each, as the terminal shows it.
class SummaryTable {
 public:
  explicit SummaryTable(const Json& summary) : summary_(summary) {}

  void AddRow(const std::string& name, const std::string& value) {
    char line[160];
    std::snprintf(line, sizeof(line), "  %-34s %s\n", name.c_str(), value.c_str());
    text_ += line;
  }
  struct Number {
    const char* key;
    const char* format;
  };
  /// What is missing is a dash.
  void AddNumbers(const char* name, std::initializer_list<Number> numbers) {
    std::string value;
    for (const Number& number : numbers) {
      if (!value.empty()) value += " / ";
      value += Format(number);
    }
    AddRow(name, value);
  }
  const std::string& text() const { return text_; }

 private:
  std::string Format(const Number& number) const {
    if (!summary_.contains(number.key) || summary_[number.key].is_null()) return "-";
    char text[40];
    std::snprintf(text, sizeof(text), number.format, summary_[number.key].get<double>());
    return text;
  }

  const Json& summary_;
  std::string text_;
};

std::string CameraRowName(const Json& camera) {
  return "... of camera " + std::to_string(camera["camera"].get<int>());
}

void AddFrames(const Json& summary, SummaryTable* table) {
  table->AddNumbers("frames published / skipped / lost",
                    {{"frames", "%.0f"}, {"frames_skipped", "%.0f"}, {"frames_lost", "%.0f"}});
  if (!summary.contains("cameras")) return;
  for (const Json& camera : summary["cameras"]) {
    table->AddRow(CameraRowName(camera), camera["frames"].dump() + " / " + camera["frames_skipped"].dump() +
                                             " / " + camera["frames_lost"].dump());
  }
}

void AddTracked(const Json& summary, SummaryTable* table) {
  table->AddNumbers("tracked online / in the end [%]",
                    {{"tracked_online_percent", "%.1f"}, {"tracked_percent", "%.1f"}});
  if (!summary.contains("cameras")) return;
  for (const Json& camera : summary["cameras"]) {
    char text[80];
    std::snprintf(text, sizeof(text), "%.1f / %.1f", camera["tracked_online_percent"].get<double>(),
                  camera["tracked_percent"].get<double>());
    table->AddRow(CameraRowName(camera), text);
  }
  table->AddNumbers("joint ATE RMSE final / online [m]",
                    {{"ate_rmse_joint", "%.4f"}, {"ate_rmse_joint_online", "%.4f"}});
}

std::string Table(const Json& summary) {
  SummaryTable table(summary);
  table.AddRow("sequence", summary["sequence"].get<std::string>());
  AddFrames(summary, &table);
  AddTracked(summary, &table);
  table.AddNumbers("first map after [s]", {{"first_init_s", "%.2f"}});
  table.AddNumbers("ATE RMSE final / online [m]", {{"ate_rmse_final", "%.4f"}, {"ate_rmse_online", "%.4f"}});
  table.AddNumbers("keyframes / landmarks / loops",
                   {{"keyframes", "%.0f"}, {"landmarks", "%.0f"}, {"loops", "%.0f"}});
  table.AddNumbers("resets / relocalisations", {{"resets", "%.0f"}, {"relocalisations", "%.0f"}});
  table.AddNumbers("frontend median / p95 [ms]",
                   {{"frontend_ms_median", "%.1f"}, {"frontend_ms_p95", "%.1f"}});
  table.AddNumbers("records lost / repaired", {{"records_lost", "%.0f"}, {"records_repaired", "%.0f"}});
  return table.text();
}

}  // namespace

WrittenResults WriteResults(const std::string& dir, RunRecord run, const TrajectoryBuilder& builder,
                            bool figure) {
  WrittenResults written;
  const auto attempt = [&](const std::function<void()>& write) {
    try {
      write();
    } catch (const std::exception& error) {
      if (written.problem.empty()) written.problem = error.what();
    }
  };
  attempt([&] { std::filesystem::create_directories(dir); });
  std::vector<CameraResults> cameras = ResultsOfCameras(run, builder);
  for (size_t i = 0; i < cameras.size(); ++i) {
    const TrajectoryBuilder::Trajectories& of_camera = cameras[i].trajectories;
    attempt([&] { WriteTrajectory(CameraFile(dir, "trajectory", i), of_camera.final); });
    attempt([&] { WriteTrajectory(CameraFile(dir, "trajectory_online", i), of_camera.online); });
    attempt([&] { WriteTrajectory(CameraFile(dir, "keyframes", i), of_camera.keyframes); });
  }
  const CameraResults& first = cameras.front();
  attempt([&] { WriteToldPoses(dir + "/poses_online.csv", ToldPoses(builder)); });
  attempt([&] { WriteMapPly(dir + "/map.ply", builder.map(), first.trajectories.map_id); });
  attempt([&] { WriteGraph(dir + "/graph.txt", builder.map()); });
  for (CameraResults& camera : cameras)
    camera.errors = Evaluate(GroundTruthOf(*camera.run), camera.trajectories);
  if (figure && !first.trajectories.final.empty())
    attempt([&] { WritePng(FigureOf(run, first), dir + "/trajectory.png"); });
  if (!written.problem.empty()) run.disk_problems.push_back(written.problem);
  Json summary = SummaryJson(run, builder, first.trajectories, first.errors);
  if (cameras.size() > 1) summary.update(CamerasJson(cameras));
  attempt([&] { WriteFile(dir + "/summary.json", summary.dump(2) + "\n"); });
  written.table = Table(summary);
  return written;
}

}  // namespace dmslam
