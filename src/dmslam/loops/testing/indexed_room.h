#pragma once

#include <optional>
#include <string>

#include "dmslam/loops/loop_verifier.h"
#include "dmslam/loops/testing/ring_room.h"
#include "dmslam/map/conventions.h"
#include "dmslam/map/replica.h"
#include "dmslam/place_recognition/map_places.h"

namespace dmslam::testing {

/// A room of which some keyframes are mapped, with the words of their places.
class IndexedRoom {
 public:
  explicit IndexedRoom(const WorldOptions& options, int keyframes = 0)
      : room_(options), map_(room_.map().camera(), room_.map().pyramid()), places_(ShippedVocabulary()) {
    while (size() < keyframes) Next();
  }

  /// Maps one more.
  const Keyframe& Next() {
    const MapDelta delta = room_.Next();
    map_.Apply(delta);
    places_.Update(map_);
    places_.Refresh(map_, *delta.about);
    return map_.At(*delta.about);
  }

  int size() const { return static_cast<int>(map_.keyframes().size()); }
  const Map& map() const { return map_; }
  const MapPlaces& places() const { return places_; }
  const Keyframe& At(int k) const { return map_.At(Room::IdOf(k)); }

  /// That keyframe `k` sees the place of `place`, as it is in truth.
  VerifiedLoop TrueLoop(int k, int place) const { return TrueLoopIn(map_, k, place); }
  /// The same in an edited copy of the map.
  VerifiedLoop TrueLoopIn(const Map& map, int k, int place) const {
    VerifiedLoop loop;
    loop.keyframe = &map.At(Room::IdOf(k));
    loop.place = &map.At(Room::IdOf(place));
    loop.joins = loop.keyframe->map_id != loop.place->map_id;
    loop.S_keyframe_place = room_.TrueSimilarity(k, place);
    loop.S_keyframe_world = loop.S_keyframe_place * Sim3d(loop.place->T_cam_world);
    loop.landmarks =
        StaticLandmarksAround(map, *loop.place, kPlaceNeighbours, LoopcloserOptions().min_covisibility);
    return loop;
  }
  std::optional<VerifiedLoop> Propose(const LoopcloserOptions& options, int k, int place) const {
    std::string why;
    return LoopVerifier(options, 1).Propose(map_, places_, At(k), At(place), &why);
  }

 private:
  Room room_;
  Replica map_;
  MapPlaces places_;
};

/// Options without what stops loops on people.
inline LoopcloserOptions Trusting() {
  LoopcloserOptions options;
  options.min_proven = 0;
  options.min_told = 1'000'000;
  options.max_drift_sigmas = 1e9;
  options.confirmation.times = 1;
  options.confirmation.for_s = 0;
  return options;
}

}  // namespace dmslam::testing
