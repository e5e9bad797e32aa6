#include "collector/proposed_keyframes.h"

#include <algorithm>

#include "dmslam/console/log.h"
#include "dmslam/runtime/keyframe_limit.h"

namespace dmslam {
namespace {

constexpr int kMostOften = 30;  // a record is said again

}  // namespace

void ProposedKeyframes::ReadNote(const std::string& kind, std::istream& text) {
  if (MapId map_id = 0; kind == "dropped" && text >> map_id) dropped_.insert(map_id);
  if (int64_t epoch = 0; (kind == "begun" || kind == "resumed") && text >> epoch) {
    map_begun_in_ = epoch;
    if (kind == "resumed") OnAllDied();
  }
  uint64_t value = 0;
  if ((kind != "keyframe" && kind != "mapped") || !(text >> value)) return;
  const KeyframeId id{value};
  if (kind == "mapped") {
    not_taken_.erase(id);
    return;
  }
  MapId map_id = 0;
  if (!(text >> map_id)) return;
  maps_[id] = map_id;
  if (Version said; text >> said.epoch >> said.seq) not_taken_[id] = said;
}

void ProposedKeyframes::OnProposal(KeyframeId id, MapId map_id, const Version& said, int64_t now_ns) {
  const auto before = not_taken_.find(id);
  const bool said_again = before != not_taken_.end() && before->second.epoch < said.epoch;
  if (said_again || !maps_.contains(id)) {
    note_("keyframe " + std::to_string(id.value) + " " + std::to_string(map_id) + " " +
          std::to_string(said.epoch) + " " + std::to_string(said.seq));
    not_taken_[id] = said;
  }
  maps_[id] = map_id;
  heard_ns_.emplace(id, now_ns);
}

void ProposedKeyframes::KeepRecord(KeyframeId id, const SharedBytes& record) {
  if (!not_taken_.contains(id)) return;
  in_flight_[id] = {record, 0};
  if (in_flight_.size() > kMostUnacceptedKeyframes) in_flight_.erase(in_flight_.begin());
}

void ProposedKeyframes::OnMapped(CameraId camera, const StreamPosition& mapped) {
  std::erase_if(not_taken_, [&](const auto& item) {
    const auto& [id, said] = item;
    const bool taken = id.camera() == camera && said.epoch == mapped.epoch && said.seq <= mapped.seq;
    if (taken) note_("mapped " + std::to_string(id.value));
    if (taken) in_flight_.erase(id);
    return taken;
  });
}

bool ProposedKeyframes::AnyMapped() const {
  return std::ranges::any_of(maps_, [this](const auto& item) {
    return !not_taken_.contains(item.first) && !before_crash_.contains(item.first);
  });
}

void ProposedKeyframes::OnAllDied() {
  ++times_all_died_;
  for (const auto& [id, map_id] : maps_) before_crash_.insert(id);
}

void ProposedKeyframes::OnFreshMap(int64_t epoch, bool is_saved) {
  if (map_begun_in_ == epoch) return;
  const bool all_died = AnyMapped() || (is_saved && !maps_.empty());
  note_((all_died ? "resumed " : "begun ") + std::to_string(epoch));
  map_begun_in_ = epoch;
  if (all_died) OnAllDied();
}

void ProposedKeyframes::OnDropped(MapId map_id) {
  if (dropped_.insert(map_id).second) note_("dropped " + std::to_string(map_id));
}

/// It is there, or was, or its map was given up.
bool ProposedKeyframes::NeedNotBeThere(KeyframeId id, MapId map_id, const IsKnown& is_known) const {
  return is_known(id) || given_up_.contains(map_id) || dropped_.contains(map_id);
}

std::vector<ProposedKeyframes::Left> ProposedKeyframes::ToSayAgain(const LivesIn& lives,
                                                                   const IsKnown& is_known) {
  std::vector<Left> left;
  for (auto& [id, in_flight] : in_flight_) {
    if (lives(id.camera(), not_taken_.at(id).epoch) || in_flight.repeated >= kMostOften ||
        NeedNotBeThere(id, maps_.at(id), is_known))
      continue;
    ++in_flight.repeated;
    left.push_back({id, in_flight.record});
  }
  return left;
}

std::optional<int64_t> ProposedKeyframes::HeardNs(KeyframeId id) const {
  const auto heard = heard_ns_.find(id);
  return heard == heard_ns_.end() ? std::nullopt : std::optional(heard->second);
}

void ProposedKeyframes::CountMissing(const IsKnown& is_known, const std::function<int64_t(CameraId)>& mapped,
                                     KeyframeRecord* record) const {
  record->proposed = maps_.size();
  for (const auto& [id, map_id] : maps_) {
    if (NeedNotBeThere(id, map_id, is_known)) continue;
    const auto said = not_taken_.find(id);
    if (before_crash_.contains(id)) {
      ++record->lost_in_crash;
    } else if (said != not_taken_.end() && mapped(id.camera()) > said->second.epoch) {
      // No mapper had taken it when the frontend died that had said it, and the map goes on with another one.
      ++record->lost_with_frontend;
      LogWarning("the keyframe of frame {} is lost: its frontend died before a mapper had it",
                 id.frame_index());
    } else {
      ++record->missing;
      LogWarning("the keyframe of frame {} is missing in map {}", id.frame_index(), map_id);
    }
  }
}

}  // namespace dmslam
