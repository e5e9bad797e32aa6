#pragma once

#include <cstdint>
#include <optional>

#include "dmslam/messaging/claims.h"

namespace dmslam {

/// An answer that contradicts what a player knows may be forged: it is believed when it has been said for
/// .15 s, and was never left out for a second meanwhile. The frontend says it to each frame and to each
/// repeat.
class ClaimedAnswer {
 public:
  /// It is said now: whether it is believed.
  bool SaidAgain(int64_t now_ns) {
    if (!IsOpen(now_ns)) since_ns_ = now_ns;
    last_ns_ = now_ns;
    return now_ns - *since_ns_ >= kLongEnoughNs;
  }
  /// Whether it was said within the last second.
  bool IsOpen(int64_t now_ns) const { return since_ns_ && now_ns - last_ns_ <= kInsistsEveryNs; }
  /// What it contradicts was said meanwhile.
  void Clear() { since_ns_.reset(); }

 private:
  static constexpr int64_t kLongEnoughNs = 150'000'000;
  std::optional<int64_t> since_ns_;
  int64_t last_ns_ = 0;
};

/// How far the frontend is, by its answers that name frames which a player has not published: one before this
/// player has. Of all that is said the least counts, so that one forged answer among true ones leads nobody
/// astray.
class FurtherFrontend {
 public:
  struct Frame {
    uint32_t index = 0;
    int64_t stamp_ns = 0;
  };
  /// The newest frame that the frontend has done, once that is believed.
  std::optional<Frame> OnAnswer(const Frame& done, int64_t now_ns) {
    if (!claim_.IsOpen(now_ns)) least_.reset();
    const bool believed = claim_.SaidAgain(now_ns);
    least_ = !least_ || done.index < least_->index ? done : *least_;
    if (!believed) return std::nullopt;
    const Frame newest = *least_;
    Clear();
    return newest;
  }
  void Clear() {
    claim_.Clear();
    least_.reset();
  }

 private:
  ClaimedAnswer claim_;
  std::optional<Frame> least_;
};

}  // namespace dmslam
