#pragma once

#include <cstdint>
#include <optional>

namespace dmslam {

/// How a mapper ends, when all frontends have: it applies what the loop closer has still to say, announces
/// the end in its last record, and then waits until every reader has that.
class MapperEnd {
 public:
  enum class Step : uint8_t {
    kNone,         ///< the run goes on
    kApplyAnswer,  ///< the loop closer's next one
    kAnnounce,     ///< in the last map record
    kComplete,     ///< nothing follows it
  };

  /// What is to be done while nothing of the frontends is left to do; it counts as done. An answer that comes
  /// after the announcement is not applied any more.
  Step TakeStep(bool frontends_have_ended, bool answer_waits);
  /// The map was complete already when this mapper began, which could not say goodbye. Who has died since may
  /// lack it, and is waited for until then.
  void WaitUntil(int64_t ns) { give_up_ns_ = ns; }
  /// Nothing follows, and the readers are waited for.
  void Complete() { phase_ = Phase::kCompleting; }

  bool HasBegun() const { return phase_ != Phase::kRunning; }
  bool IsCompleting() const { return phase_ == Phase::kCompleting; }
  /// Those who lack the map have had their time.
  bool GivesUp(int64_t now_ns) const { return give_up_ns_ && now_ns >= *give_up_ns_; }

 private:
  enum class Phase : uint8_t { kRunning, kFrontendsEnded, kAnnounced, kCompleting };
  Phase phase_ = Phase::kRunning;
  std::optional<int64_t> give_up_ns_;  ///< none: it waits for as long as it takes
};

}  // namespace dmslam
