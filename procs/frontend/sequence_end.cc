#include "frontend/sequence_end.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

// What is told at the end comes in portions: lcm-logger, which nobody repairs, loses what comes faster than
// it empties its queue of 30 messages.
constexpr size_t kPortion = 8;  // records
constexpr int64_t kPortionEveryNs = 8'000'000;
constexpr int64_t kAskAgainNs = 10'000'000'000;

}  // namespace

void SequenceEnd::GoTo(Phase from, Phase to) {
  DMSLAM_CHECK(phase_ == from, "the end of a sequence is worked on step by step");
  phase_ = to;
}

/// The player says it until it is answered.
void SequenceEnd::OnEndHeard() {
  if (Is(Phase::kPlaying)) phase_ = Phase::kGrowingBack;
}

void SequenceEnd::OnGrown() { GoTo(Phase::kGrowingBack, Phase::kAwaitingAdjustedMap); }

bool SequenceEnd::Asks(int64_t now_ns) {
  if (answered_ || (asked_ && now_ns - asked_ns_ <= kAskAgainNs)) return false;
  asked_ = true;
  asked_ns_ = now_ns;
  return true;
}

void SequenceEnd::OnAdjusted() { GoTo(Phase::kAwaitingAdjustedMap, Phase::kRefining); }

void SequenceEnd::OnRefined() { GoTo(Phase::kRefining, Phase::kJoining); }

void SequenceEnd::Tell(FrontendOutput output) {
  GoTo(Phase::kJoining, Phase::kTelling);
  last_words_ = std::move(output.events);
}

std::vector<FrontendEvent> SequenceEnd::NextPortion(int64_t now_ns) {
  if (now_ns < next_portion_ns_) return {};
  next_portion_ns_ = now_ns + kPortionEveryNs;
  const size_t count = std::min(kPortion, last_words_.size() - told_);
  const auto begin = std::make_move_iterator(last_words_.begin() + static_cast<std::ptrdiff_t>(told_));
  std::vector<FrontendEvent> portion(begin, begin + static_cast<std::ptrdiff_t>(count));
  told_ += count;
  if (told_ == last_words_.size()) {
    GoTo(Phase::kTelling, Phase::kDone);
    last_words_ = {};
  }
  return portion;
}

}  // namespace dmslam
