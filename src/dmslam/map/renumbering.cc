#include "dmslam/map/renumbering.h"

#include <algorithm>
#include <utility>

#include "dmslam/map/map_editor.h"
#include "dmslam/map/snapshot.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr size_t kAtOnce = SIZE_MAX / 2;  // bytes of a piece: all in one

template <typename Number>
Number Named(const std::map<Number, Number>& names, Number number) {
  const auto found = names.find(number);
  return found == names.end() ? number : found->second;
}

/// Gives things their new names, one kind at a time.
class Namer {
 public:
  explicit Namer(const Renumbering& names) : names_(names) {}

  void Rename(KeyframeId& id) const {
    id = KeyframeId::Make(Named(names_.sessions, id.session()), id.frame_index(), id.camera());
  }
  void Rename(LandmarkId& id) const {
    id = LandmarkId::Make(Named(names_.ordinals, id.epoch_ordinal()), id.number());
  }
  template <typename Id>
  void Rename(std::optional<Id>& id) const {
    if (id) Rename(*id);
  }
  void RenameMap(MapId& id) const { id = Named(names_.maps, id); }

  void Rename(KeyframeState& state) const {
    Rename(state.id);
    RenameMap(state.map_id);
    Rename(state.parent);
    for (KeyframeId& other : state.loop_edges) Rename(other);
    std::ranges::sort(state.loop_edges);
  }
  void Rename(KeyframePose& pose) const { Rename(pose.id); }
  void Rename(ReferenceMove& move) const { Rename(move.reference); }
  void Rename(LandmarkState& state) const {
    Rename(state.id);
    RenameMap(state.map_id);
    Rename(state.reference);
    Rename(state.first_keyframe);
  }
  void Rename(LandmarkPosition& position) const { Rename(position.id); }
  void Rename(LandmarkEvidenceState& state) const { Rename(state.id); }
  void Rename(ObservationState& observation) const {
    Rename(observation.keyframe);
    Rename(observation.landmark);
  }
  void Rename(KeyframeTombstone& tombstone) const {
    Rename(tombstone.id);
    Rename(tombstone.parent);
  }
  void Rename(LandmarkTombstone& tombstone) const {
    Rename(tombstone.id);
    Rename(tombstone.replaced_by);
  }
  template <typename Thing>
  void RenameAll(std::vector<Thing>& things) const {
    for (Thing& thing : things) Rename(thing);
  }

 private:
  const Renumbering& names_;
};

MapDelta Whole(const Map& map) { return std::move(CutSnapshot(map, std::nullopt, kAtOnce).front()); }

}  // namespace

std::set<uint32_t> SessionsOf(const Map& map) {
  std::set<uint32_t> sessions;
  for (const auto& [id, keyframe] : map.keyframes()) sessions.insert(id.session());
  for (const auto& [id, tombstone] : map.keyframe_tombstones()) sessions.insert(id.session());
  return sessions;
}

std::set<uint16_t> OrdinalsOf(const Map& map) {
  std::set<uint16_t> ordinals;
  for (const LandmarkId id : map.LandmarkIdsSorted()) ordinals.insert(id.epoch_ordinal());
  for (const auto& [id, replaced_by] : map.landmark_tombstones()) ordinals.insert(id.epoch_ordinal());
  return ordinals;
}

std::map<uint16_t, uint32_t> SessionsByOrdinal(const Map& map) {
  std::map<uint16_t, uint32_t> sessions;
  for (const LandmarkId id : map.LandmarkIdsSorted()) {
    uint32_t& session = sessions[id.epoch_ordinal()];
    session = std::max(session, map.At(id).first_keyframe.session());
  }
  return sessions;
}

std::set<MapId> MapsOf(const Map& map) {
  std::set<MapId> maps;
  for (const auto& [id, keyframe] : map.keyframes()) maps.insert(keyframe.map_id);
  return maps;
}

Renumbering NamesBeside(const Map& a, const Map& b, bool sessions_too) {
  Renumbering names;
  const std::set<uint16_t> ordinals = OrdinalsOf(a);
  uint32_t ordinal = ordinals.empty() ? 0 : *ordinals.rbegin();
  for (const uint16_t of_b : OrdinalsOf(b)) {
    if (++ordinal > LandmarkId::kLastOrdinal) throw InputError("the ordinals of landmarks are used up");
    names.ordinals[of_b] = static_cast<uint16_t>(ordinal);
  }
  const std::set<MapId> maps = MapsOf(a);
  MapId map_id = maps.empty() ? 0 : *maps.rbegin();
  for (const MapId of_b : MapsOf(b)) names.maps[of_b] = ++map_id;
  if (!sessions_too) return names;
  const std::set<uint32_t> sessions_a = SessionsOf(a), sessions_b = SessionsOf(b);
  uint32_t session = sessions_a.empty() ? 0 : *sessions_a.rbegin();
  if (!sessions_b.empty()) session = std::max(session, *sessions_b.rbegin());
  for (const uint32_t of_b : sessions_b) {
    if (sessions_a.contains(of_b) || !names.sessions.empty()) names.sessions[of_b] = ++session;
  }
  return names;
}

MapDelta Renumbered(MapDelta delta, const Renumbering& names) {
  const Namer namer(names);
  namer.Rename(delta.about);
  if (delta.map_id) namer.RenameMap(*delta.map_id);
  namer.Rename(delta.progress.settled);
  namer.RenameAll(delta.keyframes);
  namer.RenameAll(delta.keyframe_poses);
  namer.RenameAll(delta.reference_moves);
  namer.RenameAll(delta.landmarks);
  namer.RenameAll(delta.landmark_positions);
  namer.RenameAll(delta.landmark_evidence);
  namer.RenameAll(delta.observations);
  namer.RenameAll(delta.keyframe_tombstones);
  namer.RenameAll(delta.landmark_tombstones);
  for (MapId& map_id : delta.dropped_maps) namer.RenameMap(map_id);
  return delta;
}

Replica Beside(const Map& a, const Map& b, const Renumbering& names_of_b) {
  Replica both(a.camera(), a.pyramid());
  MapDelta of_a = Whole(a), of_b = Renumbered(Whole(b), names_of_b);
  of_a.progress = of_b.progress = {};  // the streams they were made of are not those of who goes on
  both.Apply(of_a);
  both.Apply(of_b);
  return both;
}

Replica OnlyMap(const Map& map, MapId map_id) {
  MapEditor rest(map);
  for (const MapId other : MapsOf(map)) {
    if (other != map_id) rest.DropMap(other);
  }
  Replica only(map.camera(), map.pyramid());
  MapDelta whole = Whole(rest);
  std::erase_if(whole.keyframe_tombstones, [&](const KeyframeTombstone& tombstone) {
    return !rest.ResolvePose(tombstone.id).has_value();
  });
  std::erase_if(whole.landmark_tombstones, [&](const LandmarkTombstone& tombstone) {
    return tombstone.replaced_by.has_value() && rest.Resolve(tombstone.id) == nullptr;
  });
  only.Apply(whole);
  return only;
}

}  // namespace dmslam
