#include "dmslam/refinement/leaps.h"

#include <algorithm>
#include <cmath>

namespace dmslam {
namespace {

// What a carried camera's motion changes by, at most.
constexpr double kDepthsPerS2 = 4.0, kRadPerS2 = 20.0;
constexpr double kSigmas = 2.0;  // by which poses may be wrong besides

double SecondsFrom(const SeenFrom& a, const SeenFrom& b) {
  return static_cast<double>(b.stamp_ns - a.stamp_ns) * 1e-9;
}

double Apart(const Rigid3d& a, const Rigid3d& b) { return (a.Center() - b.Center()).norm(); }

/// Whether they are no farther from one another than that, in depths of the scene and in angle.
bool AreNear(const Rigid3d& a, const Rigid3d& b, double depth, double distance, double angle_rad) {
  return Apart(a, b) <= distance * depth && AngleBetween(a.rotation, b.rotation) <= angle_rad;
}

/// Whether a camera may have gone from one to the other.
bool IsWay(const SeenFrom& a, const SeenFrom& b, const MotionModelOptions& motion) {
  const double seconds = std::abs(SecondsFrom(a, b)), wrong = kSigmas * std::hypot(*a.spread, *b.spread);
  return AreNear(a.T_cam_world, b.T_cam_world, std::max(a.depth, b.depth),
                 wrong + motion.speed_slack + motion.max_speed * seconds,
                 wrong + motion.turn_slack_rad + motion.max_turn_rad_per_s * seconds);
}

/// Whether the motion from `a` to `b`, carried on (or back), leads to `c`.
bool LeadsTo(const SeenFrom& a, const SeenFrom& b, const SeenFrom& c, const MotionModelOptions& motion) {
  const double steps = SecondsFrom(b, c) / SecondsFrom(a, b);
  const Eigen::Vector3d turn_rad =
      LogSo3((b.T_cam_world.rotation * a.T_cam_world.rotation.conjugate()).normalized());
  const Eigen::Vector3d center =
      b.T_cam_world.Center() + steps * (b.T_cam_world.Center() - a.T_cam_world.Center());
  const Eigen::Quaterniond rotation = ExpSo3(steps * turn_rad) * b.T_cam_world.rotation;
  const Rigid3d expected(rotation, -(rotation * center));
  const double wrong = kSigmas * std::hypot((1.0 + steps) * *b.spread, steps * *a.spread, *c.spread);
  const double squared_s2 = SecondsFrom(b, c) * SecondsFrom(b, c);
  return AreNear(expected, c.T_cam_world, std::max(b.depth, c.depth),
                 wrong + motion.speed_slack + kDepthsPerS2 * squared_s2,
                 wrong + motion.turn_slack_rad + kRadPerS2 * squared_s2);
}

/// Between frames that are known there may be some that are not: the leap is where these lie farthest apart.
size_t WidestStep(std::span<const SeenFrom> frames, size_t before, size_t after) {
  const auto step = [&](size_t k) { return Apart(frames[k - 1].T_cam_world, frames[k].T_cam_world); };
  size_t widest = after;
  for (size_t k = before + 1; k < after; ++k) {
    if (step(k) > step(widest)) widest = k;
  }
  return widest;
}

}  // namespace

std::vector<uint8_t> FindLeaps(std::span<const SeenFrom> frames, const MotionModelOptions& motion) {
  std::vector<uint8_t> leaps(frames.size(), 0);
  std::vector<size_t> known;
  for (size_t k = 0; k < frames.size(); ++k) {
    if (frames[k].spread) known.push_back(k);
  }
  for (size_t i = 1; i + 2 < known.size(); ++i) {
    const SeenFrom &a = frames[known[i - 1]], &b = frames[known[i]];
    const SeenFrom &c = frames[known[i + 1]], &d = frames[known[i + 2]];
    if (!IsWay(a, b, motion) || !IsWay(c, d, motion)) continue;
    if (!LeadsTo(a, b, c, motion) && !LeadsTo(d, c, b, motion))
      leaps[WidestStep(frames, known[i], known[i + 1])] = 1;
  }
  return leaps;
}

}  // namespace dmslam
