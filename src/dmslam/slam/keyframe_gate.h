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
  std::optional<KeyframeId> awaited() const { return awaited_ ? std::optional(awaited_->id) : std::nullopt; }
  /// Time between the previous keyframe and `stamp_ns`, in either order; none: there was no keyframe before.
  std::optional<int64_t> SinceNs(int64_t stamp_ns) const {
    return last_ns_ ? std::optional(std::abs(stamp_ns - *last_ns_)) : std::nullopt;
  }

  /// A frame of the camera, in the order in which they come.
  void OnFrame(int64_t stamp_ns) {
    if (frame_ns_) step_ns_ = stamp_ns - *frame_ns_;
    frame_ns_ = stamp_ns;
  }
  /// Between the two frames that came last; none: there were none.
  std::optional<int64_t> step_ns() const { return step_ns_; }

  void OnProposed(KeyframeId id, int64_t stamp_ns) {
    awaited_ = Awaited{id, !last_ns_ || stamp_ns >= *last_ns_};
    last_ns_ = stamp_ns;
  }
  /// All work on keyframe `id` is done: and on all before it, where they come in the order of their frames.
  void OnSettled(KeyframeId id) {
    if (!awaited_ || id.camera() != awaited_->id.camera()) return;
    if (awaited_->in_order ? id >= awaited_->id : id == awaited_->id) awaited_.reset();
  }
  /// The map whose keyframe was awaited is given up.
  void Open() { awaited_.reset(); }
  /// Goes on after a keyframe that somebody else proposed.
  void ContinueAfter(int64_t stamp_ns) { last_ns_ = stamp_ns; }

 private:
  struct Awaited {
    KeyframeId id;
    bool in_order = true;  ///< behind the keyframe before; else the map grows back
  };

  std::optional<Awaited> awaited_;
  std::optional<int64_t> last_ns_;   ///< of the keyframe proposed last
  std::optional<int64_t> frame_ns_;  ///< of the frame that came last
  std::optional<int64_t> step_ns_;
  bool withheld_ = false;
};

}  // namespace dmslam
