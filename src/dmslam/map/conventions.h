#pragma once

namespace dmslam {

/// Standard deviation of a keypoint of octave 0 in a bundle adjustment [px], of the mapper and after a loop.
inline constexpr double kKeypointSigmaPx = 0.7;
/// Landmarks in common that make two keyframes neighbours.
inline constexpr int kMinCovisibility = 15;

}  // namespace dmslam
