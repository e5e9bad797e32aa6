#include "dmslam/refinement/leaps.h"

#include <algorithm>

namespace dmslam {
namespace {

constexpr double kSurely = 2.0;  // so many times as far as a carried camera goes is no motion

double DistanceBetween(const SeenFrom& a, const SeenFrom& b) {
  return (a.T_cam_world.Center() - b.T_cam_world.Center()).norm();
}

/// Whether a camera may have gone `times` as far as from one to the other.
bool IsWay(const SeenFrom& a, const SeenFrom& b, const MotionModelOptions& motion, double times) {
  const double seconds = static_cast<double>(b.stamp_ns - a.stamp_ns) * 1e-9;
  const double distance = motion.speed_slack + motion.max_speed * seconds;
  const double angle_rad = motion.turn_slack_rad + motion.max_turn_rad_per_s * seconds;
  return DistanceBetween(a, b) <= times * distance * std::max(a.depth, b.depth) &&
         AngleBetween(a.T_cam_world.rotation, b.T_cam_world.rotation) <= times * angle_rad;
}

/// Between frames that are known there may be some that are not: the leap is where these lie farthest apart.
size_t WidestStep(std::span<const SeenFrom> frames, size_t before, size_t after) {
  size_t widest = after;
  for (size_t k = before + 1; k < after; ++k) {
    if (DistanceBetween(frames[k - 1], frames[k]) > DistanceBetween(frames[widest - 1], frames[widest]))
      widest = k;
  }
  return widest;
}

}  // namespace

std::vector<uint8_t> FindLeaps(std::span<const SeenFrom> frames, const MotionModelOptions& motion) {
  std::vector<uint8_t> leaps(frames.size(), 0);
  std::vector<size_t> known;
  for (size_t k = 0; k < frames.size(); ++k) {
    if (frames[k].known) known.push_back(k);
  }
  const auto is_way = [&](size_t i, size_t j, double times) {
    return IsWay(frames[known[i]], frames[known[j]], motion, times);
  };
  for (size_t i = 1; i + 2 < known.size(); ++i) {
    if (is_way(i, i + 1, kSurely) || is_way(i - 1, i + 1, kSurely) || is_way(i, i + 2, kSurely) ||
        is_way(i - 1, i + 2, kSurely))
      continue;
    if (is_way(i - 1, i, 1.0) && is_way(i + 1, i + 2, 1.0))
      leaps[WidestStep(frames, known[i], known[i + 1])] = 1;
  }
  return leaps;
}

}  // namespace dmslam
