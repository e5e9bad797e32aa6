#pragma once

#include <cstdint>
#include <cstdlib>
#include <optional>

#include "dmslam/util/ids.h"

namespace dmslam {

/// Lets one keyframe through at a time: the mapper adjusts each, and is never overrun.
class KeyframeGate {
 public:
  /// `withheld`: none at all, as too many are not acknowledged.
  void SetWithheld(bool withheld) { withheld_ = withheld; }
  bool IsOpen() const { return !withheld_ && !awaited_; }
  /// The keyframe whose settled record has not come.
  std::optional<KeyframeId> awaited() const { return awaited_; }
  /// Between the keyframe before, whichever of them is the older, and `stamp_ns`.
  int64_t SinceNs(int64_t stamp_ns) const { return std::abs(stamp_ns - last_ns_); }

  void OnProposed(KeyframeId id, int64_t stamp_ns) {
    awaited_ = id;
    last_ns_ = stamp_ns;
  }
  /// All work on keyframe `id` is done. `in_order`: and on all before it, as the keyframes of a camera come
  /// in the order of their frames.
  void OnSettled(KeyframeId id, bool in_order) {
    if (!awaited_ || id.camera() != awaited_->camera()) return;
    if (in_order ? id >= *awaited_ : id == *awaited_) awaited_.reset();
  }
  /// The map whose keyframe was awaited is given up.
  void Open() { awaited_.reset(); }
  /// Goes on after a keyframe that somebody else proposed.
  void ContinueAfter(int64_t stamp_ns) { last_ns_ = stamp_ns; }

 private:
  std::optional<KeyframeId> awaited_;
  int64_t last_ns_ = 0;
  bool withheld_ = false;
};

}  // namespace dmslam
