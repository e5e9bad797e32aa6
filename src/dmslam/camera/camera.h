#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>

#include "dmslam/geometry/pinhole.h"

namespace dmslam {

/// What a lens makes of the ideal image of a pinhole.
enum class Lens : uint8_t {
  /// Brown's distortion: k1, k2, k3 radial, p1, p2 tangential; OpenCV's order and meaning.
  kBrown = 0,
  /// The image grows with the angle to the optical axis instead of its tangent:
  /// r = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
  /// Kannala, Brandt, "A generic camera model and calibration method for conventional, wide-angle, and
  /// fish-eye lenses", PAMI 2006, eq. 6 and OpenCV's `cv::fisheye`; often called equidistant.
  kFisheye = 1,
};

/// Images wider or higher than this are refused.
inline constexpr int kMaxImageSidePx = 4096;

/// Pinhole camera with a lens.
/// Pixels are in the coordinate frame whose origin is the centre of the top left pixel, x right, y down; the
/// camera frame has x right, y down, z forward.
struct Camera {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  double fps = 30.0;  ///< Nominal rate; only for rules that speak of frames per second.
  Lens lens = Lens::kBrown;
  double k4 = 0;  ///< of a fisheye lens alone, which has no p1 and p2

  bool HasDistortion() const {
    return lens == Lens::kFisheye || k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0 || k3 != 0;
  }
  /// The same camera, and images that the lens has been taken out of.
  Camera WithoutLens() const;
  /// Whether a pixel of one is the same ray in the other: all but the rate is equal.
  bool SeesAs(const Camera& other) const;
  bool operator==(const Camera&) const = default;
  Eigen::Matrix3d K() const;
  /// The camera without its lens, for undistorted pixels.
  Pinhole Ideal() const { return {fx_px, fy_px, cx_px, cy_px}; }

  /// The ideal (undistorted) pixel of a point in the camera frame; none for points at or behind the camera.
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& p_cam) const {
    if (!(p_cam.z() > kMinDepth)) return std::nullopt;
    return Eigen::Vector2d(fx_px * p_cam.x() / p_cam.z() + cx_px, fy_px * p_cam.y() / p_cam.z() + cy_px);
  }
  /// Undistorted pixel to the ray through it, with z = 1.
  Eigen::Vector3d Ray(const Eigen::Vector2d& uv_px) const {
    return {(uv_px.x() - cx_px) / fx_px, (uv_px.y() - cy_px) / fy_px, 1.0};
  }
  /// Ideal pixel to the pixel that the lens makes of it, and back (to 1e-9 in normalised coordinates; none
  /// where the distortion cannot be inverted, and beyond 84 degrees from the optical axis).
  Eigen::Vector2d Distort(const Eigen::Vector2d& ideal_px) const;
  std::optional<Eigen::Vector2d> Undistort(const Eigen::Vector2d& raw_px) const;
  /// Whether the ideal image is so much larger than the lens's in places that errors must be told apart.
  bool Stretches() const { return lens == Lens::kFisheye; }
  /// How many times as long as in the lens's image a short line is at an ideal pixel: the geometric mean over
  /// its directions. 1 for a lens that does not stretch.
  double StretchAt(const Eigen::Vector2d& ideal_px) const;

  /// What is wrong with the values, or nothing.
  std::optional<std::string> Problem() const;
};

/// A field of the camera file with its value in each of two cameras, as "fx 525.505".
struct CameraDifference {
  std::string a, b;
};
/// The first field in which they differ; none: they see the same. The rate does not count.
std::optional<CameraDifference> FirstDifference(const Camera& a, const Camera& b);

/// Reads a camera file (YAML: width, height, fx, fy, cx, cy, optional distortion [k1, k2, p1, p2, k3], fps
/// and model; of the model "fisheye", distortion [k1, k2, k3, k4]). Throws InputError that names file, field
/// and cure; a model other than "pinhole" and "fisheye" is refused by name.
Camera LoadCamera(const std::string& path);

/// The text of a camera file that LoadCamera reads.
std::string CameraText(const Camera& camera);

}  // namespace dmslam
