#pragma once

#include <map>
#include <set>
#include <vector>

#include "dmslam/loops/loop_options.h"
#include "dmslam/map/map.h"
#include "dmslam/place_recognition/map_places.h"

namespace dmslam {

/// Names places that a keyframe may show again: by words, and only when several keyframes in a row name
/// places that belong together (Mur-Artal, Montiel, Tardos, "ORB-SLAM", T-RO 2015, section VII.A).
class LoopDetector {
 public:
  explicit LoopDetector(const LoopcloserOptions& options) : options_(options) {}

  struct Found {
    std::vector<const Keyframe*> candidates;  ///< consistent, best first
    int named = 0;                            ///< before consistency was asked
  };
  /// Keyframes in order, each once.
  Found Detect(const Map& map, const MapPlaces& places, const Keyframe& keyframe);
  /// Keyframes of other maps that may show the same place: those taken at nearly the same time, when nothing
  /// can have moved far, and those that look most alike. A single keyframe's word is enough here: of these
  /// places geometry asks more.
  std::vector<const Keyframe*> DetectInOtherMaps(const Map& map, const MapPlaces& places,
                                                 const Keyframe& keyframe) const;
  /// A loop was closed, or the map is another one: begins anew.
  void Reset() { groups_.clear(); }

 private:
  /// A place with its neighbours, and how many keyframes in a row have named it.
  struct Group {
    std::set<KeyframeId> members;
    int seen = 0;
  };

  std::vector<PlaceCandidate> Candidates(const Map& map, const MapPlaces& places,
                                         const Keyframe& keyframe) const;

  LoopcloserOptions options_;
  std::map<CameraId, std::vector<Group>> groups_;  ///< what the keyframe before named, of each camera
};

}  // namespace dmslam
