#pragma once

#include <cstdint>
#include <vector>

#include "dmslam/slam/frontend_output.h"

namespace dmslam {

/// How far the frontend is when the sequence has ended:
///
///   Playing --OnEndHeard--> GrowingBack --OnGrown--> AwaitingAdjustedMap --OnAdjusted--> Refining
///     --OnRefined--> Joining --Tell--> Telling --(last portion)--> Done
///
/// Knows times as they are handed in, and no bus.
class SequenceEnd {
 public:
  enum class Phase {
    kPlaying,              ///< frames come
    kGrowingBack,          ///< the map, to before its first keyframe
    kAwaitingAdjustedMap,  ///< the mapper was asked to adjust all maps, so that the last poses are told in
                           ///< the best one
    kRefining,             ///< frames are looked for once more in that
    kJoining,              ///< their poses are joined with the camera's motion
    kTelling,              ///< in portions
    kDone,                 ///< everything is said; stays until the mapper has ended
  };

  Phase phase() const { return phase_; }
  bool Is(Phase phase) const { return phase_ == phase; }
  /// Nothing waits for settled records any more: map records are applied as they come.
  bool AppliesAllRecords() const { return asked_ || Is(Phase::kDone); }

  void OnEndHeard();
  void OnGrown();
  /// Whether the mapper is to be asked now; counts as asked then. One that died before it answered is asked
  /// again.
  bool Asks(int64_t now_ns);
  /// The mapper's answer. Only what was asked for counts; it may come while frames are worked on that came
  /// after the question.
  void OnAnswer() { answered_ = answered_ || asked_; }
  bool IsAnswered() const { return answered_; }
  void OnAdjusted();
  void OnRefined();
  void Tell(FrontendOutput output);
  /// The next of what is told; empty before its time. Done with the last one.
  std::vector<FrontendEvent> NextPortion(int64_t now_ns);
  int64_t next_portion_ns() const { return next_portion_ns_; }

 private:
  void GoTo(Phase from, Phase to);

  Phase phase_ = Phase::kPlaying;
  bool asked_ = false, answered_ = false;
  int64_t asked_ns_ = 0;
  std::vector<FrontendEvent> last_words_;
  size_t told_ = 0;  ///< of them, already
  int64_t next_portion_ns_ = 0;
};

}  // namespace dmslam
