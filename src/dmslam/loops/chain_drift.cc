#include "dmslam/loops/chain_drift.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace dmslam {
namespace {

constexpr double kReferenceShared = 100;

struct Step {
  const Keyframe* before = nullptr;  ///< on the way from the start; null at the start itself
  double cost = std::numeric_limits<double>::infinity();  ///< sum of the links' 1 / shared
  int shared = 0;                                         ///< with `before`
};
using Steps = std::map<KeyframeId, Step>;

/// Calls visit(other, shared) for each link of a keyframe, of the spanning tree also to one that is not
/// there.
template <typename Visit>
void ForEachLink(const Map& map, const Keyframe& keyframe, int min_shared, const Visit& visit) {
  const auto visit_relative = [&](KeyframeId other) {
    const auto it = keyframe.covisible.find(other);
    visit(other, it == keyframe.covisible.end() ? 1 : std::max(1, it->second));
  };
  for (const auto& [other, shared] : keyframe.covisible) {
    if (shared >= min_shared) visit(other, shared);
  }
  if (keyframe.parent) visit_relative(*keyframe.parent);
  for (const KeyframeId child : map.Children(keyframe.id)) visit_relative(child);
}

/// Dijkstra's shortest path, by variance. No way leads on from a keyframe that is not there.
Steps StepsFrom(const Map& map, KeyframeId from, KeyframeId to, int min_shared) {
  Steps steps;
  std::set<std::pair<double, KeyframeId>> open;
  steps[from].cost = 0;
  open.insert({0.0, from});
  while (!open.empty()) {
    const auto [cost, id] = *open.begin();
    open.erase(open.begin());
    if (id == to) break;
    const Keyframe* keyframe = map.FindKeyframe(id);
    if (keyframe == nullptr) continue;
    ForEachLink(map, *keyframe, min_shared, [&, cost = cost](KeyframeId other, int shared) {
      const double longer = cost + 1.0 / shared;
      Step& step = steps[other];
      if (longer >= step.cost) return;
      open.erase({step.cost, other});
      step = {keyframe, longer, shared};
      open.insert({longer, other});
    });
  }
  return steps;
}

}  // namespace

std::optional<ChainDrift> DriftAlongChain(const Map& map, const Keyframe& from, const Keyframe& to,
                                          const ChainDriftOptions& options) {
  const Steps steps = StepsFrom(map, from.id, to.id, options.min_shared);
  if (!steps.contains(to.id)) return std::nullopt;
  const Eigen::Vector3d end = to.T_cam_world.Center();
  double rotation = 0, position = 0, scale = 0;  // variances
  ChainDrift drift;
  for (const Keyframe* at = &to; at != &from;) {
    const Step& step = steps.at(at->id);
    const double weakness = kReferenceShared / step.shared;
    const double lever = (end - step.before->T_cam_world.Center()).norm();
    const double shift = options.link_position * map.MedianDepth(*at).value_or(0.0);
    const double turn = std::pow(options.link_rotation_rad, 2), growth = std::pow(options.link_log_scale, 2);
    rotation += weakness * turn;
    scale += weakness * growth;
    position += weakness * (shift * shift + (turn + growth) * lever * lever);
    ++drift.links;
    at = step.before;
  }
  drift.rotation_rad = std::sqrt(rotation);
  drift.position = std::sqrt(position);
  drift.log_scale = std::sqrt(scale);
  return drift;
}

double SigmasOf(const ChainDrift& drift, const Rigid3d& T_cam_world, const Sim3d& S_cam_world) {
  const auto ratio = [](double value, double sigma) {
    return sigma > 0 ? value / sigma : std::numeric_limits<double>::infinity();
  };
  const Rigid3d moved = S_cam_world.ToRigid();
  return std::max({ratio((moved.Center() - T_cam_world.Center()).norm(), drift.position),
                   ratio(AngleBetween(moved.rotation, T_cam_world.rotation), drift.rotation_rad),
                   ratio(std::abs(std::log(S_cam_world.scale)), drift.log_scale)});
}

}  // namespace dmslam
