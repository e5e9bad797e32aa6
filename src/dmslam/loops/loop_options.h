#pragma once

#include "dmslam/camera/image_cells.h"
#include "dmslam/dynamics/proven.h"
#include "dmslam/loops/chain_drift.h"
#include "dmslam/map/conventions.h"

namespace dmslam {

/// What makes a place the same between two maps, where no chain tells what drift can be, and where the place
/// is seen from elsewhere or behind people.
struct JoiningOptions {
  int min_pose_inliers = 15;  ///< by chance 3 to 10 agree; what follows asks for much more
  double min_share = 0.7;     ///< of all that should be seen
  // Behind people little of all that should be seen is. Then much of what outlasts them must be: a picture
  // that hangs in two places shows a quarter of it.
  int min_proven = kManyProven;
  double min_proven_share = 0.7;
  // Where others say the same, half of what is proven around the place is enough: twice what such a picture
  // shows.
  double min_proven_share_among_others = 0.5;
  // Between two maps that are both too young to have anything proven: cells of the image in which a good part
  // of the place is seen, and those of them at the image's rim. Of all cells that should show several of its
  // landmarks, and of those at the rim, they must be this share. Somebody who stood in both maps is a figure
  // in the image; what should be around him is not there.
  int min_filled_cells = kFillingCells;
  int min_filled_rim_cells = 10;
  double min_filled_share = 0.5;
  // Maps are joined where keyframes around see the place as well, or where so many others, each for itself,
  // were found where the joined maps would have them, over so much time.
  int sightings = 2;
  double sightings_s = 0.5;
};

/// A loop is closed when later keyframes have said so over some time.
struct ConfirmationOptions {
  int times = 2;
  double for_s = 1.0;     ///< from the proposal to the last of them, at least
  double within_s = 4.0;  ///< a proposal not confirmed for so long is given up

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("loop.confirmations", times, 1, 100, "", "later keyframes that must see the place again");
  }
};

/// What is done about a loop.
struct LoopCorrectionOptions {
  int essential_covisibility = 100;  ///< landmarks in common that make an edge of the essential graph
  int essential_iterations = 20;
  bool global_adjustment = true;  ///< after a loop, bundle adjustment of the whole map
  int global_iterations = 10;
  double keypoint_sigma_px = kKeypointSigmaPx;

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Switch("loop.global_adjustment", global_adjustment, "adjust the whole map after a loop");
  }
};

/// Loop closing. Where a number is not explained, it is ORB-SLAM2's.
struct LoopcloserOptions {
  bool enabled = true;

  // Which places are looked at.
  int min_covisibility = kMinCovisibility;
  int min_keyframes_between = 10;  ///< keyframes after a loop before the next one in its map is looked for
  int consistency = 3;             ///< so many keyframes in a row must point at places that belong together
  bool within_maps = true;         ///< off: only places of other maps are looked for
  double same_time_s = 0.5;        ///< between keyframes of two maps: nothing has moved far meanwhile
  int asked_again = 2;  ///< with each keyframe, so many of other maps are looked for in all maps once more

  // What makes a place the same.
  int min_word_matches = 20;  ///< of landmarks, between the two keyframes
  int min_sim3_inliers = 20;  ///< of them, that agree with one similarity
  int min_pose_inliers =
      30;  ///< without such pairs: landmarks of the place that agree with one pose of the keyframe
  double search_radius_rad = 0.0143;  ///< of the guided search, times the scale of the predicted octave
  int max_descriptor_distance = 60;   ///< of the guided search [bits]
  int min_matches = 40;               ///< landmarks of the place found in the keyframe
  int min_cells = 8;                  ///< cells of the image (of 48) in which landmarks are found
  // Shares: of the place's landmarks that the keyframe should see, those that it does see, over the same
  // share of its own surroundings. A picture that hangs in two places reached 0.27; true returns begin at 0.3
  // and grow as the camera goes on.
  double min_share = 0.22;            ///< enough to be believed if the next keyframes agree
  double min_confirmed_share = 0.35;  ///< of a keyframe that sees the place where an earlier one said it is
  int min_told = 20;                  ///< landmarks that should be seen; of fewer the share seen says nothing

  // Somebody who stood in two places is matched as well as a room is. What he cannot be is there for long.
  ProvenOptions proven;
  int min_proven = 20;  ///< landmarks of the place found that are proven to be no person (0: not asked)...
  int min_proven_cells = 6;  ///< ...and the cells of the image that hold them

  // Drift: how far the chain of keyframes since the place can be off.
  ChainDriftOptions drift;
  double max_drift_sigmas = 3.0;

  JoiningOptions joining;
  ConfirmationOptions confirmation;
  LoopCorrectionOptions correction;

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Switch("loop.enabled", enabled, "close loops");
    v.Number("loop.consistency", consistency, 1, 100, "",
             "keyframes in a row that must name places that belong together");
    v.Number("loop.min_matches", min_matches, 10, 10000, "",
             "landmarks of a place that must be found in the keyframe");
    v.Number("loop.min_share", min_share, 0, 1, "",
             "of what should be seen of a place: enough to be followed");
    v.Number("loop.min_confirmed_share", min_confirmed_share, 0, 1, "",
             "of what should be seen of a place: enough to close the loop");
    v.Number(
        "loop.min_proven", min_proven, 0, 10000, "",
        "of the landmarks found, seen for longer than people stand: fewer may be somebody who stood in two "
        "places");
    v.InPaper("0");
    v.Number("loop.max_drift_sigmas", max_drift_sigmas, 0, 1e9, "",
             "a loop that moves more than the keyframes can have drifted is refused");
    v.InPaper("1e+09");
    confirmation.Describe(v);
    correction.Describe(v);
  }
};

}  // namespace dmslam
