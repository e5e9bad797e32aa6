#include "mapper/mapper_end.h"

namespace dmslam {

MapperEnd::Step MapperEnd::TakeStep(bool frontends_have_ended, bool answer_waits) {
  if (phase_ == Phase::kRunning) {
    if (!frontends_have_ended) return Step::kNone;
    phase_ = Phase::kFrontendsEnded;
  }
  if (phase_ == Phase::kFrontendsEnded) {
    if (answer_waits) return Step::kApplyAnswer;
    phase_ = Phase::kAnnounced;
    return Step::kAnnounce;
  }
  Complete();
  return Step::kComplete;
}

}  // namespace dmslam
