#pragma once

#include <cstdint>
#include <optional>

#include "dmslam/map/proposals.h"
#include "dmslam/messaging/types.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// Where several cameras go in lock-step, a frame waits until the mapper has all that comes before it: until
/// it is this camera's turn. A mapper that was started again is asked again.
class CameraTurns {
 public:
  /// In the place of a frame's number: what is done when none follows. No frame has it.
  static constexpr uint32_t kTheEnd = kMaxFrames - 1;

  /// Nobody waits for anybody.
  CameraTurns() = default;
  /// Of this camera, with others.
  explicit CameraTurns(CameraId camera) : camera_(camera) {}

  bool Has(uint32_t frame_index) const { return !camera_ || given_ == frame_index; }
  /// The request to be put to the mapper for that frame, which does not have its turn; counts as put then.
  /// None: it was put already, or no mapper is there. `mapper`: its term.
  std::optional<TurnRequest> Ask(uint32_t frame_index, const TurnTime& time, const Term& mapper);
  /// The mapper has given the turn to this frame of some camera.
  void OnTurn(KeyframeId frame);
  /// Asked for one, and does not have it.
  bool Waits() const { return asked_ != given_; }

 private:
  std::optional<CameraId> camera_;  ///< none: it takes no turns with others
  std::optional<uint32_t> asked_, given_;
  Term asked_of_;  ///< the mapper
};

}  // namespace dmslam
