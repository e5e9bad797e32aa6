#include "dmslam/wire/check.h"

#include "dmslam/map/proposals.h"
#include "dmslam/wire/codec.h"

namespace dmslam::wire {

void Checker::Position(const Eigen::Vector3d& p, const char* what) {
  Require(p.allFinite() && p.cwiseAbs().maxCoeff() <= kMaxCoordinate, what);
}

void Checker::UnitQuaternion(const Eigen::Quaterniond& q, const char* what) {
  Require(q.coeffs().allFinite() && std::abs(q.coeffs().squaredNorm() - 1.0) <= 1e-6, what);
}

void Checker::Pose(const Rigid3d& T, const char* what) {
  UnitQuaternion(T.rotation, what);
  Position(T.translation, what);
}

void Checker::Scale(double scale, const char* what) { Require(scale >= 1e-12 && scale <= 1e12, what); }

void Checker::CameraModel(const Camera& camera) {
  Require(camera.width_px >= 1 && camera.width_px <= kMaxImageSidePx && camera.height_px >= 1 &&
              camera.height_px <= kMaxImageSidePx,
          "image size of the camera out of range");
  for (const double value : {camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, camera.k1, camera.k2,
                             camera.p1, camera.p2, camera.k3, camera.k4, camera.fps}) {
    Finite(value, "a value of the camera is not finite");
  }
  Require(camera.fx_px > 0 && camera.fy_px > 0, "focal length not above zero");
  Require(camera.fps > 0, "rate of the camera not above zero");
  const bool fisheye = camera.lens == Lens::kFisheye;
  Require(fisheye ? camera.p1 == 0 && camera.p2 == 0 : camera.k4 == 0,
          "a coefficient that the lens does not have");
}

void Checker::Features(const FeatureSet& features) {
  Require(features.keypoints.size() == features.descriptors.size(),
          "as many descriptors as keypoints are needed");
  Require(features.size() <= kMaxFeatures, "more features than an index can name");
  for (const Keypoint& keypoint : features.keypoints)
    Require(keypoint.octave < kMaxPyramidLevels, "octave out of range");
  const auto none_or_all = [&](const auto& list) { return list.empty() || list.size() == features.size(); };
  Require(none_or_all(features.depths_m) && features.depths_m.size() == features.depth_sigmas_m.size(),
          "as many depths and sigmas of depths as keypoints are needed, or none");
  Require(none_or_all(features.sigmas_px), "as many sigmas as keypoints are needed, or none");
  for (const auto* list : {&features.depths_m, &features.depth_sigmas_m}) {
    for (const float value : *list)
      Require(std::isfinite(value) && (value >= 0 || value == -1), "depth of a keypoint below zero");
  }
  for (const float sigma : features.sigmas_px)
    Require(std::isfinite(sigma) && sigma > 0, "sigma of a keypoint not above zero");
}

void Checker::Group(const RecordGroup& group) {
  Require(group.count >= 1 && group.count <= kMaxGroup && group.index < group.count,
          "place in a group of records out of range");
  Require(group.alone() == (group.id == 0), "a group of records without an id, or an id without a group");
}

void Checker::Covariance(const std::vector<double>& covariance) {
  Require(covariance.empty() || covariance.size() == kPoseCovarianceSize, "a covariance that is not 6 by 6");
  for (const double value : covariance) Finite(value, "a covariance is not finite");
  size_t diagonal = 0;
  for (size_t row = 6; row > 0 && diagonal < covariance.size(); diagonal += row--)
    Require(covariance[diagonal] >= 0, "a variance below zero");
}

namespace {

/// Length of the valid UTF-8 character that begins a text (1..4), 0 if there is none or it may not travel.
size_t CharacterLength(std::string_view text) {
  const auto byte = [&](size_t i) { return i < text.size() ? static_cast<uint8_t>(text[i]) : uint8_t{0}; };
  const auto follows = [&](size_t i) { return (byte(i) & 0xc0) == 0x80; };
  const uint8_t first = byte(0);
  if (first < 0x80) return first == '\n' || (first >= 0x20 && first != 0x7f) ? 1 : 0;
  if (first >= 0xc2 && first <= 0xdf) return follows(1) && !(first == 0xc2 && byte(1) < 0xa0) ? 2 : 0;
  if (first >= 0xe0 && first <= 0xef) {
    const bool overlong = first == 0xe0 && byte(1) < 0xa0;
    const bool surrogate = first == 0xed && byte(1) >= 0xa0;
    return follows(1) && follows(2) && !overlong && !surrogate ? 3 : 0;
  }
  if (first >= 0xf0 && first <= 0xf4) {
    const bool outside = (first == 0xf0 && byte(1) < 0x90) || (first == 0xf4 && byte(1) >= 0x90);
    return follows(1) && follows(2) && follows(3) && !outside ? 4 : 0;
  }
  return 0;
}

}  // namespace

bool IsCleanText(std::string_view text) {
  if (text.size() > kMaxTextBytes) return false;
  while (!text.empty()) {
    const size_t length = CharacterLength(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

std::string CleanText(std::string_view text) {
  std::string clean;
  while (!text.empty()) {
    const size_t length = CharacterLength(text);
    const size_t taken = length == 0 ? 1 : length;
    if (clean.size() + taken > kMaxTextBytes) break;
    clean += length == 0 ? std::string_view("?") : text.substr(0, length);
    text.remove_prefix(taken);
  }
  return clean;
}

}  // namespace dmslam::wire
