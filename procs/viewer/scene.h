#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "dmslam/util/ids.h"
#include "viewer/slot_table.h"

namespace dmslam {

using Float3 = std::array<float, 3>;

/// A frame of one of the cameras.
struct SceneFrame {
  CameraId camera = 0;
  uint32_t index = 0;
  auto operator<=>(const SceneFrame&) const = default;
};

/// A landmark as it is drawn.
struct ScenePoint {
  Float3 position{};  ///< [map units]
  float belief = 0;   ///< log odds of motion over those at which it is believed to move, in steps of 1/8
  uint32_t first_frame = 0;  ///< index of the newest frame when it was made
  uint32_t colour = 0;       ///< number of its map's
  bool operator==(const ScenePoint&) const = default;
  bool moves() const { return belief > 0; }
};

/// A keyframe as it is drawn.
struct SceneKeyframe {
  enum class LinkKind : uint8_t { kCovisible = 0, kParent = 1, kLoop = 2 };
  struct Link {
    uint32_t slot = 0;  ///< of the other keyframe, an older one
    LinkKind kind = LinkKind::kCovisible;
    bool operator==(const Link&) const = default;
  };
  Float3 center{};                  ///< [map units]
  std::array<float, 4> rotation{};  ///< unit quaternion x, y, z, w: world from camera
  std::vector<Link> links;
  uint32_t colour = 0;  ///< number of its map's
  bool operator==(const SceneKeyframe&) const = default;
};

/// Where a camera was at a frame.
struct ScenePathPoint {
  Float3 position{};    ///< [map units]
  bool later = false;   ///< placed after the fact
  uint32_t colour = 0;  ///< number of its map's
  bool operator==(const ScenePathPoint&) const = default;
};

/// A camera as it is drawn where it is now.
struct SceneCamera {
  Float3 center{};                  ///< [map units]
  std::array<float, 4> rotation{};  ///< unit quaternion x, y, z, w: world from camera
};

/// What browsers draw of all maps: tables that they mirror. A browser says which version it has and gets what
/// changed.
class ViewerScene {
 public:
  ViewerScene() : points_(true), keyframes_(false), path_(false), truth_(false) {}

  /// A new version begins; what is set from here on belongs to it.
  void Advance() { ++version_; }
  /// Everything that was drawn is void.
  void Clear();
  /// What was drawn moves as a whole in this version: places told of before and after do not go together.
  void Rearrange() { ++arrangement_; }
  /// Where the cameras are among what is drawn in this version.
  void SetCameras(std::map<CameraId, SceneCamera> cameras) { cameras_ = std::move(cameras); }

  void SetPoint(LandmarkId id, const ScenePoint& point) { points_.Set(id, point, version_); }
  void RemovePoint(LandmarkId id) { points_.Remove(id, version_); }
  void SetKeyframe(KeyframeId id, const SceneKeyframe& keyframe) { keyframes_.Set(id, keyframe, version_); }
  void RemoveKeyframe(KeyframeId id) { keyframes_.Remove(id, version_); }
  void SetPath(const SceneFrame& frame, const ScenePathPoint& point) { path_.Set(frame, point, version_); }
  void RemovePath(const SceneFrame& frame) { path_.Remove(frame, version_); }
  /// `position` in the ground truth's own world [m]; those of a camera are numbered in order of time.
  void SetTruth(const SceneFrame& number, const Float3& position) { truth_.Set(number, position, version_); }

  using Points = SlotTable<LandmarkId, ScenePoint>;
  using Keyframes = SlotTable<KeyframeId, SceneKeyframe>;
  const Points& points() const { return points_; }
  const Keyframes& keyframes() const { return keyframes_; }
  using Path = SlotTable<SceneFrame, ScenePathPoint>;
  using Truth = SlotTable<SceneFrame, Float3>;
  const Path& path() const { return path_; }
  const Truth& truth() const { return truth_; }
  const std::map<CameraId, SceneCamera>& cameras() const { return cameras_; }
  uint64_t version() const { return version_; }
  /// Changes when everything was void: what a browser holds of another generation counts for nothing.
  uint32_t generation() const { return generation_; }
  /// Counts how often what is drawn has moved as a whole (maps were joined, or lie elsewhere).
  uint32_t arrangement() const { return arrangement_; }

  /// What changed after version `since` of `generation`, or everything where that is of another generation
  /// (flag 1), in little-endian words of 32 bits:
  ///   "DMSV", layout 3, generation, flags, version, points, keyframes, links, path, truth  (ten words), then
  ///   points     slot[n], id low[n], id high[n], x y z [3n] float, belief[n] float (above zero: believed to
  ///              move; NaN: removed),
  ///              first frame[n], colour[n]
  ///   keyframes  slot[m], frame[m] (all ones: removed), x y z [3m], quaternion x y z w [4m] world from
  ///              camera, camera[m], colour[m], end of its links[m], then of all links: slot[l], kind[l]
  ///   path       frame[p], camera[p], x y z [3p] (NaN: removed), placed later[p], colour[p]
  ///   truth      number[t], camera[t], x y z [3t]
  ///   cameras    arrangement, how many, then of each, always all: camera, x y z, quaternion x y z w
  std::vector<uint8_t> Encode(uint32_t generation, uint64_t since) const;

 private:
  Points points_;
  Keyframes keyframes_;
  Path path_;
  Truth truth_;
  std::map<CameraId, SceneCamera> cameras_;
  uint64_t version_ = 1;
  uint32_t generation_ = 1;
  uint32_t arrangement_ = 1;
};

}  // namespace dmslam
