#include "dmslam/optimization/map_adjustment.h"

#include <algorithm>
#include <map>
#include <set>

#include "dmslam/map/neighbourhood.h"

namespace dmslam {
namespace {

/// The bundle problem and whom its rows belong to.
struct Window {
  BundleProblem problem;
  std::vector<KeyframeId> keyframes;
  std::vector<LandmarkId> landmarks;
  struct Source {
    KeyframeId keyframe;
    uint16_t feature = 0;
  };
  std::vector<Source> sources;  ///< parallel to the problem's observations
  std::map<KeyframeId, int> index;
  int free_keyframes = 0;

  int AddPose(const Keyframe& keyframe, bool fixed) {
    const int at = static_cast<int>(keyframes.size());
    keyframes.push_back(keyframe.id);
    index[keyframe.id] = at;
    problem.T_cam_world.push_back(keyframe.T_cam_world);
    problem.pose_fixed.push_back(fixed ? 1 : 0);
    if (!fixed) ++free_keyframes;
    return at;
  }
};

/// Observers outside the window, those that see most of its landmarks first.
std::vector<KeyframeId> FixedObservers(const Map& map, const Window& window, int most) {
  std::map<KeyframeId, int> seen;
  for (const LandmarkId id : window.landmarks) {
    for (const Observation& o : map.FindLandmark(id)->observations) {
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
    const Landmark& landmark = *map.FindLandmark(window.landmarks[point]);
    window.problem.points.push_back(landmark.p_world);
    for (const Observation& o : landmark.observations) {
      const auto pose = window.index.find(o.keyframe);
      if (pose == window.index.end()) continue;
      const FrameFeatures& features = *map.FindKeyframe(o.keyframe)->features;
      const int octave = features.set.keypoints[o.feature].octave;
      window.problem.observations.push_back(
          {pose->second, static_cast<int>(point), features.uv_px[o.feature],
           1.0 / (sigma_px * sigma_px * map.pyramid().SigmaSquared(octave))});
      window.sources.push_back({o.keyframe, o.feature});
    }
  }
}

void WriteBack(MapEditor& map, const Window& window, const BundleReport& report) {
  for (size_t i = 0; i < window.keyframes.size(); ++i) {
    if (!window.problem.pose_fixed[i]) map.SetPose(window.keyframes[i], window.problem.T_cam_world[i]);
  }
  for (size_t i = 0; i < window.landmarks.size(); ++i)
    map.SetPosition(window.landmarks[i], window.problem.points[i]);
  if (report.outliers.size() != window.sources.size()) return;
  for (size_t i = 0; i < window.sources.size(); ++i) {
    if (report.outliers[i]) map.ClearObservation(window.sources[i].keyframe, window.sources[i].feature);
  }
  for (const LandmarkId id : window.landmarks) {
    if (map.FindLandmark(id)->observations.size() < 2) map.RemoveLandmark(id);
  }
}

}  // namespace

MapAdjustmentReport AdjustKeyframes(MapEditor& map, const std::vector<KeyframeId>& keyframes, int max_fixed,
                                    double sigma_px, const BundleOptions& options) {
  Window window;
  window.problem.camera = map.camera().Ideal();
  for (const KeyframeId id : keyframes) {
    const Keyframe& keyframe = *map.FindKeyframe(id);
    window.AddPose(keyframe, !keyframe.parent.valid());
  }
  window.landmarks = LandmarksSeenBy(map, keyframes);
  for (const KeyframeId id : FixedObservers(map, window, max_fixed))
    window.AddPose(*map.FindKeyframe(id), true);
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
  std::vector<KeyframeId> all;
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (keyframe.map_id == map_id) all.push_back(id);
  }
  BundleOptions bundle = GlobalBundleOptions(iterations);
  bundle.interrupt = interrupt;
  return AdjustKeyframes(map, all, 0, sigma_px, bundle);
}

}  // namespace dmslam
