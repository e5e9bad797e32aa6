#pragma once

#include <type_traits>

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
  static constexpr auto kFirst = TrackingState::kNotInitialized, kLast = TrackingState::kRotationOnly;
  static constexpr const char* kName = "unknown tracking state";
};
template <>
struct EnumRange<MapReset::Fate> {
  static constexpr auto kFirst = MapReset::Fate::kKeep, kLast = MapReset::Fate::kDrop;
  static constexpr const char* kName = "unknown fate of a map";
};

/// On the wire a frame is uncertain with and without a pose. `has_pose`: as the wire says.
void StateField(auto& s, auto& state, auto& wire, [[maybe_unused]] bool has_pose) {
  if constexpr (std::remove_cvref_t<decltype(s)>::kToWire) {
    const TrackingState told = OnTheWire(state);
    s(told, wire);
  } else {
    s(state, wire);
    if (state == TrackingState::kUncertain && !has_pose) state = TrackingState::kMissing;
  }
}

}  // namespace dmslam::wire
