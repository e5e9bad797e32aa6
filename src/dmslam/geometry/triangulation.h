#pragma once

#include <Eigen/Core>
#include <optional>

#include "dmslam/geometry/rigid3.h"

namespace dmslam {

/// Angle [rad] between two directions (any length, not zero).
double AngleBetweenRays(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// Parallax [rad]: the angle at `p_world` between the lines to the two camera centres.
double ParallaxAngle(const Eigen::Vector3d& center1_world, const Eigen::Vector3d& center2_world,
                     const Eigen::Vector3d& p_world);

/// The point seen along `ray1` by camera 1 and along `ray2` by camera 2 (rays in their camera's frame, any
/// length), in world coordinates. Closed form: the inverse-depth weighted midpoint of Lee and Civera,
/// "Triangulation: Why optimize?" (BMVC 2019), Eq. 8-10; nearly as good as the optimum in reprojection, and
/// sound at small parallax, where the algebraic method is not. None if the rays are parallel (to 1e-7 rad),
/// or the point lies behind a camera.
std::optional<Eigen::Vector3d> TriangulatePoint(const Rigid3d& T_cam1_world, const Rigid3d& T_cam2_world,
                                                const Eigen::Vector3d& ray1, const Eigen::Vector3d& ray2);

/// The same in the frame of camera 1, from the relative pose.
std::optional<Eigen::Vector3d> TriangulatePointInFirst(const Rigid3d& T_cam2_cam1,
                                                       const Eigen::Vector3d& ray1,
                                                       const Eigen::Vector3d& ray2);

}  // namespace dmslam
