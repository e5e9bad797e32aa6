#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/map/proposals.h"
#include "dmslam/messaging/types.h"
#include "dmslam/wire/record_groups.h"

namespace dmslam {

/// What the loop closer has said, until it is applied: its records as whole answers, and what was lost of
/// them.
class LoopAnswers {
 public:
  struct Answer {
    LoopAnswer answer;
    Version version;  ///< of the record with which it was whole
  };

  /// Takes the next record, written in the term `by`; returns what is wrong with it, which it may be twice.
  std::vector<std::string> Add(LoopAnswer record, const Term& by, const Version& version);
  /// A record could not be read.
  void AddUnreadable() { lost_ = true; }

  /// Whether there is no whole answer.
  bool empty() const { return whole_.empty(); }
  /// The oldest of the whole ones; there is one.
  Answer TakeFirst();
  /// Whether a record was lost since this was last asked: who awaits its answer asks again.
  bool TakeLost() { return std::exchange(lost_, false); }
  /// Corrections whose records did not come whole, since this was last asked: they are to be refused.
  std::vector<uint64_t> TakeBroken() { return std::exchange(broken_, {}); }

 private:
  std::deque<Answer> whole_;
  wire::RecordGroups<LoopAnswer> groups_;
  bool lost_ = false;
  std::vector<uint64_t> broken_;
};

}  // namespace dmslam
