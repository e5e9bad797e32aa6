#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/features/types.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/map/record_group.h"
#include "dmslam/util/ids.h"

namespace dmslam::wire {

inline constexpr CameraId kMaxCameraId = 255;
/// Most records of a group.
inline constexpr uint32_t kMaxGroup = 1 << 16;

/// Collects what is wrong with a message; the first complaint stays.
class Checker {
 public:
  bool ok() const { return what_ == nullptr; }
  /// The complaint, and about which keyframe or landmark it is, where that is known.
  std::string text() const { return std::string(what_) + (about_.empty() ? "" : " (" + about_ + ")"); }

  void Require(bool condition, const char* what) {
    if (!condition && what_ == nullptr) what_ = what;
  }
  /// What was required last is of this keyframe or landmark.
  void Of(KeyframeId id) {
    if (ok() || !about_.empty()) return;
    about_ = "frame " + std::to_string(id.frame_index()) + " of session " + std::to_string(id.session());
    if (id.camera() != 0) about_ += ", camera " + std::to_string(id.camera());
  }
  void Of(LandmarkId id) {
    if (ok() || !about_.empty()) return;
    about_ = "landmark " + std::to_string(id.epoch_ordinal()) + ":" + std::to_string(id.number());
  }
  void Finite(double value, const char* what) { Require(std::isfinite(value), what); }
  /// Finite and not beyond any map's size.
  void Position(const Eigen::Vector3d& p, const char* what);
  void UnitQuaternion(const Eigen::Quaterniond& q, const char* what);
  void Pose(const Rigid3d& T, const char* what);
  void Scale(double scale, const char* what);
  void Stamp(std::optional<int64_t> stamp_ns) { Require(!stamp_ns || *stamp_ns >= 0, "negative stamp"); }
  void Session(uint32_t session) { Require(session >= 1, "no session"); }
  void CameraNumber(CameraId camera_id) {
    Require(camera_id <= kMaxCameraId, "number of the camera out of range");
  }
  void Group(const RecordGroup& group);
  /// The upper triangle of a covariance, or nothing.
  void Covariance(const std::vector<double>& covariance);
  void Share(double share) { Require(share >= 0 && share <= 1, "a share outside 0..1"); }
  /// An id that some session, or some mapper, can have made; `Optional`: or none.
  void Id(KeyframeId id, const char* what) { Require(id.session() >= 1, what); }
  void Id(LandmarkId id, const char* what) { Require(id.epoch_ordinal() >= 1, what); }
  template <typename AnyId>
  void OptionalId(AnyId id, const char* what) {
    if (id.valid()) Id(id, what);
  }
  template <typename AnyId>
  void OptionalId(const std::optional<AnyId>& id, const char* what) {
    if (id) Id(*id, what);
  }
  void CameraModel(const Camera& camera);
  void Features(const FeatureSet& features);

 private:
  const char* what_ = nullptr;
  std::string about_;
};

/// Whether a text may travel: valid UTF-8 without control characters but line feeds, at most kMaxTextBytes.
bool IsCleanText(std::string_view text);
/// The text with a question mark for each byte that may not, cut to the longest that may travel.
std::string CleanText(std::string_view text);

/// Largest coordinate of a pose or a point [map units].
inline constexpr double kMaxCoordinate = 1e12;
inline constexpr int kMaxPyramidLevels = 32;
inline constexpr size_t kMaxFeatures = 65535;

}  // namespace dmslam::wire
