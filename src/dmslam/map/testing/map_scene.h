#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/map/tracked_frame.h"
#include "dmslam/util/random.h"

namespace dmslam::testing {

/// A map for tests: keyframes side by side, some centimetres and 1/30 s apart, that see the points given to
/// it, each with a descriptor of its own; and frames that see them, where they are or have gone.
class MapScene {
 public:
  static constexpr MapId kMap = 1;
  static constexpr uint32_t kSession = 1;
  static constexpr int64_t kStepNs = 33'333'333;                              ///< between keyframes
  using Place = std::function<std::optional<Eigen::Vector3d>(size_t point)>;  ///< none: hidden

  explicit MapScene(uint64_t seed = 3, CameraId camera = 0)
      : map_(TestCamera(), Pyramid()), random_(seed), camera_(camera) {}

  static Rigid3d PoseAt(double x) {
    return Rigid3d(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, 0, 0));
  }
  static constexpr LandmarkId IdOf(size_t point) { return LandmarkId::Make(1, point + 1); }

  /// A point that was mapped at `first_ns`; returns its number.
  size_t AddPoint(const Eigen::Vector3d& p_world, int64_t first_ns = 0) {
    points_.push_back(p_world);
    descriptors_.push_back({{random_.Next(), random_.Next(), random_.Next(), random_.Next()}});
    first_ns_.push_back(first_ns);
    return points_.size() - 1;
  }
  /// So many points in a box around `middle`.
  void AddCloud(int count, const Eigen::Vector3d& middle, const Eigen::Vector3d& half, int64_t first_ns = 0) {
    for (int i = 0; i < count; ++i) {
      const double x = random_.Uniform(-1, 1), y = random_.Uniform(-1, 1), z = random_.Uniform(-1, 1);
      AddPoint(middle + half.cwiseProduct(Eigen::Vector3d(x, y, z)), first_ns);
    }
  }
  /// Makes the map: all keyframes see all points. The first one was frame `first`.
  void MapAll(uint32_t num_keyframes = 4, double step = 0.05, uint32_t first = 0, int64_t first_ns = 0) {
    for (uint32_t k = 0; k < num_keyframes; ++k) {
      Keyframe keyframe;
      keyframe.id = Named(first + k);
      keyframe.camera_id = camera_;
      keyframe.map_id = kMap;
      keyframe.stamp_ns = first_ns + k * kStepNs;
      keyframe.T_cam_world = PoseAt(step * k);
      if (k > 0) keyframe.parent = Named(first + k - 1);
      keyframe.features = See(k, 0, PoseAt(step * k)).features;
      map_.AddKeyframe(std::move(keyframe));
    }
    for (size_t i = 0; i < points_.size(); ++i) {
      Landmark landmark;
      landmark.id = IdOf(i);
      landmark.map_id = kMap;
      landmark.p_world = points_[i];
      landmark.descriptor = descriptors_[i];
      landmark.reference = landmark.first_keyframe = Named(first);
      landmark.first_ns = first_ns_[i];
      map_.AddLandmark(landmark);
      for (uint32_t k = 0; k < num_keyframes; ++k)
        map_.SetObservation(map_.At(Named(first + k)), static_cast<uint16_t>(i), map_.At(landmark.id));
    }
  }

  /// What a camera sees: feature i shows the i-th point that is not hidden (see `shown`), at its place now.
  TrackedFrame See(uint32_t index, int64_t stamp_ns, const Rigid3d& T_cam_world, const Place& place = {},
                   std::vector<size_t>* shown = nullptr) const {
    FeatureSet features;
    for (size_t i = 0; i < points_.size(); ++i) {
      const std::optional<Eigen::Vector3d> p_world = place ? place(i) : points_[i];
      const auto uv = p_world ? map_.camera().Project(T_cam_world * *p_world) : std::nullopt;
      if (!uv || uv->x() < 0 || uv->y() < 0 || uv->x() > 639 || uv->y() > 479) {
        if (place) continue;
        features.keypoints.push_back({0, 0, 0, 0});  // every point keeps its number
      } else {
        features.keypoints.push_back({static_cast<uint16_t>(std::lround(16 * uv->x())),
                                      static_cast<uint16_t>(std::lround(16 * uv->y())), 0, 0});
      }
      features.descriptors.push_back(descriptors_[i]);
      if (shown != nullptr) shown->push_back(i);
    }
    TrackedFrame frame(index, stamp_ns,
                       MakeFrameFeatures(std::move(features), map_.camera(), map_.pyramid()));
    frame.T_cam_world = T_cam_world;
    return frame;
  }

  MapEditor& map() { return map_; }
  const MapEditor& map() const { return map_; }
  const Eigen::Vector3d& point(size_t i) const { return points_[i]; }
  size_t size() const { return points_.size(); }

 private:
  KeyframeId Named(uint32_t frame) const { return KeyframeId::Make(kSession, frame, camera_); }

  MapEditor map_;
  Random random_;
  CameraId camera_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Descriptor> descriptors_;
  std::vector<int64_t> first_ns_;
};

}  // namespace dmslam::testing
