#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/map/proposals.h"
#include "dmslam/util/random.h"

namespace dmslam {

/// An uneven wall some four units before the first camera, a grid of points each of which looks like itself
/// alone. Cameras look straight ahead.
class WallScene {
 public:
  explicit WallScene(int columns = 14, int rows = 10, double spacing = 0.3) {
    Random random(DeriveSeed(1, 0, "wall"));
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        points_.emplace_back(spacing * (column - 0.5 * (columns - 1)), spacing * (row - 0.5 * (rows - 1)),
                             4.0 + 0.5 * random.Uniform());
        descriptors_.push_back({{random.Next(), random.Next(), random.Next(), random.Next()}});
      }
    }
  }

  uint16_t size() const { return static_cast<uint16_t>(points_.size()); }
  const Eigen::Vector3d& point(size_t i) const { return points_[i]; }
  const Descriptor& descriptor(size_t i) const { return descriptors_[i]; }
  /// All points, in the order of their features.
  std::vector<uint16_t> All() const { return Range(0, size()); }
  static std::vector<uint16_t> Range(uint16_t from, uint16_t to) {
    std::vector<uint16_t> points;
    for (uint16_t i = from; i < to; ++i) points.push_back(i);
    return points;
  }

  /// Something else is seen in place of a point from now on.
  void Replace(uint16_t i, const Eigen::Vector3d& p_world) {
    Random random(DeriveSeed(2, i, "replaced"));
    points_[i] = p_world;
    descriptors_[i] = {{random.Next(), random.Next(), random.Next(), random.Next()}};
  }

  static KeyframeId Id(uint32_t frame) { return KeyframeId::Make(1, frame); }
  /// A camera `x` to the right of the first.
  static Rigid3d At(double x) { return Rigid3d(Eigen::Quaterniond::Identity(), {-x, 0, 0}); }
  /// Feature i sees point points[i].
  FeatureSet See(const Rigid3d& T_cam_world, const std::vector<uint16_t>& points) const {
    FeatureSet features;
    for (const uint16_t i : points) {
      const Eigen::Vector2d uv_px = *TestCamera().Project(T_cam_world * points_[i]);
      features.keypoints.push_back({static_cast<uint16_t>(std::lround(uv_px.x() * 16)),
                                    static_cast<uint16_t>(std::lround(uv_px.y() * 16)), 0, 0});
      features.descriptors.push_back(descriptors_[i]);
    }
    return features;
  }

  /// A keyframe of map 1 that sees all points with the feature of the same number, and knows none of them.
  /// The first one is the parent of all others.
  const Keyframe& AddKeyframe(MapEditor& map, uint32_t frame, double x, double seconds = 0) const {
    Keyframe keyframe;
    keyframe.id = Id(frame);
    keyframe.map_id = 1;
    keyframe.stamp_ns = static_cast<int64_t>(seconds * 1e9);
    keyframe.T_cam_world = At(x);
    if (!map.keyframes().empty()) keyframe.parent = map.keyframes().begin()->first;
    keyframe.features = MakeFrameFeatures(See(keyframe.T_cam_world, All()), map.camera(), map.pyramid());
    return map.AddKeyframe(std::move(keyframe));
  }
  /// A landmark at a point, seen by these keyframes.
  LandmarkId AddLandmark(MapEditor& map, uint64_t number, uint16_t at,
                         const std::vector<uint32_t>& frames) const {
    Landmark landmark;
    landmark.id = LandmarkId::Make(1, number);
    landmark.map_id = 1;
    landmark.p_world = points_[at];
    landmark.descriptor = descriptors_[at];
    landmark.reference = landmark.first_keyframe = Id(frames.front());
    landmark.first_ns = map.At(landmark.reference).stamp_ns;
    const LandmarkId id = map.AddLandmark(std::move(landmark)).id;
    for (const uint32_t frame : frames) map.SetObservation(map.At(Id(frame)), at, map.At(id));
    return id;
  }
  /// A frame that sees all points, `x` to the right of the first camera, told from keyframe `reference` at
  /// `reference_x`.
  KeyframeProposal Propose(uint32_t frame, double x, uint32_t reference, double reference_x,
                           double seconds) const {
    KeyframeProposal proposal;
    proposal.id = Id(frame);
    proposal.map_id = 1;
    proposal.stamp_ns = static_cast<int64_t>(seconds * 1e9);
    proposal.reference = Id(reference);
    proposal.T_cam_reference = At(x) * At(reference_x).Inverse();
    proposal.features = See(At(x), All());
    return proposal;
  }

 private:
  std::vector<Eigen::Vector3d> points_;
  std::vector<Descriptor> descriptors_;
};

}  // namespace dmslam
