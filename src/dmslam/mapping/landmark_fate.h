#pragma once

#include <cstdint>

#include "dmslam/map/map.h"
#include "dmslam/map/proposals.h"
#include "dmslam/mapping/insertion_order.h"
#include "dmslam/mapping/mapper_options.h"

namespace dmslam {

/// Which decision took a landmark out of the map.
enum class LandmarkFate : uint8_t {
  kNotTold = 0,         ///< before the records begin, or for what they do not say
  kFused = 1,           ///< it is the same as another one, which stays
  kRarelyFound = 2,     ///< on probation: found in too small a share of the frames
  kFewObservers = 3,    ///< on probation: too few keyframes see it
  kSeenThrough = 4,     ///< keyframes of another time see what lies behind it
  kMoved = 5,           ///< frames found it elsewhere: the belief that it moves went beyond the bound
  kUnheld = 6,          ///< an adjustment found it where too few keyframes see it
  kKeyframeCulled = 7,  ///< a redundant keyframe went, and fewer than two others see it
  kTooNear = 8,         ///< just before the lens of a keyframe that sees it, at the end
  kUnproven = 9,        ///< not proven at the end, in a map in which somebody stood
  kMapDropped = 10,     ///< its whole map was given up
  kLeftOut = 11,        ///< what a later mapper began with lacks it
};

/// Says of landmarks that a map's changes take away which of the mapper's rules took them. A record says in
/// which step of the mapper that was. Where a step removes for several reasons, the mapper's own rules are
/// asked about the map as it was before: `options` are to be those of the run.
class LandmarkFates {
 public:
  explicit LandmarkFates(const MapperOptions& options) : options_(options) {}

  /// Another mapper continues the map, as `Follow` finds it.
  void OnNewWriter() { assume_order_ = true; }
  /// To be told every change, before it is applied to `map`: probation counts keyframes.
  void Follow(const Map& map, const MapDelta& delta);
  /// Of one that this change, which is not applied to `map` yet, takes away.
  LandmarkFate Of(const LandmarkTombstone& tombstone, const Map& map, const MapDelta& delta) const;
  /// What is known of a landmark with what a record of frames says of it, in a map that the record is not
  /// worked into yet: one that is removed for that takes it along.
  LandmarkEvidence With(const FrameEvidence& said, const Map& map, const Landmark& landmark) const;

 private:
  LandmarkFate WhileMaking(const Map& map, const Landmark* landmark) const;
  LandmarkFate WhenAdjusted(const Map& map, const Landmark* landmark, const MapDelta& delta) const;

  MapperOptions options_;
  InsertionOrder order_;
  bool assume_order_ = false;
};

}  // namespace dmslam
