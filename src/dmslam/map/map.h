#pragma once

#include <cmath>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/map/conventions.h"
#include "dmslam/map/feature_store.h"
#include "dmslam/map/keyframe.h"
#include "dmslam/map/landmark.h"
#include "dmslam/map/landmark_table.h"
#include "dmslam/map/map_delta.h"

namespace dmslam {

/// Keyframes, landmarks, who sees what, the covisibility graph and the spanning tree, for those who read.
/// Two kinds of map change: the mapper's `MapEditor`, by edits that it remembers, and everybody else's
/// `Replica`, by the deltas of that editor alone.
///
/// Ids come from outside (records, other maps) and are resolved once, with `Find...` where they may be
/// unknown and `At` where they cannot be; what is found stays where it is until it is removed.
///
/// Order: keyframes iterate by id. Landmarks are stored by hash and are never iterated in that order; go
/// through keyframes' features or `LandmarkIdsSorted`.
///
/// Any number of threads may read it while nobody changes it. Reading writes one thing, the landmarks'
/// viewing ranges, which are a cache that is made for that (ViewingCache).
class Map {
 public:
  Map(const Camera& camera, const Pyramid& pyramid);

  /// Where features lie that are too many for the memory, those of the keyframes that are there included;
  /// null: they are never too many. Copies of the map share it. Features that were found before lie elsewhere
  /// now.
  void KeepFeaturesIn(std::shared_ptr<FeatureStore> store);
  const std::shared_ptr<FeatureStore>& feature_store() const { return feature_store_; }

  const Camera& camera() const { return camera_; }
  const Pyramid& pyramid() const { return pyramid_; }
  /// The same, for those who ask thousands of times.
  const PyramidTable& pyramid_table() const { return pyramid_table_; }
  /// The level of the pyramid at which something is so many times as small as at the first; between levels,
  /// too.
  double LevelOf(double times) const { return std::log(times) / log_scale_factor_; }
  /// Counts deltas.
  uint64_t version() const { return version_; }
  /// How far the streams are that the map is made of; travels with every delta and snapshot.
  const MapProgress& progress() const { return progress_; }
  /// The same as far as it concerns one camera.
  MapProgress progress(CameraId camera) const;
  /// The cameras whose streams are worked into it, in order.
  std::vector<CameraId> cameras() const;

  const std::map<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  const Keyframe* FindKeyframe(KeyframeId id) const;
  /// A keyframe that is known to be there.
  const Keyframe& At(KeyframeId id) const;
  /// The newest keyframe of a camera, of the newest session in which it has any; null: none.
  const Keyframe* NewestKeyframeOf(CameraId camera) const;
  size_t num_landmarks() const { return landmarks_.size(); }
  const Landmark* FindLandmark(LandmarkId id) const { return landmarks_.Find(id); }
  /// A landmark that is known to be there.
  const Landmark& At(LandmarkId id) const;
  /// Calls visit(const Landmark&) for each of `ids`, all of which are known to be there, in their order.
  /// Faster than At for many.
  template <typename Visit>
  void ForEachOf(std::span<const LandmarkId> ids, const Visit& visit) const {
    landmarks_.ForEachOf(ids, visit);
  }
  std::vector<LandmarkId> LandmarkIdsSorted() const;
  /// What feature `feature` of a keyframe of this map sees; null: nothing.
  const Landmark* LandmarkSeenBy(const Keyframe& keyframe, size_t feature) const;

  /// The landmark that stands for `id` now: itself, or what it was fused into; null when culled or unknown.
  const Landmark* Resolve(LandmarkId id) const;
  /// Pose of a keyframe, through its tombstones when it was culled: T_kf_world. None when unknown.
  struct ResolvedPose {
    Rigid3d T_cam_world;
    double scale = 1.0;
    /// What stands for it: itself, or the nearest ancestor that is left. Valid until the map changes.
    const Keyframe* keyframe = nullptr;
    MapId map_id() const { return keyframe->map_id; }
    /// The pose of something told relative to this keyframe when its scale was `scale_then`.
    Rigid3d Compose(const Rigid3d& T_other_kf, double scale_then) const;
  };
  std::optional<ResolvedPose> ResolvePose(KeyframeId id) const;
  /// The keyframe that stands for `id` now: itself, or the nearest ancestor that is left; null when unknown.
  const Keyframe* Resolve(KeyframeId id) const;
  /// Whether a keyframe of this id is in the map, or was and has been culled.
  bool HasKnown(KeyframeId id) const;
  const std::map<KeyframeId, KeyframeTombstone>& keyframe_tombstones() const { return keyframe_tombstones_; }
  /// What dead landmarks were fused into; none: culled. Of those that died last (kLandmarkTombstones, some
  /// minutes' worth): keyframes in flight, and what the frontend keeps of its newest frames, refer to no
  /// older ones.
  const std::map<LandmarkId, std::optional<LandmarkId>>& landmark_tombstones() const {
    return landmark_tombstones_;
  }
  static constexpr size_t kLandmarkTombstones = 32768;
  /// Their ids in the order of death.
  const std::deque<LandmarkId>& landmark_burials() const { return burials_; }
  /// Highest ordinal of an epoch of which the map knows a landmark, living or dead; 0: of none.
  uint16_t HighestOrdinal() const;

  /// Spanning tree: who has `id` for its parent, sorted.
  const std::vector<KeyframeId>& Children(KeyframeId id) const;
  /// Keyframes that share at least `min_shared` landmarks with `id`, most first (ties: older first), at most
  /// `most`.
  std::vector<KeyframeId> BestCovisible(KeyframeId id, int most, int min_shared = kMinCovisibility) const;
  /// The same of a keyframe of this map.
  std::vector<const Keyframe*> BestCovisible(const Keyframe& keyframe, int most, int min_shared) const;
  /// The other keyframes of the same map whose cameras stand nearer to that of `keyframe` than `distance` and
  /// are turned from it by less than `angle_rad`, nearest first.
  std::vector<const Keyframe*> KeyframesNear(const Keyframe& keyframe, double distance,
                                             double angle_rad) const;
  /// Whether one map has a keyframe: there is no map without one. Cheap, however many it has.
  bool HasMap(MapId map_id) const;
  /// Whether there is another map beside this one.
  bool HasAnotherMap(MapId map_id) const;
  /// Keyframes of one map, by id.
  std::vector<const Keyframe*> KeyframesOf(MapId map_id) const;
  /// Landmarks of one map, by id.
  std::vector<const Landmark*> LandmarksOf(MapId map_id) const;
  /// How many landmarks of a keyframe have at least `min_observations` observers.
  int CountTracked(const Keyframe& keyframe, int min_observations) const;
  /// Median depth of a keyframe's landmarks in its camera; none without landmarks.
  std::optional<double> MedianDepth(const Keyframe& keyframe) const;
  /// Direction and distances from which a landmark of this map was seen (computed when stale).
  ViewingRange Viewing(const Landmark& landmark) const {
    return landmark.viewing_.Get([&] { return ComputeViewing(landmark); });
  }

 protected:
  // What editor and replica are made of. Each of these keeps observations, covisibility, spanning tree and
  // derived values in step, and remembers nothing.

  Keyframe* Find(KeyframeId id);
  Landmark* Find(LandmarkId id);
  /// What this map has handed out for reading, for who may edit.
  Keyframe& Mutable(const Keyframe& keyframe);
  Landmark& Mutable(const Landmark& landmark);
  Keyframe& Insert(Keyframe keyframe);  ///< without landmarks and covisibility
  Landmark& Insert(Landmark landmark);  ///< without observations
  void Place(Keyframe& keyframe, const Rigid3d& T_cam_world, double scale, MapId map_id);
  static void Place(Landmark& landmark, const Eigen::Vector3d& p_world);
  /// All landmarks whose reference is among those of `moves`, with it.
  void MoveLandmarks(const std::vector<ReferenceMove>& moves);
  void Hang(Keyframe& keyframe, std::optional<KeyframeId> parent);
  /// The landmark is seen anew; its viewing range is stale.
  static void SetReference(Landmark& landmark, KeyframeId reference);
  /// A feature sees a landmark instead of what it saw before. Returns the feature of the same keyframe that
  /// saw the landmark until now, if there is one: it is released.
  std::optional<uint16_t> Observe(Keyframe& keyframe, uint16_t feature, Landmark& landmark);
  void Release(Keyframe& keyframe, uint16_t feature);
  void EraseKeyframe(KeyframeId id);  ///< that sees nothing any more, or whose whole map goes
  void EraseLandmark(LandmarkId id);  ///< that nobody sees any more, or whose whole map goes
  void Bury(LandmarkId id, std::optional<LandmarkId> replaced_by);
  void Bury(const KeyframeTombstone& tombstone) { keyframe_tombstones_[tombstone.id] = tombstone; }
  void ForgetOldTombstones();
  /// What was there of a map that is forgotten as a whole.
  struct Forgotten {
    std::vector<KeyframeId> keyframes;
    std::vector<LandmarkId> landmarks;
  };
  Forgotten Forget(MapId map_id);
  void SetVersion(uint64_t version) { version_ = version; }
  /// A change is complete.
  void TidyFeatures();
  /// Of one camera, and of the loop closer.
  void SetProgressTo(const MapProgress& progress);
  /// Of all cameras: nothing of any stream is in the map.
  void ForgetProgress();

 private:
  /// Where a camera stands. Kept beside the keyframes, which lie all over the memory: thousands are compared
  /// at a time.
  struct Standpoint {
    KeyframeId id;
    MapId map_id = 0;
    Eigen::Vector3d center;
  };

  void UpdateStandpoint(const Keyframe& keyframe);
  void Link(const Landmark& landmark, Keyframe& keyframe, int sign);
  void Attach(KeyframeId child, std::optional<KeyframeId> parent);
  void Detach(KeyframeId child, std::optional<KeyframeId> parent);
  std::optional<ViewingRange> ComputeViewing(const Landmark& landmark) const;

  Camera camera_;
  Pyramid pyramid_;
  PyramidTable pyramid_table_;
  double log_scale_factor_;
  std::shared_ptr<FeatureStore> feature_store_;
  uint64_t version_ = 0;
  MapProgress progress_;                         ///< as told last
  std::map<CameraId, MapProgress> progress_of_;  ///< by camera
  std::map<KeyframeId, Keyframe> keyframes_;
  std::vector<Standpoint> standpoints_;  ///< of all keyframes, by id
  LandmarkTable landmarks_;
  std::map<KeyframeId, std::vector<KeyframeId>>
      children_;  ///< by parent, whether the parent is known yet or not
  std::map<KeyframeId, KeyframeTombstone> keyframe_tombstones_;
  std::map<LandmarkId, std::optional<LandmarkId>> landmark_tombstones_;
  std::deque<LandmarkId> burials_;
};

}  // namespace dmslam
