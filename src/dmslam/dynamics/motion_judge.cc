#include "dmslam/dynamics/motion_judge.h"

#include <algorithm>

namespace dmslam {

FrameEvidence::Item& EvidenceCounter::At(LandmarkId id) {
  FrameEvidence::Item& item = items_[id];
  item.landmark = id;
  return item;
}

/// What is found was visible, even where it was not expected.
void EvidenceCounter::OnFound(LandmarkId id) {
  FrameEvidence::Item& item = At(id);
  if (item.visible == 0) item.visible = 1;
  ++item.found;
}

FrameEvidence EvidenceCounter::Take(int64_t stamp_ns, std::optional<MapId> map_id) {
  FrameEvidence evidence;
  evidence.stamp_ns = stamp_ns;
  evidence.map_id = map_id;
  for (const auto& [id, item] : items_) evidence.items.push_back(item);
  std::sort(evidence.items.begin(), evidence.items.end(),
            [](const auto& a, const auto& b) { return a.landmark < b.landmark; });
  items_.clear();
  return evidence;
}

MotionJudge::MotionJudge(const DynamicsOptions& options, const Camera& camera)
    : votes_(options.vote),
      elders_(options.elders, options.vote.trusted_age_s),
      hidden_(options.hidden),
      missing_(camera) {}

void MotionJudge::DropMatchesOfHiddenPlaces(const Map& map, std::span<const ExpectedLandmark> expected,
                                            TrackedFrame* frame) {
  if (enabled()) hidden_.DropMatches(map, expected, votes_, frame);
}

void MotionJudge::Judge(const Map& map, std::span<const ExpectedLandmark> expected,
                        std::span<const RejectedMatch> rejected, TrackedFrame* frame) {
  moved_now_ = moved_.Find(map, expected, rejected, frame);
}

void MotionJudge::Believe(const Map& map, std::span<const ExpectedLandmark> expected,
                          const TrackedFrame& frame) {
  missing_.Judge(map, frame, expected, moved_now_);
  const std::vector<LandmarkId>& hidden = missing_.hidden();
  for (const ExpectedLandmark& landmark : expected) {
    if (!std::binary_search(hidden.begin(), hidden.end(), landmark.id())) evidence_.OnVisible(landmark.id());
  }
  for (const LandmarkId id : moved_now_) {
    evidence_.OnMoved(id);
    votes_.OnSeenElsewhere(id);
  }
  for (const LandmarkId id : missing_.gone()) evidence_.OnMoved(id);
  for (const LandmarkId id : frame.landmarks) {
    if (!id.valid() || map.FindLandmark(id) == nullptr) continue;
    evidence_.OnFound(id);
    votes_.OnFound(id);
  }
}

void MotionJudge::TakeBack() {
  evidence_.Clear();
  for (const LandmarkId id : moved_now_) votes_.TakeBackSeenElsewhere(id);
}

void MotionJudge::Reset() {
  votes_.Reset();
  evidence_.Clear();
}

}  // namespace dmslam
