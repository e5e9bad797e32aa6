#include "dmslam/dynamics/landmark_votes.h"

#include <algorithm>

#include "dmslam/dynamics/motion_belief.h"

namespace dmslam {

double LandmarkAges::Of(const Landmark& landmark) {
  int64_t last_ns = landmark.first_ns;
  if (!landmark.observations.empty()) {
    const KeyframeId last = landmark.observations.back().keyframe;
    if (last != last_) {
      last_ = last;
      last_keyframe_ = map_.FindKeyframe(last);
    }
    if (last_keyframe_ != nullptr) last_ns = std::max(last_ns, last_keyframe_->stamp_ns);
  }
  return static_cast<double>(std::max(stamp_ns_ - landmark.first_ns, last_ns - stamp_ns_)) * 1e-9;
}

bool IsOldAt(const Landmark& landmark, int64_t stamp_ns, const VoteOptions& options) {
  return static_cast<double>(stamp_ns - landmark.first_ns) * 1e-9 >= options.trusted_age_s;
}

bool LandmarkVotes::HasVote(const Landmark& landmark) const {
  if (!options_.motion_belief) return true;
  if (!IsStatic(&landmark)) return false;
  const auto streak = streaks_.find(landmark.id);
  return streak == streaks_.end() || streak->second < kStreakWithoutVote;
}

void LandmarkVotes::TakeBackSeenElsewhere(LandmarkId id) {
  const auto streak = streaks_.find(id);
  if (streak != streaks_.end() && --streak->second <= 0) streaks_.erase(streak);
}

double LandmarkVotes::Trust(double age_s) const {
  if (!options_.motion_belief) return 1.0;
  const double grown = std::clamp(age_s / options_.trusted_age_s, 0.0, 1.0);
  return options_.young_trust + (1.0 - options_.young_trust) * grown;
}

}  // namespace dmslam
