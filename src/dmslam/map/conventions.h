#pragma once

namespace dmslam {

/// Standard deviation of a keypoint in a bundle adjustment [pixels of its level], of the mapper and after a
/// loop.
inline constexpr double kKeypointSigmaPx = 0.7;
/// Landmarks in common that make two keyframes neighbours.
inline constexpr int kMinCovisibility = 15;
/// So many of a place's neighbours show what is there: a loop is verified by their landmarks, and these are
/// fused when it is closed.
inline constexpr int kPlaceNeighbours = 15;

}  // namespace dmslam
