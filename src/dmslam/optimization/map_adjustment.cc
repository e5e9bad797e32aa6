#include "dmslam/optimization/map_adjustment.h"

#include <algorithm>
#include <map>
#include <utility>

#include "dmslam/map/neighbourhood.h"

namespace dmslam {
namespace {

/// The bundle problem and whom its rows belong to.
struct Window {
  BundleProblem problem;
  std::vector<const Keyframe*> keyframes;  ///< parallel to the problem's poses
  std::vector<const Landmark*> landmarks;  ///< parallel to the problem's points
  std::vector<uint16_t> features;          ///< of those keyframes, parallel to the problem's observations
  std::map<KeyframeId, int> index;
  int free_keyframes = 0;

  void AddPose(const Keyframe& keyframe, bool fixed) {
    index[keyframe.id] = static_cast<int>(keyframes.size());
    keyframes.push_back(&keyframe);
    problem.T_cam_world.push_back(keyframe.T_cam_world);
    problem.pose_fixed.push_back(fixed ? 1 : 0);
    if (!fixed) ++free_keyframes;
  }
};

/// Observers outside the window, those that see most of its landmarks first.
std::vector<KeyframeId> FixedObservers(const Window& window, int most) {
  std::map<KeyframeId, int> seen;
  for (const Landmark* landmark : window.landmarks) {
    for (const Observation& o : landmark->observations) {
      if (!window.index.contains(o.keyframe)) ++seen[o.keyframe];
    }
  }
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& [id, count] : seen) ranked.emplace_back(-count, id);
  std::sort(ranked.begin(), ranked.end());
  std::vector<KeyframeId> fixed;
  for (const auto& [count, id] : ranked) {
    if (static_cast<int>(fixed.size()) >= most) break;
    fixed.push_back(id);
  }
  return fixed;
}

void AddObservations(const Map& map, double sigma_px, Window& window) {
  for (size_t point = 0; point < window.landmarks.size(); ++point) {
    const Landmark& landmark = *window.landmarks[point];
    window.problem.points.push_back(landmark.p_world);
    for (const Observation& o : landmark.observations) {
      const auto pose = window.index.find(o.keyframe);
      if (pose == window.index.end()) continue;
      const FrameFeatures& features = *window.keyframes[static_cast<size_t>(pose->second)]->features;
      window.problem.observations.push_back(
          {pose->second, static_cast<int>(point), features.uv_px[o.feature],
           1.0 / (sigma_px * sigma_px * features.Variance(o.feature, map.pyramid()))});
      window.features.push_back(o.feature);
    }
  }
}

void WriteBack(MapEditor& map, const Window& window, const BundleReport& report) {
  for (size_t i = 0; i < window.keyframes.size(); ++i) {
    if (!window.problem.pose_fixed[i]) map.SetPose(*window.keyframes[i], window.problem.T_cam_world[i]);
  }
  for (size_t i = 0; i < window.landmarks.size(); ++i)
    map.SetPosition(*window.landmarks[i], window.problem.points[i]);
  if (report.outliers.size() != window.features.size()) return;
  for (size_t i = 0; i < window.features.size(); ++i) {
    const auto pose = static_cast<size_t>(window.problem.observations[i].pose);
    if (report.outliers[i]) map.ClearObservation(*window.keyframes[pose], window.features[i]);
  }
  for (const Landmark* landmark : window.landmarks) {
    if (landmark->observations.size() < 2) map.RemoveLandmark(*landmark);
  }
}

}  // namespace

MapAdjustmentReport AdjustKeyframes(MapEditor& map, const std::vector<const Keyframe*>& keyframes,
                                    int max_fixed, double sigma_px, const BundleOptions& options) {
  Window window;
  window.problem.camera = map.camera().Ideal();
  for (const Keyframe* keyframe : keyframes) window.AddPose(*keyframe, !keyframe->parent.has_value());
  window.landmarks = LandmarksSeenBy(map, keyframes);
  for (const KeyframeId id : FixedObservers(window, max_fixed)) window.AddPose(map.At(id), true);
  AddObservations(map, sigma_px, window);
  MapAdjustmentReport report;
  report.keyframes = window.free_keyframes;
  report.fixed_keyframes = static_cast<int>(window.keyframes.size()) - window.free_keyframes;
  report.landmarks = static_cast<int>(window.landmarks.size());
  if (window.free_keyframes == 0 || window.landmarks.empty()) return report;
  report.bundle = AdjustBundle(options, window.problem);
  if (report.bundle.usable) WriteBack(map, window, report.bundle);
  return report;
}

MapAdjustmentReport AdjustWholeMap(MapEditor& map, MapId map_id, int iterations, double sigma_px,
                                   const std::function<bool()>& interrupt) {
  BundleOptions bundle = GlobalBundleOptions(iterations);
  bundle.interrupt = interrupt;
  return AdjustKeyframes(map, map.KeyframesOf(map_id), 0, sigma_px, bundle);
}

}  // namespace dmslam
