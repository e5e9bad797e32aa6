#include "dmslam/camera/camera.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/util/check.h"
#include "dmslam/util/yaml_error.h"

namespace dmslam {
namespace {

constexpr int kMinImageSidePx = 32;
constexpr double kMaxRadiusSquared = 100.0;  // of normalised ideal coordinates: 84 degrees from the axis

/// Normalised ideal coordinates to normalised distorted ones (Brown 1971, as OpenCV writes it).
Eigen::Vector2d DistortBrown(const Camera& c, const Eigen::Vector2d& n) {
  const double x = n.x(), y = n.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  return {x * radial + 2.0 * c.p1 * x * y + c.p2 * (r2 + 2.0 * x * x),
          y * radial + c.p1 * (r2 + 2.0 * y * y) + 2.0 * c.p2 * x * y};
}

/// Where a fisheye lens puts the angle theta to the optical axis: the distance from the image's centre, and
/// how fast it grows there.
struct FisheyeRadius {
  double value, slope;
};

FisheyeRadius RadiusOf(const Camera& c, double theta) {
  const double t2 = theta * theta;
  return {theta * (1.0 + t2 * (c.k1 + t2 * (c.k2 + t2 * (c.k3 + t2 * c.k4)))),
          1.0 + t2 * (3.0 * c.k1 + t2 * (5.0 * c.k2 + t2 * (7.0 * c.k3 + t2 * 9.0 * c.k4)))};
}

Eigen::Vector2d DistortFisheye(const Camera& c, const Eigen::Vector2d& n) {
  const double r = n.norm();
  return r > 0.0 ? Eigen::Vector2d(n * (RadiusOf(c, std::atan(r)).value / r)) : n;
}

/// The angle that a fisheye lens puts at `radius`, by Newton's method; none where there is none.
std::optional<double> AngleAt(const Camera& c, double radius) {
  double theta = std::min(radius, std::atan(std::sqrt(kMaxRadiusSquared)));  // where it still grows (Folds)
  for (int i = 0; i < 50; ++i) {
    const FisheyeRadius there = RadiusOf(c, theta);
    if (!(there.slope > 0.0)) return std::nullopt;
    const double step = (radius - there.value) / there.slope;
    theta += step;
    if (std::abs(step) < 1e-12) return theta;
  }
  return std::nullopt;
}

std::optional<Eigen::Vector2d> UndistortFisheye(const Camera& c, const Eigen::Vector2d& distorted) {
  const double radius = distorted.norm();
  if (!(radius > 0.0)) return distorted;
  const std::optional<double> theta = AngleAt(c, radius);
  if (!theta || !(*theta >= 0.0 && *theta < 0.5 * std::numbers::pi)) return std::nullopt;
  const Eigen::Vector2d n = distorted * (std::tan(*theta) / radius);
  return n.squaredNorm() <= kMaxRadiusSquared ? std::optional(n) : std::nullopt;
}

/// By iteration to a fixed point.
std::optional<Eigen::Vector2d> UndistortBrown(const Camera& c, const Eigen::Vector2d& distorted) {
  Eigen::Vector2d n = distorted;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector2d residual = distorted - DistortBrown(c, n);
    n += residual;
    if (!n.allFinite() || n.squaredNorm() > kMaxRadiusSquared) return std::nullopt;
    if (residual.squaredNorm() < 1e-18) return n;
  }
  return std::nullopt;
}

/// Whether a fisheye lens puts every angle at a place of its own, up to 84 degrees or the image's farthest
/// corner.
bool Folds(const Camera& c) {
  const double x = std::max(c.cx_px, c.width_px - c.cx_px) / c.fx_px;
  const double y = std::max(c.cy_px, c.height_px - c.cy_px) / c.fy_px;
  const double corner = std::hypot(x, y);
  constexpr double kStep = 0.01;
  for (double theta = 0.0; theta < std::atan(std::sqrt(kMaxRadiusSquared)); theta += kStep) {
    const FisheyeRadius radius = RadiusOf(c, theta);
    if (!(radius.slope > 0.0)) return true;
    if (radius.value > corner) return false;
  }
  return false;
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

/// `form` is how the list is to be written; it has `least` to `most` values.
std::vector<double> ReadCoefficients(const YAML::Node& node, const std::string& path, size_t least,
                                     size_t most, const std::string& form) {
  std::vector<double> values;
  try {
    values = node["distortion"].as<std::vector<double>>();
  } catch (const YAML::Exception&) {
    throw InputError(path + ": field 'distortion' is not a list of numbers; write " + form);
  }
  if (values.size() >= least && values.size() <= most) return values;
  throw InputError(path + ": field 'distortion' has " + std::to_string(values.size()) + " values; write " +
                   (least == most ? "four: " : "four or five: ") + form);
}

void ReadFisheye(const YAML::Node& node, const std::string& path, Camera& camera) {
  camera.lens = Lens::kFisheye;
  const std::string form = "[k1, k2, k3, k4]";
  if (!node["distortion"])
    throw InputError(path + ": field 'distortion' is missing; a fisheye lens needs it: " + form);
  const std::vector<double> values = ReadCoefficients(node, path, 4, 4, form);
  camera.k1 = values[0];
  camera.k2 = values[1];
  camera.k3 = values[2];
  camera.k4 = values[3];
}

void ReadDistortion(const YAML::Node& node, const std::string& path, Camera& camera) {
  if (!node["distortion"]) return;
  std::vector<double> values = ReadCoefficients(node, path, 4, 5, "[k1, k2, p1, p2, k3]");
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
    std::string field = path;
    field.append(": field '").append(name).append("' ");
    if (name.starts_with("Camera") || name == "camera_matrix" || name == "intrinsics") {
      throw InputError(field.append("is that of another program's camera file; ").append(kConvert));
    }
    throw InputError(field.append("is not known; correct or remove it (see docs/camera.md)"));
  }
}

/// The lens, by the field 'model'.
Lens ReadModel(const YAML::Node& node, const std::string& path) {
  const std::string model = node["model"] ? node["model"].as<std::string>("") : "pinhole";
  if (model == "pinhole") return Lens::kBrown;
  if (model == "fisheye") return Lens::kFisheye;
  if (model == "equidistant" || model == "kannala_brandt" || model == "KannalaBrandt8") {
    throw InputError(path + ": field 'model' is '" + model + "', which is called 'fisheye' here; write that");
  }
  throw InputError(path + ": field 'model' is '" + model +
                   "', which is not supported: pinhole and fisheye are; undistort to a pinhole camera first "
                   "(see docs/camera.md)");
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
    throw InputError(NotYaml(path, error) + "; indent with spaces, not tabs (docs/camera.md has an example)");
  }
}

/// As short as it can be read again exactly.
std::string NumberText(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string FieldText(const char* name, const std::string& value) { return std::string(name) + " " + value; }

std::string ModelText(Lens lens) {
  return FieldText("model", lens == Lens::kFisheye ? "fisheye" : "pinhole");
}

}  // namespace

Eigen::Matrix3d Camera::K() const {
  Eigen::Matrix3d k;
  k << fx_px, 0, cx_px, 0, fy_px, cy_px, 0, 0, 1;
  return k;
}

Camera Camera::WithoutLens() const {
  Camera camera = *this;
  camera.lens = Lens::kBrown;
  camera.k1 = camera.k2 = camera.p1 = camera.p2 = camera.k3 = camera.k4 = 0;
  return camera;
}

bool Camera::SeesAs(const Camera& other) const {
  Camera at_this_rate = other;
  at_this_rate.fps = fps;
  return *this == at_this_rate;
}

std::optional<CameraDifference> FirstDifference(const Camera& a, const Camera& b) {
  if (a.lens != b.lens) return CameraDifference{ModelText(a.lens), ModelText(b.lens)};
  constexpr std::array<std::pair<const char*, int Camera::*>, 2> kWhole = {
      {{"width", &Camera::width_px}, {"height", &Camera::height_px}}};
  for (const auto& [name, field] : kWhole) {
    if (a.*field == b.*field) continue;
    return CameraDifference{FieldText(name, std::to_string(a.*field)),
                            FieldText(name, std::to_string(b.*field))};
  }
  constexpr std::array<std::pair<const char*, double Camera::*>, 10> kReal = {
      {{"fx", &Camera::fx_px},
       {"fy", &Camera::fy_px},
       {"cx", &Camera::cx_px},
       {"cy", &Camera::cy_px},
       {"distortion k1", &Camera::k1},
       {"distortion k2", &Camera::k2},
       {"distortion p1", &Camera::p1},
       {"distortion p2", &Camera::p2},
       {"distortion k3", &Camera::k3},
       {"distortion k4", &Camera::k4}}};
  for (const auto& [name, field] : kReal) {
    if (a.*field == b.*field) continue;
    return CameraDifference{FieldText(name, NumberText(a.*field)), FieldText(name, NumberText(b.*field))};
  }
  return std::nullopt;
}

Eigen::Vector2d Camera::Distort(const Eigen::Vector2d& ideal_px) const {
  const Eigen::Vector2d n((ideal_px.x() - cx_px) / fx_px, (ideal_px.y() - cy_px) / fy_px);
  const Eigen::Vector2d d = lens == Lens::kFisheye ? DistortFisheye(*this, n) : DistortBrown(*this, n);
  return {fx_px * d.x() + cx_px, fy_px * d.y() + cy_px};
}

std::optional<Eigen::Vector2d> Camera::Undistort(const Eigen::Vector2d& raw_px) const {
  if (!HasDistortion()) return raw_px;
  const Eigen::Vector2d target((raw_px.x() - cx_px) / fx_px, (raw_px.y() - cy_px) / fy_px);
  const auto n = lens == Lens::kFisheye ? UndistortFisheye(*this, target) : UndistortBrown(*this, target);
  if (!n) return std::nullopt;
  return Eigen::Vector2d(fx_px * n->x() + cx_px, fy_px * n->y() + cy_px);
}

double Camera::StretchAt(const Eigen::Vector2d& ideal_px) const {
  if (!Stretches()) return 1.0;
  const double tangent =
      Eigen::Vector2d((ideal_px.x() - cx_px) / fx_px, (ideal_px.y() - cy_px) / fy_px).norm();
  if (!(tangent > 1e-6)) return 1.0;
  const FisheyeRadius radius = RadiusOf(*this, std::atan(tangent));
  const double outwards = (1.0 + tangent * tangent) / radius.slope, around = tangent / radius.value;
  return std::sqrt(outwards * around);
}

std::optional<std::string> Camera::Problem() const {
  if (width_px < kMinImageSidePx || height_px < kMinImageSidePx || width_px > kMaxImageSidePx ||
      height_px > kMaxImageSidePx) {
    return "field 'width' or 'height' is outside " + std::to_string(kMinImageSidePx) + ".." +
           std::to_string(kMaxImageSidePx) + " pixels";
  }
  if (!(fx_px > 0) || !(fy_px > 0)) return "field 'fx' or 'fy' is not positive";
  if (!(fx_px < 1e5) || !(fy_px < 1e5)) return "field 'fx' or 'fy' is too large";
  if (!(cx_px > 0 && cx_px < width_px)) return "field 'cx' lies outside the image";
  if (!(cy_px > 0 && cy_px < height_px)) return "field 'cy' lies outside the image";
  for (const double value : {k1, k2, p1, p2, k3, k4}) {
    if (!std::isfinite(value)) return "field 'distortion' holds a value that is not finite";
  }
  if (lens == Lens::kFisheye && (p1 != 0 || p2 != 0)) return "a fisheye lens has no p1 and p2";
  if (lens == Lens::kBrown && k4 != 0) return "a lens without fisheye has no k4";
  if (lens == Lens::kFisheye && Folds(*this)) {
    return "field 'distortion' bends the image back within it: these are not k1, k2, k3, k4 of a fisheye "
           "lens of this focal length";
  }
  if (!(fps > 0 && fps <= 1000)) return "field 'fps' is outside 0..1000";
  return std::nullopt;
}

Camera LoadCamera(const std::string& path) {
  const YAML::Node node = LoadYaml(path);
  const Lens lens = ReadModel(node, path);
  RefuseUnknownFields(node, path);
  Camera camera;
  camera.width_px = ReadWhole(node, path, "width");
  camera.height_px = ReadWhole(node, path, "height");
  camera.fx_px = ReadNumber(node, path, "fx");
  camera.fy_px = ReadNumber(node, path, "fy");
  camera.cx_px = ReadNumber(node, path, "cx");
  camera.cy_px = ReadNumber(node, path, "cy");
  if (node["fps"]) camera.fps = ReadNumber(node, path, "fps");
  lens == Lens::kFisheye ? ReadFisheye(node, path, camera) : ReadDistortion(node, path, camera);
  if (const auto problem = camera.Problem())
    throw InputError(path + ": " + *problem + "; correct it (see docs/camera.md)");
  return camera;
}

std::string CameraText(const Camera& camera) {
  std::ostringstream text;
  text.precision(12);
  const bool fisheye = camera.lens == Lens::kFisheye;
  text << "model: " << (fisheye ? "fisheye" : "pinhole") << "\nwidth: " << camera.width_px
       << "\nheight: " << camera.height_px << "\nfx: " << camera.fx_px << "\nfy: " << camera.fy_px
       << "\ncx: " << camera.cx_px << "\ncy: " << camera.cy_px << "\n";
  if (fisheye) {
    text << "distortion: [" << camera.k1 << ", " << camera.k2 << ", " << camera.k3 << ", " << camera.k4
         << "]\n";
  } else if (camera.HasDistortion()) {
    text << "distortion: [" << camera.k1 << ", " << camera.k2 << ", " << camera.p1 << ", " << camera.p2
         << ", " << camera.k3 << "]\n";
  }
  text << "fps: " << camera.fps << "\n";
  return text.str();
}

}  // namespace dmslam
