#pragma once

#include "dmslam/wire/codec_impl.h"
#include "dmslam/wire/frontend_messages.h"

namespace dmslam::wire {

template <>
struct EnumRange<PlaybackMode> {
  static constexpr auto kFirst = PlaybackMode::kRealtime, kLast = PlaybackMode::kLockstep;
  static constexpr const char* kName = "unknown mode";
};
template <>
struct EnumRange<Lens> {
  static constexpr auto kFirst = Lens::kBrown, kLast = Lens::kFisheye;
  static constexpr const char* kName = "unknown lens";
};
template <>
struct EnumRange<TrackingState> {
  static constexpr auto kFirst = TrackingState::kNotInitialized, kLast = TrackingState::kMissing;
  static constexpr const char* kName = "unknown tracking state";
};
template <>
struct EnumRange<MapReset::Fate> {
  static constexpr auto kFirst = MapReset::Fate::kKeep, kLast = MapReset::Fate::kDrop;
  static constexpr const char* kName = "unknown fate of a map";
};

}  // namespace dmslam::wire
