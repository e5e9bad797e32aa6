#include "dmslam/initialization/initial_map.h"

#include "dmslam/optimization/bundle_adjustment.h"

namespace dmslam {
namespace {

constexpr int kIterations = 15;

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

}  // namespace

AdjustFunction AdjustInitialMap(const Pinhole& camera) {
  return [camera](std::vector<Rigid3d>* T_cam_world, std::vector<Eigen::Vector3d>* points,
                  std::span<const InitialObservation> observations) {
    BundleProblem problem;
    problem.camera = camera;
    problem.T_cam_world = *T_cam_world;
    problem.pose_fixed.assign(T_cam_world->size(), 0);
    problem.pose_fixed.front() = 1;
    problem.points = *points;
    for (const InitialObservation& o : observations) {
      problem.observations.push_back({o.pose, o.point, o.uv_px, o.inv_sigma_squared});
    }
    const BundleReport report = AdjustBundle(GlobalBundleOptions(kIterations), problem);
    if (!report.usable) return false;
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
  return proposal;
}

}  // namespace dmslam
