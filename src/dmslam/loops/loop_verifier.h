#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/loops/loop_options.h"
#include "dmslam/map/map.h"
#include "dmslam/place_recognition/landmark_matches.h"
#include "dmslam/place_recognition/map_places.h"

namespace dmslam {

/// How well a camera at some pose sees a place.
struct PlaceSupport {
  int expected = 0;  ///< landmarks of the place that it should see
  int found = 0;     ///< and does
  int cells = 0;     ///< cells of the image (8 x 6) in which it finds some
  struct Cells {
    int told = 0;      ///< cells in which it should see several
    int agreeing = 0;  ///< of these, cells in which it does see a good part of them
    bool Hold(int least, double min_share) const { return agreeing >= least && agreeing >= min_share * told; }
  };
  Cells anywhere, at_rim;  ///< of the whole image, and of its outermost cells alone
  double Share() const { return expected == 0 ? 0.0 : static_cast<double>(found) / expected; }
  /// How much of what this should show it does, over the same share of what stands there for certain: 1 where
  /// a place is seen as well as the camera's own surroundings.
  double ShareOver(const PlaceSupport& own) const { return own.found == 0 ? 0.0 : Share() / own.Share(); }
};

/// What a keyframe shows of a place.
struct SeenPlace {
  PlaceSupport support;
  std::vector<LandmarkMatch> matches;  ///< sorted by feature
};

/// That a keyframe sees a place again, in terms that outlast changes of the map: either may be gone
/// meanwhile.
struct LoopClaim {
  KeyframeId keyframe;
  KeyframeId place;
  Sim3d S_keyframe_place;  ///< camera of the keyframe from camera of the place
};

/// The keyframe sees the place again. Names what the map has handed out: valid until the map changes.
struct VerifiedLoop {
  const Keyframe* keyframe = nullptr;
  const Keyframe* place = nullptr;
  Sim3d S_keyframe_place;     ///< camera of the keyframe from camera of the place
  Sim3d S_keyframe_world;     ///< where the place's landmarks say the keyframe is
  bool joins = false;         ///< the two are of different maps
  bool at_same_time = false;  ///< they were taken so shortly after one another that nothing has moved far
  PlaceSupport support;
  PlaceSupport proven;  ///< of it, landmarks that are proven to be no person
  double share =
      0;  ///< of what the keyframe should see of the place, seen; over the same share of its own surroundings
  double proven_share = 0;  ///< the same of the proven ones
  /// What is proven around the keyframe, in the place's keyframe from where the loop puts it.
  PlaceSupport counter;
  /// Of what is proven around the keyframe, seen by the place's keyframe; over the same share of the place.
  /// None where too little of it should be seen from there.
  std::optional<double> counter_share;
  std::optional<double> drift_sigmas;      ///< how far the loop moves the keyframe, over what the chain of
                                           ///< keyframes can have drifted; none between two maps
  std::vector<const Landmark*> landmarks;  ///< of the place and its neighbours, static, by id

  LoopClaim Claim() const { return {keyframe->id, place->id, S_keyframe_place}; }
};

/// Asks geometry whether a keyframe shows a place: a similarity from matches of landmarks, refined, a guided
/// search for everything else that the place should show, and the question what share of it is there. A
/// picture that hangs in two rooms gives matches and a similarity as well; what tells the rooms apart is what
/// should be around it and is not, and that the next keyframe sees no more of it. So does somebody who stood
/// in two places: he is told from a room by what outlasts him, seen from both sides, and by what the chain of
/// keyframes between the two can have drifted. Landmarks that are believed to move neither match nor count.
class LoopVerifier {
 public:
  LoopVerifier(const LoopcloserOptions& options, uint64_t seed) : options_(options), seed_(seed) {}

  /// Whether the keyframe may show the place; `why` has the numbers.
  std::optional<VerifiedLoop> Propose(const Map& map, const MapPlaces& places, const Keyframe& keyframe,
                                      const Keyframe& place, std::string* why) const;
  /// Whether a later keyframe shows what an earlier one's loop says it should; `why` has the numbers.
  std::optional<VerifiedLoop> Confirm(const Map& map, const Keyframe& keyframe, const LoopClaim& earlier,
                                      std::string* why) const;

  /// Whether a place of another map is seen so well that the maps may be welded, once others confirm it.
  bool HoldsBetweenMaps(const VerifiedLoop& loop) const;
  /// The same where others found the place, each for itself: less of it is enough.
  bool HoldsAmongOthers(const VerifiedLoop& loop) const;

  /// Which of `landmarks` a camera at `T_cam_world` finds among the features of `keyframe`.
  SeenPlace Look(const Map& map, const Keyframe& keyframe, const Rigid3d& T_cam_world,
                 const std::vector<const Landmark*>& landmarks, double radius_px) const;

 private:
  std::optional<Sim3d> FirstSimilarity(const Map& map, const MapPlaces& places, const Keyframe& keyframe,
                                       const Keyframe& place, std::string* why) const;
  std::optional<Sim3d> SimilarityFromWords(const Map& map, const MapPlaces& places, const Keyframe& keyframe,
                                           const Keyframe& place, std::string* why) const;
  std::optional<Sim3d> SimilarityFromFeatures(const Map& map, const Keyframe& keyframe, const Keyframe& place,
                                              std::string* why) const;
  std::optional<Sim3d> SimilarityFromPose(const Map& map, const Keyframe& keyframe, const Keyframe& place,
                                          std::vector<LandmarkMatch> matches, std::optional<double> scale,
                                          int min_inliers, std::string* why) const;
  std::optional<Sim3d> RefinedSimilarity(const Map& map, const Keyframe& keyframe, const Keyframe& place,
                                         const Sim3d& S_keyframe_place, std::string* why) const;
  VerifiedLoop Measure(const Map& map, const Keyframe& keyframe, const Keyframe& place,
                       const Sim3d& S_keyframe_place, std::string* why) const;
  void MeasureProven(const Map& map, const std::vector<const Landmark*>& around, const PlaceSupport& own,
                     VerifiedLoop* loop) const;
  std::vector<const Landmark*> ProvenOf(const Map& map, std::vector<const Landmark*> landmarks) const;
  bool IsMuchProven(const PlaceSupport& proven, double share, double min_share) const;
  bool IsNoPerson(const VerifiedLoop& loop, double min_share) const;
  bool FillsTheImage(const VerifiedLoop& loop) const;
  bool Holds(const VerifiedLoop& loop, double min_share) const;

  LoopcloserOptions options_;
  uint64_t seed_;
};

/// Static landmarks of a keyframe and of its best neighbours, by id.
std::vector<const Landmark*> StaticLandmarksAround(const Map& map, const Keyframe& keyframe, int neighbours,
                                                   int min_shared);

}  // namespace dmslam
