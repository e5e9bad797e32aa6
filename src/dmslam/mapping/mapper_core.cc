#include "dmslam/mapping/mapper_core.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "dmslam/dynamics/seen_through.h"
#include "dmslam/map/may_drop.h"
#include "dmslam/mapping/correction.h"
#include "dmslam/mapping/culling.h"
#include "dmslam/mapping/first_map.h"
#include "dmslam/mapping/keyframe_insertion.h"
#include "dmslam/mapping/landmark_fusion.h"
#include "dmslam/mapping/local_adjustment.h"

namespace dmslam {
namespace {

void Count(int more, uint64_t* total) { *total += static_cast<uint64_t>(more); }

}  // namespace

MapperCore::MapperCore(const MapperOptions& options, const Camera& camera, const Pyramid& pyramid,
                       uint16_t epoch_ordinal, Sink sink)
    : options_(options), map_(camera, pyramid), maker_(epoch_ordinal), sink_(std::move(sink)) {}

void MapperCore::ContinueSaved(Map map, uint64_t successor) {
  MapEditor saved(std::move(map));
  saved.ForgetProgress();
  Continue(std::move(saved), successor);
  for (const auto& [id, keyframe] : map_.keyframes()) as_saved_.insert(keyframe.map_id);
}

void MapperCore::Continue(Map map, uint64_t successor) {
  map.KeepFeaturesIn(map_.feature_store());
  map_ = MapEditor(std::move(map));
  maker_.Continue(map_, successor);
  order_.Assume(map_);
  finished_.emplace();
}

void MapperCore::Publish(MapEvent event, std::optional<KeyframeId> about, std::optional<MapId> map_id,
                         std::optional<uint64_t> correction_id, std::string note) {
  MapDelta delta = map_.TakeDelta(event, about, map_id);
  delta.correction_id = correction_id;
  delta.note = std::move(note);
  Emit(delta);
}

/// What changes nothing is published only where it is an answer.
void MapperCore::Emit(const MapDelta& delta) {
  if (IsAnswer(delta.event) || !delta.Empty()) sink_(delta);
}

bool MapperCore::Interrupted() {
  if (!interrupt_ || !interrupt_()) return false;
  ++counters_.adjustments_interrupted;
  return true;
}

// ---- A first map ----

bool MapperCore::OnInitialMap(const InitialMap& proposal) {
  if (map_.HasKnown(proposal.second.id)) return false;
  const bool is_new = !map_.HasKnown(proposal.first.id) && !map_.HasMap(proposal.map_id);
  if (is_new && StartMap(proposal)) {
    adjusted_ = false;
    Publish(MapEvent::kMapStarted, proposal.second.id, proposal.map_id);
    return true;
  }
  ++counters_.maps_refused;
  if (is_new) map_.DropMap(proposal.map_id);
  Publish(MapEvent::kFirstMapRefused, proposal.second.id, proposal.map_id, {},
          is_new ? "too few landmarks after bundle adjustment" : "the map or its first keyframe is known");
  return false;
}

/// False where it does not hold: what was built is then still there.
bool MapperCore::StartMap(const InitialMap& proposal) {
  order_.Add(proposal.first.id);
  for (const InitialMap::View& view : proposal.between) {
    if (!map_.HasKnown(view.keyframe.id)) order_.Add(view.keyframe.id);
  }
  order_.Add(proposal.second.id);
  return BuildFirstMap(map_, proposal, maker_);
}

// ---- A keyframe ----

KeyframeOutcome MapperCore::OnKeyframe(const KeyframeProposal& proposal) {
  const InsertionReport insertion = FindOrInsert(proposal);
  const Keyframe* keyframe = insertion.keyframe;
  if (keyframe == nullptr) return insertion.outcome;
  const MapId map_id = keyframe->map_id;
  as_saved_.erase(map_id);
  CullYoung(map_id);
  CreateLandmarks(map_, *keyframe, proposal.moving, options_.creation, maker_, &counters_.creation);
  RemoveSeenThroughBy(*keyframe);
  Publish(MapEvent::kLandmarksCreated, proposal.id, map_id);
  if (!Interrupted()) {
    counters_.fused += FuseWithNeighbours(map_, *keyframe, options_);
    Publish(MapEvent::kFused, proposal.id, map_id);
    Adjust(*keyframe);
    Publish(MapEvent::kAdjusted, proposal.id, map_id);
    Count(CullRedundantKeyframes(map_, *keyframe, proposal.reference, options_), &counters_.keyframes_culled);
  }
  Publish(MapEvent::kMapped, proposal.id, map_id);
  return KeyframeOutcome::kInserted;
}

/// The keyframe counts as inserted, too, where a mapper that has ended may have left it unfinished.
InsertionReport MapperCore::FindOrInsert(const KeyframeProposal& proposal) {
  adjusted_ = false;
  const bool maybe_unfinished = finished_ && finished_->insert(proposal.id.camera()).second;
  const Keyframe* there = map_.FindKeyframe(proposal.id);
  if (maybe_unfinished && there != nullptr) return {KeyframeOutcome::kInserted, there, 0};
  const InsertionReport report = InsertKeyframe(map_, proposal);
  Count(report.observations_dropped, &counters_.observations_dropped);
  if (report.outcome == KeyframeOutcome::kRefused) ++counters_.keyframes_refused;
  if (report.keyframe == nullptr) return report;
  order_.Add(proposal.id);
  ++counters_.keyframes_inserted;
  Publish(MapEvent::kKeyframeInserted, proposal.id, report.keyframe->map_id);
  return report;
}

void MapperCore::CullYoung(MapId map_id) {
  Count(CullYoungLandmarks(map_, map_id, order_, options_), &counters_.landmarks_culled);
}

void MapperCore::RemoveSeenThroughBy(const Keyframe& keyframe) {
  if (!options_.seen_through.enabled) return;
  const MapId map_id = keyframe.map_id;
  const int removed = RemoveSeenThrough(map_, keyframe);
  Count(removed, &counters_.landmarks_seen_through);
  Count(removed, &seen_through_[map_id]);
}

void MapperCore::Adjust(const Keyframe& keyframe) {
  const MapAdjustmentReport report = AdjustLocally(map_, keyframe, options_, interrupt_);
  if (report.bundle.interrupted) ++counters_.adjustments_interrupted;
}

// ---- Evidence, resets, the end ----

void MapperCore::OnEvidence(const FrameEvidence& evidence) {
  const EvidenceReport report = ApplyEvidence(map_, evidence, options_.belief);
  Count(report.unknown, &counters_.evidence_dropped);
  Count(report.removed, &counters_.landmarks_moving_removed);
  Publish(MapEvent::kEvidence, {}, evidence.map_id);
}

void MapperCore::OnReset(const MapReset& reset) {
  if (reset.fate == MapReset::Fate::kKeep || !MayDrop(map_, reset.map_id, reset.camera_id)) return;
  ++counters_.maps_dropped;
  map_.DropMap(reset.map_id);
  Publish(MapEvent::kMapDropped, {}, reset.map_id, {}, reset.reason);
}

void MapperCore::GiveTurn(KeyframeId frame) { Publish(MapEvent::kTurn, frame, {}); }

void MapperCore::OnAdjustRequest(const AdjustRequest& request) {
  if (!adjusted_) AdjustMaps();
  AnswerRequest(request);
}

/// Each camera counts its own requests, so the answer's progress is that of the camera that asked.
void MapperCore::AnswerRequest(const AdjustRequest& request) {
  map_.SetProgress(map_.progress(request.camera_id));
  MapDelta delta = map_.TakeDelta(MapEvent::kRequestDone, {}, {});
  delta.request = request.request;
  Emit(delta);
}

void MapperCore::Settle(KeyframeId id, std::optional<MapId> map_id, std::string why) {
  MapProgress progress = map_.progress(id.camera());
  progress.settled = id;
  map_.SetProgress(progress);
  Publish(MapEvent::kSettled, id, map_id, {}, std::move(why));
}

void MapperCore::AdjustMaps() {
  std::set<MapId> maps;
  for (const auto& [id, keyframe] : map_.keyframes()) maps.insert(keyframe.map_id);
  for (const MapId map_id : maps) {
    if (Stopped()) return;
    if (as_saved_.contains(map_id)) continue;
    Count(RemoveTooNear(map_, map_id, options_.min_depth), &counters_.landmarks_culled);
    AdjustAtEnd(map_id);
    Publish(MapEvent::kMapAdjusted, {}, map_id);
    if (!options_.seen_through.enabled) continue;
    // With the next record: frames take their last poses from the map that still has those who stood.
    Count(RemoveUnproven(map_, map_id, seen_through_[map_id]), &counters_.landmarks_seen_through);
  }
  adjusted_ = true;
}

/// A large map's older keyframes hold the newest in place: local adjustments have settled them long ago, and
/// the end of a run takes no longer the longer it was.
void MapperCore::AdjustAtEnd(MapId map_id) {
  const auto most = static_cast<size_t>(options_.final_adjustment_keyframes);
  std::vector<const Keyframe*> keyframes = map_.KeyframesOf(map_id);
  if (keyframes.size() > most) {
    keyframes.clear();
    for (const KeyframeId id : order_.Newest(map_, map_id, options_.final_adjustment_keyframes))
      keyframes.push_back(&map_.At(id));
    std::ranges::sort(keyframes, {}, &Keyframe::id);
  }
  BundleOptions bundle = GlobalBundleOptions(options_.final_adjustment_iterations);
  bundle.interrupt = stop_;
  AdjustKeyframes(map_, keyframes, std::numeric_limits<int>::max(), options_.keypoint_sigma_px, bundle);
}

void MapperCore::End(bool as_it_is) {
  if (!as_it_is && !adjusted_) AdjustMaps();
  MapProgress progress = map_.progress();
  progress.ended = true;
  map_.SetProgress(progress);
  Publish(MapEvent::kEnded, {}, {});
}

// ---- Corrections ----

void MapperCore::RefuseCorrection(uint64_t correction_id, const std::string& why) {
  ++counters_.corrections_refused;
  Publish(MapEvent::kCorrectionRefused, {}, {}, correction_id, why);
}

void MapperCore::OnLoopAnswer(const LoopAnswer& answer) {
  if (answer.kind == LoopAnswer::Kind::kNone) return;
  if (const std::string why = WhyRefused(map_, answer); !why.empty()) {
    ++counters_.corrections_refused;
    Publish(MapEvent::kCorrectionRefused, answer.keyframe, {}, answer.correction_id, why);
    return;
  }
  counters_.fused += ApplyCorrection(map_, answer, options_);
  ++counters_.corrections_applied;
  MapProgress progress = map_.progress();
  progress.corrected = map_.version() + 1;  // that of the record which says so
  map_.SetProgress(progress);
  const bool loop = answer.kind == LoopAnswer::Kind::kLoop;
  const KeyframeId about = answer.seen_from.value_or(answer.keyframe);
  // The keyframe that was asked about may be in another map than was adjusted.
  const Keyframe* anchor = map_.Resolve(loop ? about : answer.corrections.front().keyframe);
  if (anchor != nullptr) as_saved_.erase(anchor->map_id);
  adjusted_ = false;  // a global adjustment too is composed with what has come since its base
  Publish(loop ? MapEvent::kCorrected : MapEvent::kGloballyAdjusted, about,
          anchor != nullptr ? std::optional(anchor->map_id) : std::nullopt, answer.correction_id,
          answer.note);
}

}  // namespace dmslam
