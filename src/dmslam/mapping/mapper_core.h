#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "dmslam/map/map_editor.h"
#include "dmslam/map/proposals.h"
#include "dmslam/mapping/insertion_order.h"
#include "dmslam/mapping/keyframe_insertion.h"
#include "dmslam/mapping/landmark_creation.h"
#include "dmslam/mapping/landmark_fusion.h"
#include "dmslam/mapping/landmark_maker.h"
#include "dmslam/mapping/mapper_options.h"

namespace dmslam {

/// What the mapper did, for its status.
struct MapperCounters {
  uint64_t keyframes_inserted = 0;
  uint64_t keyframes_refused = 0;  ///< their reference is unknown
  uint64_t keyframes_culled = 0;
  uint64_t landmarks_culled = 0;
  uint64_t landmarks_moving_removed = 0;
  uint64_t landmarks_seen_through = 0;  ///< removed because other keyframes see what lies behind them
  uint64_t observations_dropped = 0;    ///< of landmarks that are gone
  uint64_t evidence_dropped = 0;        ///< of landmarks that are gone
  FusionCounts fused;
  uint64_t corrections_applied = 0;
  uint64_t corrections_refused = 0;
  uint64_t maps_refused = 0;
  uint64_t maps_dropped = 0;
  uint64_t adjustments_interrupted = 0;  ///< since a keyframe waited
  CreationDiagnostics creation;
};

/// The map's only writer: takes the frontend's records in order, edits the map, and hands every change out as
/// a delta. Knows no bus, no clock and no thread. Paper 2.3 (local mapping), with landmark creation after
/// Algorithm 1.
class MapperCore {
 public:
  using Sink = std::function<void(const MapDelta&)>;

  MapperCore(const MapperOptions& options, const Camera& camera, const Pyramid& pyramid,
             uint16_t epoch_ordinal, Sink sink);

  /// Asked now and then during long work; true: finish early (a keyframe waits). May be empty (lock-step).
  void SetInterrupt(std::function<bool()> interrupt) { interrupt_ = std::move(interrupt); }
  /// Asked now and then while whole maps are adjusted, which no keyframe cuts short; true: the map stays as
  /// far as it has come. May be empty.
  void SetStop(std::function<bool()> stop) { stop_ = std::move(stop); }

  /// See Map; to be said first.
  void KeepFeaturesIn(std::shared_ptr<FeatureStore> store) { map_.KeepFeaturesIn(std::move(store)); }
  /// Continues a map that others kept (after a restart) or that was saved: new landmarks get ids of an
  /// ordinal that the map does not know, and the local mapping of the keyframe that is proposed first is done
  /// again where the map has it: what was done of it is not known.
  /// `successor`: see LandmarkMaker.
  void Continue(Map map, uint64_t successor = 0);
  /// The same with a map that was saved: the streams it was made of are not today's.
  void ContinueSaved(Map map, uint64_t successor = 0);
  /// What of the streams is worked into the map; travels with the next deltas.
  void SetProgress(const MapProgress& progress) { map_.SetProgress(progress); }

  /// Builds a map of the proposal; false when it is known already or does not hold (a record says so).
  bool OnInitialMap(const InitialMap& proposal);
  /// Inserts a keyframe and does the local mapping that follows.
  KeyframeOutcome OnKeyframe(const KeyframeProposal& proposal);
  void OnEvidence(const FrameEvidence& evidence);
  void OnReset(const MapReset& reset);
  /// Adjusts every map as a whole, of a large one the newest keyframes, once for what has come until now, and
  /// answers the request. A saved map that got neither a keyframe nor a correction is not adjusted: it was
  /// when it was saved.
  void OnAdjustRequest(const AdjustRequest& request);
  /// Says that all maps are adjusted, as far as they are to be.
  void AnswerRequest(const AdjustRequest& request);
  /// A loop or a global adjustment, composed with the poses of now: local mapping since its base changes
  /// nothing about it. Refused with a record where it no longer applies (WhyRefused).
  void OnLoopAnswer(const LoopAnswer& answer);
  /// Says once more that keyframe `id` is mapped, for a loop closer that has not heard it.
  void AskAgain(KeyframeId id, MapId map_id) { Publish(MapEvent::kMapped, id, map_id); }
  /// Says that a correction is not applied.
  void RefuseCorrection(uint64_t correction_id, const std::string& why);
  /// Says that all that comes before a frame is in the map: its camera may work on it (lock-step of several).
  void GiveTurn(KeyframeId frame);
  /// Says that all work that keyframe `id` caused is done, and of one that was refused why; `why` is empty
  /// for all others.
  void Settle(KeyframeId id, std::optional<MapId> map_id, std::string why = {});
  /// Says that the sequence has ended and that all it caused is done; first adjusts all maps, unless it
  /// is to leave them as they are.
  void End(bool as_it_is = false);

  const Map& map() const { return map_; }
  const MapperCounters& counters() const { return counters_; }

 private:
  InsertionReport FindOrInsert(const KeyframeProposal& proposal);
  void CullYoung(MapId map_id);
  void RemoveSeenThroughBy(const Keyframe& keyframe);
  void Adjust(const Keyframe& keyframe);
  void AdjustMaps();
  void AdjustAtEnd(MapId map_id);
  void Publish(MapEvent event, std::optional<KeyframeId> about, std::optional<MapId> map_id,
               std::optional<uint64_t> correction_id = {}, std::string note = {});
  void Emit(const MapDelta& delta);
  bool StartMap(const InitialMap& proposal);
  bool Interrupted();
  bool Stopped() const { return stop_ && stop_(); }

  MapperOptions options_;
  MapEditor map_;
  LandmarkMaker maker_;
  InsertionOrder order_;
  bool adjusted_ = false;  ///< as a whole, since the last keyframe, first map or correction
  /// The map is continued: its mapper may have ended in the middle of the keyframe that comes first, of each
  /// camera; the cameras of which one has come. None: it is not.
  std::optional<std::set<CameraId>> finished_;
  Sink sink_;
  std::function<bool()> interrupt_, stop_;
  MapperCounters counters_;
  std::set<MapId> as_saved_;                ///< saved maps that got neither a keyframe nor a correction
  std::map<MapId, uint64_t> seen_through_;  ///< landmarks of each map that were removed for it
};

}  // namespace dmslam
