#include "dmslam/mapping/landmark_history.h"

#include <algorithm>
#include <utility>

#include "dmslam/map/map_states.h"

namespace dmslam {
namespace {

LandmarkOrigin OriginOf(MapEvent event) {
  switch (event) {
    case MapEvent::kSnapshot:
      return LandmarkOrigin::kNotTold;
    case MapEvent::kMapStarted:
      return LandmarkOrigin::kFirstMap;
    case MapEvent::kLandmarksCreated:
      return LandmarkOrigin::kTriangulated;
    default:
      return LandmarkOrigin::kOther;
  }
}

}  // namespace

void LandmarkHistories::BeginAnew() {
  const MapMoment until{map_.version(), MapEvent::kSnapshot, std::nullopt, newest_ns_};
  for (const LandmarkId id : map_.LandmarkIdsSorted()) End(id, until, LandmarkFate::kLeftOut, "");
  map_.Clear();
  fates_.OnNewWriter();
}

void LandmarkHistories::Add(const MapDelta& delta, const FrameEvidence* said) {
  const MapMoment now = MomentOf(delta, said);
  fates_.Follow(map_, delta);
  const Sights before = SightsThatMayChange(delta);
  EndThoseThatGo(delta, now, said);
  map_.Apply(delta);
  for (const LandmarkState& state : delta.landmarks) {
    NoteMade(state.id, now);
    NoteEvidence(state.id, now);
  }
  for (const LandmarkEvidenceState& state : delta.landmark_evidence) NoteEvidence(state.id, now);
  NoteLostSights(before, now);
  for (const KeyframeState& keyframe : delta.keyframes)
    newest_ns_ = std::max(newest_ns_.value_or(keyframe.stamp_ns), keyframe.stamp_ns);
}

MapMoment LandmarkHistories::MomentOf(const MapDelta& delta, const FrameEvidence* said) const {
  MapMoment moment{delta.version, delta.event, delta.about, delta.stamp_ns ? delta.stamp_ns : newest_ns_};
  if (said != nullptr) moment.stamp_ns = said->stamp_ns;
  return moment;
}

/// Of landmarks that features see otherwise after the change.
LandmarkHistories::Sights LandmarkHistories::SightsThatMayChange(const MapDelta& delta) const {
  Sights sights;
  const auto add = [&](const Landmark* landmark) {
    if (landmark != nullptr && !sights.contains(landmark->id))
      sights.emplace(landmark->id, SightsOf(map_, *landmark));
  };
  for (const ObservationState& o : delta.observations) {
    const Keyframe* keyframe = map_.FindKeyframe(o.keyframe);
    if (keyframe != nullptr && o.feature < keyframe->landmarks.size())
      add(map_.LandmarkSeenBy(*keyframe, o.feature));
  }
  for (const KeyframeTombstone& tombstone : delta.keyframe_tombstones) {
    const Keyframe* keyframe = map_.FindKeyframe(tombstone.id);
    for (size_t i = 0; keyframe != nullptr && i < keyframe->landmarks.size(); ++i)
      add(map_.LandmarkSeenBy(*keyframe, i));
  }
  return sights;
}

// ---- How they go ----

void LandmarkHistories::EndThoseThatGo(const MapDelta& delta, const MapMoment& now,
                                       const FrameEvidence* said) {
  for (const MapId map_id : delta.dropped_maps) {
    for (const Landmark* landmark : map_.LandmarksOf(map_id))
      End(landmark->id, now, LandmarkFate::kMapDropped, delta.note);
  }
  for (const LandmarkTombstone& tombstone : delta.landmark_tombstones) {
    if (IsKnownToBeGone(tombstone.id)) continue;  // told once more
    End(tombstone.id, now, fates_.Of(tombstone, map_, delta), delta.note);
    LandmarkHistory& history = landmarks_.at(tombstone.id);
    if (said != nullptr) NoteLastEvidence(&history, *said);
    if (!tombstone.replaced_by) continue;
    history.end->into = tombstone.replaced_by;
    HistoryOf(*tombstone.replaced_by, now).absorbed.push_back({tombstone.id, now});
  }
}

void LandmarkHistories::End(LandmarkId id, const MapMoment& now, LandmarkFate fate, const std::string& note) {
  LandmarkEnd end{now, fate, std::nullopt, note, std::nullopt, {}};
  if (const Landmark* landmark = map_.FindLandmark(id)) {
    end.last = StateOf(*landmark);
    end.seen = SightsOf(map_, *landmark);
  }
  HistoryOf(id, now).end = std::move(end);
}

/// Of one that goes for it: the map's record does not tell it any more.
void LandmarkHistories::NoteLastEvidence(LandmarkHistory* history, const FrameEvidence& said) const {
  const Landmark* landmark = map_.FindLandmark(history->id);
  if (landmark == nullptr) return;
  LandmarkEnd& end = *history->end;
  end.last->evidence = fates_.With(said, map_, *landmark);
  history->evidence.push_back({end.when, end.last->evidence});
}

/// What a mapper that began anew did not tell may still come.
bool LandmarkHistories::IsKnownToBeGone(LandmarkId id) const {
  const auto known = landmarks_.find(id);
  return known != landmarks_.end() && known->second.end && known->second.end->fate != LandmarkFate::kLeftOut;
}

void LandmarkHistories::Finish() {
  for (auto& [id, history] : landmarks_) {
    if (!history.end && map_.FindLandmark(id) == nullptr)
      history.end = LandmarkEnd{history.made, LandmarkFate::kNotTold, {}, "", {}, {}};
  }
}

// ---- How they come, and what is said of them ----

LandmarkHistory& LandmarkHistories::HistoryOf(LandmarkId id, const MapMoment& now) {
  const auto [at, is_new] = landmarks_.try_emplace(id);
  if (is_new) {
    at->second.id = id;
    at->second.made = now;
    at->second.origin = OriginOf(now.event);
  }
  return at->second;
}

/// After a change that tells all of its state.
void LandmarkHistories::NoteMade(LandmarkId id, const MapMoment& now) {
  const Landmark* landmark = map_.FindLandmark(id);
  if (landmark == nullptr) return;
  const bool is_new = !landmarks_.contains(id);
  LandmarkHistory& history = HistoryOf(id, now);
  history.end.reset();  // a map that goes on from an older one may have it again
  const bool made_now = history.made.version == now.version && history.made_from.empty();
  if (history.origin == LandmarkOrigin::kNotTold || !(is_new || made_now)) return;
  history.made_from = SightsOf(map_, *landmark);
  if (now.about) history.widest = WidestAngleWith(map_, *landmark, *now.about);
}

void LandmarkHistories::NoteEvidence(LandmarkId id, const MapMoment& now) {
  const Landmark* landmark = map_.FindLandmark(id);
  if (landmark == nullptr) return;
  std::vector<EvidenceStep>& steps = HistoryOf(id, now).evidence;
  const bool all = watched_.contains(id);
  const bool moved_before = !steps.empty() && IsBelievedToMove(steps.back().evidence);
  const bool is_news = all ? steps.empty() || steps.back().evidence != landmark->evidence
                           : moved_before != IsBelievedToMove(landmark->evidence);
  if (is_news) steps.push_back({now, landmark->evidence});
}

void LandmarkHistories::NoteLostSights(const Sights& before, const MapMoment& now) {
  for (const auto& [id, sights] : before) {
    const Landmark* landmark = map_.FindLandmark(id);
    if (landmark == nullptr) continue;  // its end says who saw it
    for (const LandmarkSight& sight : sights) {
      if (landmark->SeenBy(sight.keyframe) != nullptr) continue;
      const bool culled = map_.FindKeyframe(sight.keyframe) == nullptr;
      HistoryOf(id, now).former.push_back({sight, now, culled});
    }
  }
}

}  // namespace dmslam
