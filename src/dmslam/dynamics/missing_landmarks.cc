#include "dmslam/dynamics/missing_landmarks.h"

#include <algorithm>

namespace dmslam {

WitnessGrid::WitnessGrid(const Camera& camera)
    : cell_width_px_(static_cast<double>(camera.width_px) / kColumns),
      cell_height_px_(static_cast<double>(camera.height_px) / kRows) {}

void WitnessGrid::Clear() {
  for (auto& cell : cells_) cell.clear();
}

void WitnessGrid::Add(const Witness& witness) {
  cells_[Index(Column(witness.uv_px.x()), Row(witness.uv_px.y()))].push_back(witness);
}

int WitnessGrid::Column(double x) const {
  return std::clamp(static_cast<int>(x / cell_width_px_), 0, kColumns - 1);
}

int WitnessGrid::Row(double y) const {
  return std::clamp(static_cast<int>(y / cell_height_px_), 0, kRows - 1);
}

void MissingLandmarks::CallWitnesses(const Map& map, const TrackedFrame& frame,
                                     std::span<const LandmarkId> moved) {
  witnesses_.Clear();
  known_.Clear();
  for (const LandmarkId id : moved) known_.Add(id);
  for (size_t i = 0; i < frame.landmarks.size(); ++i) {
    if (!frame.landmarks[i].valid()) continue;
    known_.Add(frame.landmarks[i]);
    const double depth = (frame.T_cam_world * map.At(frame.landmarks[i]).p_world).z();
    witnesses_.Add({frame.features->uv_px[i], depth, false});
  }
  for (const LandmarkId id : moved) {
    const Eigen::Vector3d p_cam = frame.T_cam_world * map.At(id).p_world;
    if (const auto uv = map.camera().Project(p_cam)) witnesses_.Add({*uv, p_cam.z(), true});
  }
  known_.Finish();
}

MissingLandmarks::Verdict MissingLandmarks::AskAround(const LandmarkView& view) const {
  int behind = 0, beside = 0, before = 0, moving_beside = 0;
  witnesses_.ForEachNear(view.uv_px, reach_px_, [&](const Witness& witness) {
    const bool farther = witness.depth > kSeenThroughDepth * view.depth;
    const bool nearer = witness.depth * kSeenThroughDepth < view.depth;
    if (witness.moves) {
      if (!farther && !nearer) ++moving_beside;
      if (nearer) ++before;
      return;
    }
    ++(farther ? behind : nearer ? before : beside);
  });
  const bool seen_through = behind >= kSeenThroughMin && beside == 0;
  const bool goes_with_others = moving_beside >= kMovingTogetherMin && moving_beside > 2 * beside;
  if (seen_through || goes_with_others) return Verdict::kGone;
  return before > 0 && beside == 0 ? Verdict::kHidden : Verdict::kNone;
}

void MissingLandmarks::Judge(const Map& map, const TrackedFrame& frame,
                             std::span<const ExpectedLandmark> expected, std::span<const LandmarkId> moved) {
  CallWitnesses(map, frame, moved);
  gone_.clear();
  hidden_.clear();
  for (const auto& [landmark, view] : expected) {
    if (known_.Holds(landmark->id)) continue;
    const Verdict verdict = AskAround(view);
    if (verdict == Verdict::kGone) gone_.push_back(landmark->id);
    if (verdict == Verdict::kHidden) hidden_.push_back(landmark->id);
  }
}

}  // namespace dmslam
