#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "dmslam/map/map.h"
#include "dmslam/map/proposals.h"
#include "dmslam/messaging/types.h"

namespace dmslam {

/// Keyframes that a frontend before this one has proposed, and no mapper had taken when it died. Who heard
/// them says them again, as they were; this frontend proposes them once more, in its own stream.
class LeftKeyframes {
 public:
  LeftKeyframes(uint32_t session, CameraId camera) : session_(session), camera_(camera) {}

  /// A record on the channel of keyframes, whosoever it is.
  void Hear(std::span<const uint8_t> bytes);
  /// The next one that was said in a term before `ours` and that the map does not know; each once.
  std::optional<KeyframeProposal> Next(const Map& map, const Term& ours);

 private:
  static constexpr size_t kMost = 8;  // a frontend waits with the next one until the mapper has the first
  struct Left {
    Term said_in;
    KeyframeProposal proposal;
  };
  uint32_t session_;
  CameraId camera_;
  std::deque<Left> left_;
  std::deque<KeyframeId> told_;
};

}  // namespace dmslam
