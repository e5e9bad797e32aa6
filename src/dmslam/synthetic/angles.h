#pragma once

#include <cmath>
#include <numbers>

namespace dmslam {

inline constexpr double kPi = std::numbers::pi;
inline constexpr float kPiF = std::numbers::pi_v<float>;

/// Into [-pi, pi].
inline double WrapAngle(double angle) { return std::remainder(angle, 2.0 * kPi); }

}  // namespace dmslam
