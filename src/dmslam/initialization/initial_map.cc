#include "dmslam/initialization/initial_map.h"

#include <algorithm>
#include <utility>

#include "dmslam/optimization/bundle_adjustment.h"

namespace dmslam {
namespace {

constexpr int kIterations = 15;
constexpr size_t kViewsBetween = 2;
constexpr size_t kMostFeatures = 20'000;  // of all keyframes: what fits into a record beside the points

KeyframeProposal ProposalOf(const InitializerFrame& frame, uint32_t session, CameraId camera_id,
                            MapId map_id) {
  KeyframeProposal proposal;
  proposal.id = KeyframeId::Make(session, frame.index, camera_id);
  proposal.camera_id = camera_id;
  proposal.map_id = map_id;
  proposal.stamp_ns = frame.stamp_ns;
  proposal.features = frame.features->set;
  return proposal;
}

InitialMap::View ViewOf(const FirstMap::View& view, KeyframeProposal keyframe, KeyframeId first) {
  InitialMap::View told{std::move(keyframe), {}};
  told.keyframe.reference = first;
  told.keyframe.T_cam_reference = view.T_k_0;
  for (const FirstMap::View::Sight& sight : view.sights)
    told.sights.push_back({static_cast<uint16_t>(sight.point), static_cast<uint16_t>(sight.feature)});
  return told;
}

}  // namespace

AdjustFunction AdjustInitialMap(const Pinhole& camera) {
  return [camera](std::vector<Rigid3d>* T_cam_world, std::vector<Eigen::Vector3d>* points,
                  std::span<const InitialObservation> observations) {
    BundleProblem problem;
    problem.camera = camera;
    problem.T_cam_world = *T_cam_world;
    problem.points = *points;
    for (const InitialObservation& o : observations) {
      problem.observations.push_back({o.pose, o.point, o.uv_px, o.inv_sigma_squared});
    }
    if (!AdjustBundle(GlobalBundleOptions(kIterations), problem).usable) return false;
    *T_cam_world = problem.T_cam_world;
    *points = problem.points;
    return true;
  };
}

InitialMap MakeInitialMap(const FirstMap& first_map, uint32_t session, CameraId camera_id, MapId map_id) {
  InitialMap proposal;
  proposal.map_id = map_id;
  proposal.first = ProposalOf(first_map.frame0, session, camera_id, map_id);
  proposal.second = ProposalOf(first_map.frame1, session, camera_id, map_id);
  proposal.second.reference = proposal.first.id;
  proposal.second.T_cam_reference = first_map.T_1_0;
  for (const FirstMap::Point& point : first_map.points) {
    proposal.points.push_back(
        {static_cast<uint16_t>(point.feature0), static_cast<uint16_t>(point.feature1), point.p_world});
  }
  const size_t asked = std::min(kViewsBetween, first_map.between.size());
  size_t features = proposal.first.features.size() + proposal.second.features.size();
  for (size_t k = 1; k <= asked; ++k) {
    const FirstMap::View& view = first_map.between[k * first_map.between.size() / (asked + 1)];
    features += view.frame.features->size();
    if (features > kMostFeatures) break;
    KeyframeProposal told = ProposalOf(view.frame, session, camera_id, map_id);
    proposal.between.push_back(ViewOf(view, std::move(told), proposal.first.id));
  }
  return proposal;
}

}  // namespace dmslam
