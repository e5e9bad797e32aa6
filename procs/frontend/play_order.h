#pragma once

#include <cstdint>
#include <optional>

#include "dmslam/wire/player_messages.h"

namespace dmslam {

/// What to believe of whoever says that he plays. One message may be forged: a frame far ahead of those that
/// came, and the end of the sequence, count only when they have been said for a tenth of a second, and
/// nothing that contradicts them meanwhile. The player repeats both.
class PlayOrder {
 public:
  /// Number and time of a frame.
  struct Place {
    uint32_t index = 0;
    int64_t stamp_ns = 0;
  };

  /// Whether a frame that is newer than `newest`, the newest that was taken, is to be taken.
  bool Takes(const Place& frame, const std::optional<Place>& newest, int64_t now_ns);
  /// The newest frame is in work, and who plays waits for it: until that is done nothing can contradict a
  /// leap.
  void OnPlayerWaits() { leap_.reset(); }
  /// A frame that was taken before has come again: it is still being played.
  void OnRepeat() { end_.reset(); }
  void OnEnd(const EndOfSequence& end, int64_t now_ns);
  /// Also where it was said once, and then nobody plays any more.
  bool IsOver(int64_t now_ns) const;

 private:
  struct Leap {
    Place newest;
    int64_t since_ns = 0;
  };
  struct End {
    int64_t frames_published = 0;
    std::optional<int32_t> last_frame_index;
    int64_t since_ns = 0;
    bool certain = false;
  };

  std::optional<Leap> leap_;
  std::optional<End> end_;
};

}  // namespace dmslam
