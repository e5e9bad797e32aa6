#pragma once

#include <cstdint>

#include "dmslam/dynamics/proven.h"
#include "dmslam/map/map_editor.h"

namespace dmslam {

/// How landmarks of people who stood still are told from furniture.
struct SeenThroughOptions {
  bool enabled = true;
  double standing_s = ProvenOptions().standing_s;  ///< what was seen longer and outside it is proven
  int outer_observations = ProvenOptions().outer_observations;
  double guard_s = 0.5;           ///< witnesses are at least so far in time from when the landmark was seen
  double radius_rad = 0.0533;     ///< around its pixel a witness's landmarks are compared
  double depth_tolerance = 0.11;  ///< relative difference of depth that is still the same place
  double through_per_support =
      0.2;  ///< witnesses that see through it, per witness that sees something at its place
  double together_rad = 0.133;  ///< neighbours within this share its fate...
  double together_share = 0.3;  ///< ...when so many of them are condemned
  int rounds = 4;               ///< of both tests
  double stood_share = 0.5;     ///< of the unproven seen through: from here on somebody must have stood there
  double support_per_observation =
      1.0;  ///< then unproven ones go beside which, at other times, no more keyframes than this, times their
            ///< own observers, see a proven one of the same depth
  double support_tolerance =
      0.05;                        ///< relative difference of depth: people stand before furniture, not in it
  int rounds_unsupported = 2;      ///< and after them so many times their neighbours
  int max_witnesses = 60;          ///< while mapping
  double witness_angle_rad = 1.0;  ///< between the viewing directions of keyframe and witness

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Switch("mapping.seen_through", enabled,
             "landmarks go that other keyframes see through (people who stood)");
    v.InBaseline("off");
    v.InPaper("off");
  }
};

/// Somebody who stands still is mapped like furniture, but what stands behind him is seen through him as soon
/// as he has left, and was before he came. A landmark is *proven* when it was seen over a longer time than
/// people stand. One that is not is *seen through* when keyframes from another time have landmarks at its
/// pixel that lie behind it, and none at its depth: free-space carving with the map's own points. Its
/// neighbours in the image and in depth go with it.

/// Removes those among the landmarks that a keyframe of this map sees. Witnesses are the keyframes that look
/// at the same place. Returns how many.
int RemoveSeenThrough(MapEditor& map, const Keyframe& keyframe, const SeenThroughOptions& options);

/// The same over a whole map when its sequence has ended. Where so many of the unproven were seen through
/// (now, or `removed_before` while mapping) that somebody must have stood there, unproven landmarks that were
/// ever found elsewhere go too, and those that nothing supports; not in a map too short to prove anything.
/// Returns how many.
int RemoveUnproven(MapEditor& map, MapId map_id, uint64_t removed_before, const SeenThroughOptions& options);

}  // namespace dmslam
