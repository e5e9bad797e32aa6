#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "dmslam/map/map.h"
#include "dmslam/map/proposals.h"
#include "dmslam/slam/frontend_core.h"
#include "dmslam/slam/frontend_output.h"

namespace dmslam {

/// How far a frontend is when the sequence has ended, or when another one goes on with it:
///
///   Playing --OnEndHeard--> GrowingBack --> AwaitingAdjustedMap --> Refining --> Joining --> Telling
///     --OnTold--> Done
///   Playing, GrowingBack --OnHandOver--> AwaitingAdjustedMap (which waits for nobody) --> Refining
///     --> Joining --> Telling --OnTold--> HandedOver
///
/// The arrows without a name are gone by OnWorked(), with what a portion of work has come to. Work is done on
/// the core, where that has a thread of its own on that; everything else is for the caller's thread. Knows
/// times as they are handed in, and no bus.
class SequenceEnd {
 public:
  enum class Phase {
    kPlaying,              ///< frames come
    kGrowingBack,          ///< the map, to before its first keyframe
    kAwaitingAdjustedMap,  ///< the mapper was asked to adjust all maps, so that the last poses are told in
                           ///< the best one
    kRefining,             ///< frames are looked for once more in that
    kJoining,              ///< their poses are joined with the camera's motion
    kTelling,              ///< the last poses
    kDone,                 ///< everything is said; stays until the mapper has ended
    kHandedOver,           ///< what only this frontend knew is said; another one goes on
  };

  /// `has_mapper`: there is one that maps what is proposed and adjusts what it has.
  SequenceEnd(bool has_mapper, CameraId camera_id) : has_mapper_(has_mapper), camera_id_(camera_id) {}

  Phase phase() const { return phase_; }
  bool Is(Phase phase) const { return phase_ == phase; }
  /// Nothing waits for settled records any more: map records are applied as they come.
  bool AppliesAllRecords() const { return question_ || Is(Phase::kDone); }

  void OnEndHeard();
  /// Another frontend asks for the stream. It may not have the features of the frames before: their poses
  /// are refined in the map as it is, and told. Calling it again has no effect.
  void OnHandOver();
  bool HandsOver() const { return last_ == Phase::kHandedOver; }

  /// Whether the map must change before Work() can go on: a keyframe is awaited, or the mapper's answer.
  bool Waits(const FrontendCore& core) const;
  /// The question that is to be put to the mapper now; counts as put then. One that died before it answered
  /// is asked again. `epoch`: in which this frontend writes.
  std::optional<AdjustRequest> Ask(const Map& map, int64_t now_ns, std::optional<int64_t> newest_stamp_ns,
                                   int64_t epoch);
  /// Which request is answered. Each frontend of a camera counts its own from 1.
  struct Answer {
    CameraId camera = 0;
    int64_t epoch = 0;  ///< of the frontend that asked
    uint32_t request = 0;
  };
  /// The mapper's answer to a request. Only to the question that this frontend put last does it count, since
  /// frames may come after a question; it may come while these are worked on.
  void OnAnswer(const Answer& answer);

  /// What a portion of work has come to.
  struct Worked {
    FrontendOutput output;  ///< to be told; of the joining: the last poses
    bool is_done = false;   ///< with the phase
  };
  /// Does a portion of a phase's work, from kGrowingBack to kJoining. Knows the core alone.
  static Worked Work(Phase phase, FrontendCore* core);
  /// Takes the result of Work() for this phase.
  void OnWorked(bool is_done);
  /// The last poses are told.
  void OnTold();
  /// The map has ended with the frontend that this one has taken over from: there is nothing left to say, and
  /// nothing to hand over.
  void OnMapEnded() { phase_ = last_ = Phase::kDone; }

 private:
  /// To the mapper, to adjust the maps.
  struct Question {
    int64_t epoch = 0;
    uint32_t request = 0;
    int64_t asked_ns = 0;
    bool is_answered = false;
  };

  bool AwaitsAnswer(const Map& map) const;

  bool has_mapper_;
  CameraId camera_id_;
  Phase phase_ = Phase::kPlaying;
  Phase last_ = Phase::kDone;         ///< in which it ends: that, or kHandedOver
  std::optional<Question> question_;  ///< the one put last
};

/// Who listens to a frontend that is done with in one go.
struct EndListeners {
  std::function<void(const FrontendOutput&)> tell;
  std::function<void(const AdjustRequest&)> adjust;  ///< afterwards the frontend has the adjusted maps
};
/// From the end of the sequence to its last words in one go, where keyframes are settled and requests
/// answered when they are told.
void FinishSequence(FrontendCore* core, std::optional<int64_t> newest_stamp_ns,
                    const EndListeners& listeners);

}  // namespace dmslam
