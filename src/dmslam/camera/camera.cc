#include "dmslam/camera/camera.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

/// Normalised ideal coordinates to normalised distorted ones (Brown 1971, as OpenCV writes it).
Eigen::Vector2d DistortNormalized(const Camera& c, const Eigen::Vector2d& n) {
  const double x = n.x(), y = n.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  return {x * radial + 2.0 * c.p1 * x * y + c.p2 * (r2 + 2.0 * x * x),
          y * radial + c.p1 * (r2 + 2.0 * y * y) + 2.0 * c.p2 * x * y};
}

double ReadNumber(const YAML::Node& node, const std::string& path, const std::string& field) {
  if (!node[field])
    throw InputError(path + ": field '" + field + "' is missing; add it (see docs/camera.md)");
  try {
    return node[field].as<double>();
  } catch (const YAML::Exception&) {
    throw InputError(path + ": field '" + field + "' is not a number; write one (see docs/camera.md)");
  }
}

void ReadDistortion(const YAML::Node& node, const std::string& path, Camera& camera) {
  if (!node["distortion"]) return;
  std::vector<double> values;
  try {
    values = node["distortion"].as<std::vector<double>>();
  } catch (const YAML::Exception&) {
    throw InputError(path + ": field 'distortion' is not a list of numbers; write [k1, k2, p1, p2, k3]");
  }
  if (values.size() != 4 && values.size() != 5) {
    throw InputError(path + ": field 'distortion' has " + std::to_string(values.size()) +
                     " values; write four or five: [k1, k2, p1, p2, k3]");
  }
  values.resize(5, 0.0);
  camera.k1 = values[0];
  camera.k2 = values[1];
  camera.p1 = values[2];
  camera.p2 = values[3];
  camera.k3 = values[4];
}

constexpr const char* kConvert = "convert it with scripts/convert_camera.sh (dmslam-convert-camera)";

/// Whether the file begins as OpenCV writes YAML, which no reader of YAML takes.
bool IsOpenCvFile(const std::string& path) {
  std::string line;
  return std::getline(std::ifstream(path), line) && line.starts_with("%YAML:");
}

/// A slip in a field's name must not pass for a field that was left out.
void RefuseUnknownFields(const YAML::Node& node, const std::string& path) {
  static constexpr std::array kKnown = {"model", "width", "height",     "fx", "fy",
                                        "cx",    "cy",    "distortion", "fps"};
  for (const auto& entry : node) {
    const std::string name = entry.first.as<std::string>("");
    if (std::find(kKnown.begin(), kKnown.end(), name) != kKnown.end()) continue;
    if (name.starts_with("Camera") || name == "camera_matrix" || name == "intrinsics") {
      throw InputError(path + ": field '" + name + "' is that of another program's camera file; " + kConvert);
    }
    throw InputError(path + ": field '" + name + "' is not known; correct or remove it (see docs/camera.md)");
  }
}

int ReadWhole(const YAML::Node& node, const std::string& path, const std::string& field) {
  const double value = ReadNumber(node, path, field);
  if (std::isfinite(value) && value == std::floor(value) && std::abs(value) < 1e6)
    return static_cast<int>(value);
  throw InputError(path + ": field '" + field +
                   "' is not a whole number of pixels; write one (see docs/camera.md)");
}

YAML::Node LoadYaml(const std::string& path) {
  if (IsOpenCvFile(path)) throw InputError(path + ": is another program's camera file; " + kConvert);
  try {
    YAML::Node node = YAML::LoadFile(path);
    if (!node.IsMap()) throw InputError(path + ": is not a map of fields; see docs/camera.md for an example");
    return node;
  } catch (const YAML::BadFile&) {
    throw InputError(path + ": cannot be read; check the path given with --camera");
  } catch (const YAML::Exception& error) {
    throw InputError(path + ": is not valid YAML (" + error.what() + "); see docs/camera.md for an example");
  }
}

}  // namespace

Eigen::Matrix3d Camera::K() const {
  Eigen::Matrix3d k;
  k << fx_px, 0, cx_px, 0, fy_px, cy_px, 0, 0, 1;
  return k;
}

Camera Camera::WithoutLens() const {
  Camera camera = *this;
  camera.k1 = camera.k2 = camera.p1 = camera.p2 = camera.k3 = 0;
  return camera;
}

bool Camera::SeesAs(const Camera& other) const {
  Camera at_this_rate = other;
  at_this_rate.fps = fps;
  return *this == at_this_rate;
}

Eigen::Vector2d Camera::Distort(const Eigen::Vector2d& ideal_px) const {
  const Eigen::Vector2d n((ideal_px.x() - cx_px) / fx_px, (ideal_px.y() - cy_px) / fy_px);
  const Eigen::Vector2d d = DistortNormalized(*this, n);
  return {fx_px * d.x() + cx_px, fy_px * d.y() + cy_px};
}

std::optional<Eigen::Vector2d> Camera::Undistort(const Eigen::Vector2d& raw_px) const {
  if (!HasDistortion()) return raw_px;
  const Eigen::Vector2d target((raw_px.x() - cx_px) / fx_px, (raw_px.y() - cy_px) / fy_px);
  Eigen::Vector2d n = target;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector2d residual = target - DistortNormalized(*this, n);
    n += residual;
    if (!n.allFinite() || n.squaredNorm() > 100.0) return std::nullopt;
    if (residual.squaredNorm() < 1e-18) return Eigen::Vector2d(fx_px * n.x() + cx_px, fy_px * n.y() + cy_px);
  }
  return std::nullopt;
}

std::optional<std::string> Camera::Problem() const {
  if (width_px < 32 || height_px < 32 || width_px > 4096 || height_px > 4096) {
    return "field 'width' or 'height' is outside 32..4096 pixels";
  }
  if (!(fx_px > 0) || !(fy_px > 0)) return "field 'fx' or 'fy' is not positive";
  if (!(fx_px < 1e5) || !(fy_px < 1e5)) return "field 'fx' or 'fy' is too large";
  if (!(cx_px > 0 && cx_px < width_px)) return "field 'cx' lies outside the image";
  if (!(cy_px > 0 && cy_px < height_px)) return "field 'cy' lies outside the image";
  for (const double value : {k1, k2, p1, p2, k3}) {
    if (!std::isfinite(value)) return "field 'distortion' holds a value that is not finite";
  }
  if (!(fps > 0 && fps <= 1000)) return "field 'fps' is outside 0..1000";
  return std::nullopt;
}

Camera LoadCamera(const std::string& path) {
  const YAML::Node node = LoadYaml(path);
  if (node["model"] && node["model"].as<std::string>("") != "pinhole") {
    throw InputError(path + ": field 'model' is '" + node["model"].as<std::string>("") +
                     "', which is not supported; undistort to a pinhole camera first (see docs/camera.md)");
  }
  RefuseUnknownFields(node, path);
  Camera camera;
  camera.width_px = ReadWhole(node, path, "width");
  camera.height_px = ReadWhole(node, path, "height");
  camera.fx_px = ReadNumber(node, path, "fx");
  camera.fy_px = ReadNumber(node, path, "fy");
  camera.cx_px = ReadNumber(node, path, "cx");
  camera.cy_px = ReadNumber(node, path, "cy");
  if (node["fps"]) camera.fps = ReadNumber(node, path, "fps");
  ReadDistortion(node, path, camera);
  if (const auto problem = camera.Problem())
    throw InputError(path + ": " + *problem + "; correct it (see docs/camera.md)");
  return camera;
}

std::string CameraText(const Camera& camera) {
  std::ostringstream text;
  text.precision(12);
  text << "model: pinhole\nwidth: " << camera.width_px << "\nheight: " << camera.height_px
       << "\nfx: " << camera.fx_px << "\nfy: " << camera.fy_px << "\ncx: " << camera.cx_px
       << "\ncy: " << camera.cy_px << "\n";
  if (camera.HasDistortion()) {
    text << "distortion: [" << camera.k1 << ", " << camera.k2 << ", " << camera.p1 << ", " << camera.p2
         << ", " << camera.k3 << "]\n";
  }
  text << "fps: " << camera.fps << "\n";
  return text.str();
}

}  // namespace dmslam
