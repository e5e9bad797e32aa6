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

  /// This frontend says its own in term `ours` from now on. By `until_ns` whatever was left has been heard.
  void BeginTerm(const Term& ours, int64_t until_ns) { term_ = {ours, until_ns}; }
  /// A record on the channel of keyframes, whosoever it is.
  void Hear(std::span<const uint8_t> bytes, int64_t now_ns);
  /// The next one that was said in a term before ours, which has begun, and that the map does not know; each
  /// once.
  std::optional<KeyframeProposal> Next(const Map& map);

 private:
  static constexpr size_t kMost = 8;  // a frontend waits with the next one until the mapper has the first
  struct Left {
    Term said_in;
    KeyframeProposal proposal;
  };
  struct OurTerm {
    Term term;
    int64_t until_ns = 0;
  };
  uint32_t session_;
  CameraId camera_;
  std::optional<OurTerm> term_;
  std::deque<Left> left_;
  std::deque<KeyframeId> told_;
};

}  // namespace dmslam
