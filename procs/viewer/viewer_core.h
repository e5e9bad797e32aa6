#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/map/proposals.h"
#include "dmslam/map/replica.h"
#include "viewer/ground_truth.h"
#include "viewer/map_layout.h"
#include "viewer/scene.h"

namespace dmslam {

/// Two maps became one.
struct JoinedMaps {
  MapId from = 0;  ///< is no more
  MapId into = 0;
};

/// Where a camera is drawn.
struct CameraPlace {
  int64_t stamp_ns = 0;  ///< of the frame that says so
  Rigid3d T_world_cam;   ///< where its map is drawn
};

/// A replica of the map with the cameras' paths, and how it is drawn. Of several maps the one in which a
/// camera was last lies as it is, the others beside it.
class ViewerCore {
 public:
  /// `features`: where the map keeps them; null: in memory.
  ViewerCore(const Camera& camera, const Pyramid& pyramid, std::shared_ptr<FeatureStore> features = nullptr)
      : map_(camera, pyramid) {
    map_.KeepFeaturesIn(std::move(features));
  }

  void OnMapDelta(const MapDelta& delta);
  void OnFramePose(const FramePose& pose);
  /// The map is void: a fresh stream, or a snapshot, begins. Frames keep their poses until its keyframes are
  /// there.
  void ForgetMap();

  /// Where a camera truly was at a frame.
  void OnTruth(const SceneFrame& frame, const Rigid3d& T_world_cam);
  /// The whole ground truth of camera 0; it is shown up to the newest frame.
  void SetTruth(std::vector<StampedPose> poses) { truth_file_ = std::move(poses); }

  /// Whether anything that is drawn has changed since the last Draw.
  bool dirty() const { return dirty_; }
  /// Whether the map has moved as a whole since the last Draw (maps were joined, a loop was closed): until
  /// the next one no place of a camera fits what is drawn.
  bool moves() const { return moves_; }
  /// Brings the scene up to date.
  void Draw(ViewerScene* scene);

  /// Lays the ground truth onto the path; costs a pass over the path. None with fewer than ten pairs, or on a
  /// line.
  std::optional<TruthAlignment> AlignTruth() const;
  /// Unit vector [map] that is up for the one who held the camera: from the ground truth where it is aligned
  /// (its z axis), else on average over the keyframes.
  Eigen::Vector3d Up(const std::optional<TruthAlignment>& alignment) const;

  const Map& map() const { return map_; }
  /// None: there is no map.
  std::optional<MapId> shown_map() const { return shown_map_; }
  /// Where the maps are drawn, as of the last Draw.
  const MapLayout& layout() const { return layout_; }
  /// A pose in a map, where that is drawn; none where it cannot be told where that is.
  std::optional<Rigid3d> Drawn(const Rigid3d& T_world_cam, std::optional<MapId> map_id) const;
  /// Where a camera is by its newest frame, told from the keyframe that it was told from: it moves with its
  /// map and joins another one with it. None: it is lost, or that keyframe is not known.
  std::optional<CameraPlace> WhereIs(CameraId camera) const;
  /// Maps that were joined since this was asked last.
  std::vector<JoinedMaps> TakeJoined() { return std::exchange(joined_, {}); }
  size_t num_moving() const { return num_moving_; }
  uint32_t resets() const { return resets_; }

 private:
  void NoteCamera(const FramePose& pose);
  void ChooseMap();
  std::vector<std::optional<MapId>> WhereCamerasAre() const;
  std::optional<MapId> MapOf(const FramePose& pose) const;
  void NoteJoined(const MapDelta& delta);
  void MarkAll();
  void MarkMap(MapId map_id);
  void MarkFrames();
  void Mark(const MapDelta& delta);
  void MarkMoved(const std::vector<ReferenceMove>& moves);
  void HandFramesOn(const MapDelta& delta);
  void DrawPoint(LandmarkId id, ViewerScene* scene);
  void DrawKeyframe(KeyframeId id, ViewerScene* scene);
  void DrawFrame(const SceneFrame& frame, ViewerScene* scene);
  void DrawCameras(ViewerScene* scene) const;
  void DrawTruth(ViewerScene* scene);
  void DrawTruthFile(ViewerScene* scene);
  bool IsInShownMap(CameraId camera) const;
  std::optional<Eigen::Vector3d> TruthAt(const SceneFrame& frame) const;
  void SweepPoints(ViewerScene* scene);

  Replica map_;
  std::optional<MapId> shown_map_;
  MapLayout layout_;
  std::vector<JoinedMaps> joined_;
  std::map<SceneFrame, FramePose> frames_;
  std::map<CameraId, uint32_t> newest_;   ///< by camera: its newest frame
  std::map<CameraId, uint32_t> present_;  ///< by camera that is not lost: the frame that says where it is
  std::map<KeyframeId, std::vector<SceneFrame>>
      frames_of_;                                    ///< told from this keyframe, or from one it stands for
  std::map<SceneFrame, Eigen::Vector3d> positions_;  ///< of the frames in the shown map
  std::map<CameraId, std::map<uint32_t, TruePosition>> truth_;
  std::vector<StampedPose> truth_file_;
  size_t truth_file_next_ = 0;
  int64_t newest_ns_ = 0;

  bool dirty_ = true;
  bool moves_ = false;
  bool void_ = false;
  std::set<LandmarkId> dirty_points_;
  std::set<KeyframeId> dirty_keyframes_;
  std::set<SceneFrame> dirty_frames_;
  size_t num_moving_ = 0;
  uint32_t resets_ = 0;
};

}  // namespace dmslam
