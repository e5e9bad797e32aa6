#include "frontend/frontend_work.h"

namespace dmslam {
namespace {

FrontendStatus StatusOf(const FrontendCore& core) {
  FrontendStatus status;
  const Map& map = core.map();
  const FrontendCounters& counters = core.counters();
  status.state = core.state();
  status.map_version = static_cast<int64_t>(map.version());
  status.map_keyframes = static_cast<int32_t>(map.keyframes().size());
  status.map_landmarks = static_cast<int32_t>(map.num_landmarks());
  status.keyframes_proposed = static_cast<int64_t>(counters.keyframes_proposed);
  status.keyframes_withheld = static_cast<int64_t>(counters.keyframes_withheld);
  status.resets = static_cast<int64_t>(counters.resets);
  status.relocalisations = static_cast<int64_t>(counters.relocalizations);
  return status;
}

}  // namespace

bool FrontendWork::Run(Job job) {
  Post([this, job = std::move(job)] {
    job();
    Report([this, status = StatusOf(core_)] { status_ = status; });
  });
  return Idle();
}

const FrontendStatus& FrontendWork::Status() {
  if (Idle()) status_ = StatusOf(core_);
  return status_;
}

}  // namespace dmslam
