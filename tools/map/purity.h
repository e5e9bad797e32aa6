#pragma once

#include <functional>
#include <optional>
#include <string>

#include "dmslam/dataset/image.h"
#include "dmslam/map/map.h"

namespace dmslam {

/// How many landmarks of a map lie on people, by masks of its keyframes' images (255: moving, 128: someone
/// who stands). Masks judge; they are never an input.
struct MapPurity {
  size_t keyframes = 0;           ///< of the map
  size_t keyframes_unjudged = 0;  ///< of these, without a mask
  size_t landmarks = 0;           ///< of the map, seen by at least one keyframe with a mask
  size_t on_people =
      0;  ///< of these, on a person in more than half of the keyframes with a mask that see them
  size_t ever_on_people = 0;  ///< of these, on a person in at least one

  /// Share of the landmarks that are seen mostly on people [%].
  double OnPeoplePercent() const;
};

/// The mask of the image of that stamp [ns], none where there is none.
using MaskOf = std::function<std::optional<GrayImage>(int64_t stamp_ns)>;

/// Judges the landmarks of map `map_id` at the raw pixels of the keypoints that observe them.
MapPurity JudgeMap(const Map& map, MapId map_id, const MaskOf& mask_of);

/// The masks of a recording: mask.txt in `folder`, the nearest within 20 ms. Throws InputError where the
/// folder has none.
MaskOf MasksIn(const std::string& folder);

/// As a JSON object.
std::string PurityJson(const MapPurity& purity);

}  // namespace dmslam
