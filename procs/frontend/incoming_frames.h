#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "dmslam/wire/player_messages.h"
#include "dmslam/wire/status.h"
#include "frontend/play_order.h"

namespace dmslam {

/// A frame, and when it came [us of the wall clock].
struct ReceivedFrame {
  Frame frame;
  int64_t receive_us = 0;
};

/// Which of the frames that come are to be tracked, in order. In real time those of a tenth of a second wait,
/// as one frame may take longer than the next takes to come; where that is not enough all but the newest are
/// skipped. In lock-step one waits. What was taken out is in work until it is settled.
class IncomingFrames {
 public:
  enum class Verdict {
    kWaits,       ///< to be taken out
    kOutOfRange,  ///< its number is beyond what a session can hold
    kOld,         ///< not newer than the newest that was taken out, which is settled: say how far we are
    kKnown,       ///< it waits already; or it is old, and the newest one is in work still
    kFarAhead,    ///< of those that came; it waits when others go on there
  };
  /// The newest one that was taken out.
  struct Newest {
    uint32_t index = 0;
    std::optional<int64_t> stamp_ns;  ///< none: it is known from the map alone, which knows no stamp
    bool in_work = false;
  };

  /// In real time a frame is old, too, whose stamp does not increase; in lock-step who plays waits while one
  /// is in work.
  void SetMode(PlaybackMode mode) { mode_ = mode; }

  /// Whether it is neither out of range nor old, nor waits already.
  bool IsNew(const Frame& frame) const { return !WhyNotNew(frame); }
  /// One has come, at `now_ns`.
  Verdict Hear(ReceivedFrame received, int64_t now_ns);
  void OnEnd(const EndOfSequence& end, int64_t now_ns) { order_.OnEnd(end, now_ns); }
  /// No frame follows, as far as is believed of what was heard.
  bool IsOver(int64_t now_ns) const { return order_.IsOver(now_ns); }

  /// The oldest of those that wait; null: none does.
  const ReceivedFrame* waiting() const { return waiting_.empty() ? nullptr : &waiting_.front(); }
  /// Takes it out (there must be one).
  ReceivedFrame Take();
  /// Everything follows that has to follow of the newest.
  void Settle() { newest_->in_work = false; }
  /// A frontend before this one had come as far as this: goes on behind it.
  void GoOnBehind(uint32_t frame_index);
  const std::optional<Newest>& newest() const { return newest_; }
  bool in_work() const { return newest_ && newest_->in_work; }

  int64_t skipped() const { return skipped_; }  ///< newer ones took their places
  void Fill(FrontendStatus* status) const;

 private:
  std::optional<Verdict> WhyNotNew(const Frame& frame) const;
  bool IsOld(const Frame& frame) const;
  std::optional<PlayOrder::Place> NewestHeard() const;
  void MakeRoomFor(const Frame& frame);

  PlaybackMode mode_ = PlaybackMode::kRealtime;
  PlayOrder order_;
  std::deque<ReceivedFrame> waiting_;
  std::optional<Newest> newest_;  ///< none: none was taken out
  int64_t received_ = 0;          ///< that waited, at least for a moment
  int64_t skipped_ = 0;
};

}  // namespace dmslam
