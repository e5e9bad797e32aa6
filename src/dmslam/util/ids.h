#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace dmslam {

/// Which camera of a session, from 0.
using CameraId = uint32_t;
/// So many cameras may work on one map.
inline constexpr CameraId kMaxCameras = 16;
/// So many frames of a camera may become keyframes: at 30 Hz those of three months.
inline constexpr uint32_t kMaxFrames = 1U << 28;

/// Which keyframe, for ever: the session in the high 32 bits, then the camera in 4, and the index of its
/// frame in the low 28. A keyframe that is proposed twice therefore carries the same id twice. Zero is no
/// keyframe (sessions start at 1). Those of one camera are ordered by their frames.
struct KeyframeId {
  uint64_t value = 0;

  static constexpr KeyframeId Make(uint32_t session, uint32_t frame_index, CameraId camera = 0) {
    return KeyframeId{(static_cast<uint64_t>(session) << 32) | (static_cast<uint64_t>(camera) << 28) |
                      frame_index};
  }
  constexpr uint32_t session() const { return static_cast<uint32_t>(value >> 32); }
  constexpr CameraId camera() const { return static_cast<uint32_t>(value) >> 28; }
  constexpr uint32_t frame_index() const { return static_cast<uint32_t>(value) & (kMaxFrames - 1); }
  constexpr bool valid() const { return value != 0; }
  auto operator<=>(const KeyframeId&) const = default;
};

/// Which landmark, for ever: the ordinal of the mapper's epoch in the high 16 bits (1 for a first mapper, 2
/// for the one that took over from it), a running number in the low 48. Zero is no landmark.
struct LandmarkId {
  uint64_t value = 0;

  static constexpr uint16_t kLastOrdinal = 0xffff;
  static constexpr LandmarkId Make(uint16_t epoch_ordinal, uint64_t number) {
    return LandmarkId{(static_cast<uint64_t>(epoch_ordinal) << 48) | number};
  }
  constexpr uint16_t epoch_ordinal() const { return static_cast<uint16_t>(value >> 48); }
  constexpr uint64_t number() const { return value & 0xffffffffffffULL; }
  constexpr bool valid() const { return value != 0; }
  auto operator<=>(const LandmarkId&) const = default;
};

/// Which map, from 1: after a reset there may be several. Where there may be none it is a std::optional.
using MapId = uint32_t;
/// A camera numbers the maps that it begins from behind this times its own number, so that no two begin maps
/// of one number.
inline constexpr MapId kMapsPerCamera = 1'000'000;

}  // namespace dmslam

template <>
struct std::hash<dmslam::KeyframeId> {
  size_t operator()(dmslam::KeyframeId id) const noexcept { return id.value * 0x9e3779b97f4a7c15ULL >> 7; }
};
template <>
struct std::hash<dmslam::LandmarkId> {
  size_t operator()(dmslam::LandmarkId id) const noexcept { return id.value * 0x9e3779b97f4a7c15ULL >> 7; }
};
