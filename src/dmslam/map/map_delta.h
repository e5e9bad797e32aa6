#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/features/types.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/map/landmark.h"
#include "dmslam/map/record_group.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// What a map record says, and why it was written. Each has one meaning, and says which of the delta's
/// `about`, `map_id`, `correction_id` and `request` there are (NeededBy).
enum class MapEvent : uint8_t {
  kKeyframeInserted = 1,    ///< keyframe `about`
  kLandmarksCreated = 2,    ///< by keyframe `about`
  kFused = 3,               ///< landmarks of keyframe `about` with those of its neighbours
  kAdjusted = 4,            ///< local bundle adjustment around keyframe `about`
  kMapped = 5,              ///< local mapping of keyframe `about` is done (redundant keyframes are culled)
  kEvidence = 6,            ///< what frames said of landmarks
  kCorrected = 7,           ///< `correction_id`, a loop of keyframe `about`, was applied
  kGloballyAdjusted = 8,    ///< `correction_id`, a global adjustment after a loop, was applied
  kMapStarted = 9,          ///< `map_id`, of a first map; `about` is the `second` proposed
  kMapDropped = 10,         ///< `map_id`, as the frontend said
  kSettled = 11,            ///< the answer to a keyframe: all work that `about` caused is done; where it was
                            ///< refused there was none, and `note` says why
  kSnapshot = 12,           ///< part of a snapshot
  kCorrectionRefused = 13,  ///< `correction_id` was not applied; `note` says why
  kEnded = 14,              ///< the end of the session: nothing follows
  kMapAdjusted = 15,        ///< `map_id` as a whole, after the last frame
  kRequestDone = 16,        ///< the answer to an AdjustRequest, `request`: all maps are adjusted
  kFirstMapRefused = 17,    ///< of `map_id`, with `about` as the `second` proposed; `note` says why
  kTurn = 18,  ///< the answer to a TurnRequest: all that comes before frame `about` is in the map
};

/// What a delta must name for its event; without it the record is refused.
struct EventNeeds {
  bool about = false, map_id = false, correction_id = false, request = false;
};
constexpr EventNeeds NeededBy(MapEvent event) {
  switch (event) {
    case MapEvent::kKeyframeInserted:
    case MapEvent::kLandmarksCreated:
    case MapEvent::kFused:
    case MapEvent::kAdjusted:
    case MapEvent::kMapped:
    case MapEvent::kSettled:
    case MapEvent::kTurn:
      return {.about = true};
    case MapEvent::kMapStarted:
    case MapEvent::kFirstMapRefused:
      return {.about = true, .map_id = true};
    case MapEvent::kMapDropped:
    case MapEvent::kMapAdjusted:
      return {.map_id = true};
    case MapEvent::kCorrected:
    case MapEvent::kGloballyAdjusted:
    case MapEvent::kCorrectionRefused:
      return {.correction_id = true};
    case MapEvent::kRequestDone:
      return {.request = true};
    case MapEvent::kEvidence:
    case MapEvent::kSnapshot:
    case MapEvent::kEnded:
      return {};
  }
  return {};
}

/// Whether somebody waits for a record of this event, even where it changes nothing.
constexpr bool IsAnswer(MapEvent event) {
  switch (event) {
    case MapEvent::kMapped:
    case MapEvent::kSettled:
    case MapEvent::kCorrectionRefused:
    case MapEvent::kEnded:
    case MapEvent::kRequestDone:
    case MapEvent::kFirstMapRefused:
    case MapEvent::kTurn:
      return true;
    case MapEvent::kKeyframeInserted:
    case MapEvent::kLandmarksCreated:
    case MapEvent::kFused:
    case MapEvent::kAdjusted:
    case MapEvent::kEvidence:
    case MapEvent::kCorrected:
    case MapEvent::kGloballyAdjusted:
    case MapEvent::kMapStarted:
    case MapEvent::kMapDropped:
    case MapEvent::kSnapshot:
    case MapEvent::kMapAdjusted:
      return false;
  }
  return false;
}

/// A keyframe's own state: all of it. Features are there when the keyframe is new to the reader.
struct KeyframeState {
  KeyframeId id;
  MapId map_id = 0;
  int64_t stamp_ns = 0;
  Rigid3d T_cam_world;
  double scale = 1.0;
  std::optional<KeyframeId> parent;  ///< none: a map's first keyframe
  std::vector<KeyframeId> loop_edges;
  std::shared_ptr<const FeatureSet> features;  ///< those of the keyframe, not copied; null: they are known
  CameraId camera_id = 0;
};

/// A keyframe's pose alone.
struct KeyframePose {
  KeyframeId id;
  Rigid3d T_cam_world;
  double scale = 1.0;
};

/// A landmark's own state, without its observations.
struct LandmarkState {
  LandmarkId id;
  MapId map_id = 0;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Descriptor descriptor;
  KeyframeId reference;
  KeyframeId first_keyframe;
  int64_t first_ns = 0;
  LandmarkEvidence evidence;
};

/// How all landmarks whose reference is `reference` move, unless the delta tells their positions: the world
/// (after) from the world (before). The one thing in a delta that is told relative to what was.
struct ReferenceMove {
  KeyframeId reference;
  Sim3d after_from_before;
};

struct LandmarkPosition {
  LandmarkId id;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
};

struct LandmarkEvidenceState {
  LandmarkId id;
  LandmarkEvidence evidence;
};

/// What feature `feature` of `keyframe` observes now.
struct ObservationState {
  KeyframeId keyframe;
  uint16_t feature = 0;
  std::optional<LandmarkId> landmark;  ///< none: nothing
  auto operator<=>(const ObservationState&) const = default;
};

/// A keyframe that is no more: where it stood, relative to the parent that takes its place, in units of its
/// own (its scale is 1 in them).
struct KeyframeTombstone {
  KeyframeId id;
  KeyframeId parent;
  int64_t stamp_ns = 0;
  Rigid3d T_kf_parent;
  double parent_scale = 1.0;  ///< the parent's scale in these units, when T_kf_parent was taken
};

struct LandmarkTombstone {
  LandmarkId id;
  std::optional<LandmarkId> replaced_by;  ///< none: culled
};

/// A place in a stream of records: all of `epoch` up to `seq`. Zero: before the first.
struct StreamPosition {
  int64_t epoch = 0;
  int64_t seq = 0;
  auto operator<=>(const StreamPosition&) const = default;
};

/// What a map contains of the streams it is made of: whoever continues it goes on from here. Where several
/// cameras work on it each record tells how far one of them is: the map keeps what was told of each.
struct MapProgress {
  CameraId camera = 0;                ///< whose `frontend` and `settled` these are
  StreamPosition frontend;            ///< records of the frontend's stream up to here are worked into it
  StreamPosition loopcloser;          ///< the loop closer's
  std::optional<KeyframeId> settled;  ///< the keyframe all of whose work was done last
  std::optional<uint64_t> corrected;  ///< the map's version when the newest correction was applied
  bool ended = false;                 ///< the session has ended, nothing follows
  bool operator==(const MapProgress&) const = default;
};

/// A change of the map as absolute values: applying it twice is applying it once. What is relative in it
/// (ReferenceMove) is applied by whoever holds an older version alone. One delta becomes one map record, or a
/// group of them.
struct MapDelta {
  MapEvent event = MapEvent::kSnapshot;
  std::optional<KeyframeId> about;  ///< the keyframe whose arrival caused it
  std::optional<MapId> map_id;
  uint64_t version = 0;                   ///< the map's version after it; counts deltas
  std::optional<uint64_t> correction_id;  ///< the correction that was applied or refused
  std::optional<uint32_t> request;        ///< the AdjustRequest of progress.camera that is answered, which
                                          ///< was put in progress.frontend.epoch
  std::optional<int64_t> stamp_ns;        ///< capture time of `about`, where that is known
  RecordGroup group;
  std::string note;
  MapProgress progress;
  std::vector<KeyframeState> keyframes;
  std::vector<KeyframePose> keyframe_poses;
  std::vector<ReferenceMove> reference_moves;  ///< a reference once
  std::vector<LandmarkState> landmarks;
  std::vector<LandmarkPosition> landmark_positions;
  std::vector<LandmarkEvidenceState> landmark_evidence;
  std::vector<ObservationState> observations;
  std::vector<KeyframeTombstone> keyframe_tombstones;
  std::vector<LandmarkTombstone> landmark_tombstones;
  std::vector<MapId> dropped_maps;

  bool Empty() const {
    return keyframes.empty() && keyframe_poses.empty() && reference_moves.empty() && landmarks.empty() &&
           landmark_positions.empty() && landmark_evidence.empty() && observations.empty() &&
           keyframe_tombstones.empty() && landmark_tombstones.empty() && dropped_maps.empty();
  }
};

}  // namespace dmslam
