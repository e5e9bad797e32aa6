#include "dmslam/loops/sightings.h"

#include <algorithm>
#include <cmath>

namespace dmslam {
namespace {

constexpr size_t kMostKept = 200;
constexpr double kMaxAngle = 0.05;        // [rad] between where two of them put the camera
constexpr double kMaxShareOfDepth = 0.1;  // the same of the position
constexpr double kMaxScaleDifference = 0.1;

/// Of two maps: takes the world of the first into that of the second.
struct Tie {
  MapId from = 0, to = 0;
  Sim3d S_to_from;
};

Tie TieOf(const Keyframe& keyframe, const Keyframe& place, const Sim3d& S_keyframe_place) {
  const Sim3d S_keyframe_to = S_keyframe_place * Sim3d(place.T_cam_world);
  return {keyframe.map_id, place.map_id, S_keyframe_to.Inverse() * Sim3d(keyframe.T_cam_world)};
}

/// Whether both put the camera `T_cam_from` at the same place in the other map, with the same unit of length.
bool SaySame(const Tie& a, const Tie& b, const Rigid3d& T_cam_from, double depth) {
  const Sim3d S_cam_a = Sim3d(T_cam_from) * a.S_to_from.Inverse();
  const Sim3d S_cam_b = Sim3d(T_cam_from) * b.S_to_from.Inverse();
  const Rigid3d in_a = S_cam_a.ToRigid(), in_b = S_cam_b.ToRigid();
  return AngleBetween(in_a.rotation, in_b.rotation) < kMaxAngle &&
         (in_a.Center() - in_b.Center()).norm() < kMaxShareOfDepth * depth &&
         std::abs(std::log(S_cam_a.scale / S_cam_b.scale)) < kMaxScaleDifference;
}

}  // namespace

void Sightings::Add(const LoopClaim& claim) {
  std::erase_if(claims_, [&](const LoopClaim& other) { return other.keyframe == claim.keyframe; });
  claims_.push_back(claim);
  if (claims_.size() > kMostKept) claims_.pop_front();
}

bool Sightings::BearOut(const Map& map, const VerifiedLoop& loop, const JoiningOptions& options) const {
  const Keyframe &keyframe = *loop.keyframe, &place = *loop.place;
  if (keyframe.map_id == place.map_id) return false;
  const Tie tie = TieOf(keyframe, place, loop.S_keyframe_place);
  const double depth = map.MedianDepth(place).value_or(0.0);
  int others = 0;
  int64_t first_ns = keyframe.stamp_ns, last_ns = keyframe.stamp_ns;
  for (const LoopClaim& claim : claims_) {
    const Keyframe* other = map.FindKeyframe(claim.keyframe);
    const Keyframe* its_place = map.FindKeyframe(claim.place);
    if (other == nullptr || its_place == nullptr || other == &keyframe) continue;
    Tie its = TieOf(*other, *its_place, claim.S_keyframe_place);
    if (its.from == tie.to && its.to == tie.from) its = {its.to, its.from, its.S_to_from.Inverse()};
    if (its.from != tie.from || its.to != tie.to) continue;
    if (!SaySame(tie, its, keyframe.T_cam_world, depth)) continue;
    ++others;
    first_ns = std::min(first_ns, other->stamp_ns);
    last_ns = std::max(last_ns, other->stamp_ns);
  }
  return others >= options.sightings && static_cast<double>(last_ns - first_ns) * 1e-9 >= options.sightings_s;
}

}  // namespace dmslam
