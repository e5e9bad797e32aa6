#include "dmslam/mapping/landmark_creation.h"

#include <algorithm>

#include "dmslam/camera/image_scale.h"

namespace dmslam {
namespace {

/// Features without a landmark that were not seen to move.
std::vector<uint8_t> FreeStillFeatures(const Keyframe& keyframe, const std::vector<uint16_t>& moving,
                                       CreationDiagnostics* diagnostics) {
  std::vector<uint8_t> use = FreeFeatures(keyframe);
  for (const uint16_t feature : moving) {
    if (feature >= use.size() || use[feature] == 0) continue;
    use[feature] = 0;
    ++diagnostics->refused_motion;
  }
  return use;
}

/// The gate of Algorithm 1: one candidate per neighbourhood, at most alpha * Ln of them.
class MutualExclusion {
 public:
  MutualExclusion(const LandmarkCreationOptions& options, const Camera& camera, int tracked_landmarks)
      : options_(options),
        neighbourhood_px_(options.neighbourhood_rad * FocalPx(camera)),
        limit_(std::max(options.min_candidates, static_cast<int>(options.alpha * tracked_landmarks))) {}

  bool Admit(const Eigen::Vector2d& uv_px, CreationDiagnostics* diagnostics) {
    if (!options_.mutual_exclusion) return true;
    if (static_cast<int>(accepted_.size()) >= limit_) {
      ++diagnostics->refused_count;
      return false;
    }
    for (const Eigen::Vector2d& other : accepted_) {
      if ((uv_px - other).cwiseAbs().maxCoeff() <= neighbourhood_px_) {
        ++diagnostics->refused_neighbourhood;
        return false;
      }
    }
    accepted_.push_back(uv_px);
    return true;
  }

 private:
  const LandmarkCreationOptions& options_;
  double neighbourhood_px_;
  int limit_;
  std::vector<Eigen::Vector2d> accepted_;
};

bool IsConfirmed(const KeyframePoint& point, const LandmarkCreationOptions& options) {
  return options.confirmed_views > 0 &&
         static_cast<int>(point.seen_by.size()) + 1 >= options.confirmed_views &&
         static_cast<double>(point.span_ns) * 1e-9 >= options.confirmed_span_s;
}

}  // namespace

CreationDiagnostics& CreationDiagnostics::operator+=(const CreationDiagnostics& other) {
  refused_motion += other.refused_motion;
  matched += other.matched;
  refused_parallax += other.refused_parallax;
  refused_depth += other.refused_depth;
  refused_reprojection += other.refused_reprojection;
  refused_scale += other.refused_scale;
  refused_neighbourhood += other.refused_neighbourhood;
  refused_count += other.refused_count;
  created += other.created;
  return *this;
}

std::vector<KeyframePoint> ProposeLandmarks(const Map& map, const Keyframe& keyframe,
                                            const std::vector<uint16_t>& moving,
                                            const LandmarkCreationOptions& options,
                                            CreationDiagnostics* diagnostics) {
  std::vector<KeyframePoint> candidates = TriangulateKeyframe(
      map, keyframe, FreeStillFeatures(keyframe, moving, diagnostics), options.triangulation, diagnostics);
  std::stable_sort(candidates.begin(), candidates.end(), [](const KeyframePoint& a, const KeyframePoint& b) {
    return a.seen_by.size() > b.seen_by.size();
  });
  MutualExclusion gate(options, map.camera(), map.CountTracked(keyframe, 1));
  std::vector<KeyframePoint> proposed;
  for (const KeyframePoint& candidate : candidates) {
    const Eigen::Vector2d& uv_px = keyframe.features->uv_px[candidate.feature];
    if (IsConfirmed(candidate, options) || gate.Admit(uv_px, diagnostics)) proposed.push_back(candidate);
  }
  diagnostics->created += static_cast<uint32_t>(proposed.size());
  return proposed;
}

void CreateLandmarks(MapEditor& map, const Keyframe& keyframe, const std::vector<uint16_t>& moving,
                     const LandmarkCreationOptions& options, LandmarkMaker& maker,
                     CreationDiagnostics* diagnostics) {
  const auto taken = [](const NeighbourFeature& seen_by) {
    return seen_by.keyframe->landmarks[seen_by.feature].valid();
  };
  for (const KeyframePoint& proposed : ProposeLandmarks(map, keyframe, moving, options, diagnostics)) {
    if (taken(proposed.seen_by.front())) continue;
    const Landmark& landmark = maker.Add(map, keyframe, keyframe, proposed.p_world);
    map.SetObservation(keyframe, proposed.feature, landmark);
    for (const NeighbourFeature& seen_by : proposed.seen_by) {
      if (!taken(seen_by)) map.SetObservation(*seen_by.keyframe, seen_by.feature, landmark);
    }
    map.UpdateDescriptor(landmark);
  }
}

}  // namespace dmslam
