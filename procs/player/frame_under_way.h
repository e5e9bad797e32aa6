#pragma once

#include <cstdint>

#include "dmslam/messaging/types.h"
#include "dmslam/wire/player_messages.h"

namespace dmslam {

/// The newest frame. In lock-step it is published again and again until it is done.
struct FrameUnderWay {
  static constexpr int64_t kRepeatEveryNs = 300'000'000;

  Frame frame;
  SharedBytes bytes;           ///< as they were published; null: no frame was yet
  bool awaiting_done = false;  ///< lock-step
  int64_t next_repeat_ns = 0;

  bool IsRepeatDue(int64_t now_ns) const { return awaiting_done && now_ns >= next_repeat_ns; }
  void RepeatLater(int64_t now_ns) { next_repeat_ns = now_ns + kRepeatEveryNs; }
};

}  // namespace dmslam
