#pragma once

#include <algorithm>
#include <cstdint>

#include "dmslam/messaging/types.h"

namespace dmslam {

/// How far the owner of a stream's reader is: what it has taken, what of that it holds as a whole, and what
/// of that it has safe. The record taken last may turn out to be a part of something larger, or to be
/// doubted: then what is held, or all of it, is as it was before.
class HeldVersions {
 public:
  /// `start`: what the owner holds already.
  explicit HeldVersions(const Version& start) : held_(start), accepted_(start), taken_(start) {}

  /// All records up to here were taken and are whole; empty inside a snapshot.
  const Version& held() const { return held_; }
  /// The record taken last, be it of what is not whole yet.
  const Version& taken() const { return taken_; }
  /// All up to here is safe.
  const Version& accepted() const { return accepted_; }
  /// The last record of that epoch that is; 0: none.
  int64_t AcceptedOf(int64_t epoch) const { return accepted_.epoch == epoch ? accepted_.seq : 0; }

  void Take(const Record& record) {
    before_take_ = {held_, taken_};
    held_before_ = record.begins_anew() ? Version() : held_;
    held_ = taken_ = record.version();
  }
  /// The record taken last is no whole: what was held stays, unless the record has made it void.
  void KeepHeld() { held_ = held_before_; }
  /// The record taken last was not taken.
  void PutBack() {
    held_ = before_take_.held;
    taken_ = before_take_.taken;
  }

  /// Of the epoch that is followed; versions of others, and those that are not held, are ignored.
  void Accept(const Version& version, int64_t epoch) {
    if (version.epoch != epoch || version > held_) return;
    // What was accepted of a later term, before all died and a clock was set back, is no measure for this
    // one.
    accepted_ = accepted_.epoch == epoch ? std::max(accepted_, version) : version;
  }
  /// A snapshot takes the place of what was accepted.
  void Unaccept() { accepted_ = {}; }
  void Forget() { held_ = accepted_ = taken_ = {}; }

 private:
  Version held_, accepted_, taken_;
  Version held_before_;  // before the record taken last; void where that begins anew
  struct {
    Version held, taken;
  } before_take_;  // the same, be it void since
};

}  // namespace dmslam
