#pragma once

#include <cstdint>
#include <functional>
#include <istream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "collector/keyframe_record.h"
#include "dmslam/map/map_delta.h"
#include "dmslam/messaging/types.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// The keyframes that frontends said should be: whether a mapper took each, what to say again where its
/// frontend is gone, and what is missing in the end. What a collector after this one must know of it goes
/// into the journal as notes.
class ProposedKeyframes {
 public:
  using Note = std::function<void(const std::string&)>;
  void NoteTo(Note note) { note_ = std::move(note); }
  /// A note of this class's kinds, "keyframe", "mapped", "dropped", "begun" or "resumed"; `text` stands
  /// behind the kind. Others are not read.
  void ReadNote(const std::string& kind, std::istream& text);

  /// `said`: where in the stream of its frontend.
  void OnProposal(KeyframeId id, MapId map_id, const Version& said, int64_t now_ns);
  /// The record that proposed it, while no mapper has taken it.
  void KeepRecord(KeyframeId id, const SharedBytes& record);
  /// The records of a camera's frontend up to there are worked into the map: whoever holds that holds them.
  void OnMapped(CameraId camera, const StreamPosition& mapped);
  /// Its frontend says that a map was wrong: none of its keyframes is missing. It is kept elsewhere that this
  /// was said.
  void OnGivenUp(MapId map_id) { given_up_.insert(map_id); }
  /// The mapper says that a map is no more: none of its keyframes is missing.
  void OnDropped(MapId map_id);
  bool WasDropped(MapId map_id) const { return dropped_.contains(map_id); }
  /// In this term of a mapper a map begins that continues none. Where something was to be in one before, all
  /// who held that had died, and it goes on with the last checkpoint (`is_saved`), or with nothing where
  /// there was none yet. Collectors that follow each other may all hear the beginning of the same term.
  void OnFreshMap(int64_t epoch, bool is_saved);
  /// Whether a mapper has taken any, since all had died.
  bool AnyMapped() const;
  /// All who held the map had died, and a mapper began with the last checkpoint, or with nothing.
  void OnAllDied();
  /// How often that was so.
  int times_all_died() const { return times_all_died_; }

  struct Left {
    KeyframeId id;
    SharedBytes record;
  };
  /// What no mapper has, and nobody says again: its frontend is silent, or another one by now. Of each no
  /// more than so often. `lives`: whether the frontend of that camera still writes in that epoch.
  using LivesIn = std::function<bool(CameraId, int64_t epoch)>;
  using IsKnown = std::function<bool(KeyframeId)>;  ///< it is in the map, or was
  std::vector<Left> ToSayAgain(const LivesIn& lives, const IsKnown& is_known);

  std::optional<int64_t> HeardNs(KeyframeId id) const;
  /// What was proposed in a map that still stands must be in it, or have left it by being culled. `mapped`:
  /// of which epoch of a camera's frontend the map is made.
  void CountMissing(const IsKnown& is_known, const std::function<int64_t(CameraId)>& mapped,
                    KeyframeRecord* record) const;

 private:
  /// A keyframe that no mapper has taken yet, as its frontend said it.
  struct InFlight {
    SharedBytes record;
    int repeated = 0;
  };
  bool NeedNotBeThere(KeyframeId id, MapId map_id, const IsKnown& is_known) const;

  std::map<KeyframeId, MapId> maps_;
  std::map<KeyframeId, int64_t> heard_ns_;  ///< when each was said to be one
  std::set<MapId> given_up_, dropped_;
  std::set<KeyframeId> before_crash_;  ///< those of before all processes died
  int times_all_died_ = 0;
  std::optional<int64_t> map_begun_in_;       ///< a mapper's newest term that continues none
  std::map<KeyframeId, Version> not_taken_;   ///< by a mapper, as the map says; and where they were said
  std::map<KeyframeId, InFlight> in_flight_;  ///< of those, as far as they were heard by this process
  Note note_;
};

}  // namespace dmslam
