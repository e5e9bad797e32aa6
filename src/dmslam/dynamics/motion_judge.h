#pragma once

#include <memory_resource>
#include <span>
#include <unordered_map>
#include <vector>

#include "dmslam/dynamics/elders.h"
#include "dmslam/dynamics/hidden_places.h"
#include "dmslam/dynamics/landmark_votes.h"
#include "dmslam/dynamics/missing_landmarks.h"
#include "dmslam/dynamics/moved_landmarks.h"
#include "dmslam/dynamics/rival_motion.h"
#include "dmslam/map/proposals.h"

namespace dmslam {

/// Everything by which the frontend decides whether a landmark moves.
struct DynamicsOptions {
  VoteOptions vote;
  ElderOptions elders;
  HiddenPlaceOptions hidden;

  template <typename Visitor>
  void Describe(Visitor& v) {
    vote.Describe(v);
    elders.Describe(v);
    hidden.Describe(v);
  }
};

/// What frames said of landmarks since it was last asked.
class EvidenceCounter {
 public:
  void OnVisible(LandmarkId id) { ++At(id).visible; }
  void OnMoved(LandmarkId id) { ++At(id).moved; }
  void OnFound(LandmarkId id);
  /// In the landmarks' order; forgets it.
  FrameEvidence Take(int64_t stamp_ns, std::optional<MapId> map_id);
  void Clear() { items_.clear(); }

 private:
  FrameEvidence::Item& At(LandmarkId id);

  std::pmr::unsynchronized_pool_resource pool_;
  std::pmr::unordered_map<LandmarkId, FrameEvidence::Item> items_{&pool_};
};

/// The frontend's own judgement of what moves, frame by frame: who may speak for a pose, and what a frame
/// whose pose is known says of the landmarks that it should see. It knows of the last frames only; what all
/// frames said is added up by the mapper (motion_belief.h), which is told by the evidence.
class MotionJudge {
 public:
  MotionJudge(const DynamicsOptions& options, const Camera& camera);

  bool enabled() const { return votes_.options().motion_belief; }
  const LandmarkVotes& votes() const { return votes_; }
  Elders& elders() { return elders_; }
  const RivalMotions& rivals() const { return rivals_; }

  /// Before the pose is optimised: takes the matches that are there by chance, where somebody hides the map.
  void DropMatchesOfHiddenPlaces(const Map& map, std::span<const ExpectedLandmark> expected,
                                 TrackedFrame* frame);
  /// When it is: marks the features that see something that moves.
  void Judge(const Map& map, std::span<const ExpectedLandmark> expected,
             std::span<const RejectedMatch> rejected, TrackedFrame* frame);
  /// What it found elsewhere: landmarks and, in parallel, the features that show them.
  std::span<const LandmarkId> moved() const { return moved_now_; }
  std::span<const uint16_t> moved_features() const { return moved_.features(); }
  /// Where the pose is believed: judges what is missing, too, and adds all that to the evidence and to the
  /// memory of what moves.
  void Believe(const Map& map, std::span<const ExpectedLandmark> expected, const TrackedFrame& frame);

  /// What was believed since the last call.
  FrameEvidence TakeEvidence(int64_t stamp_ns, std::optional<MapId> map_id) {
    return evidence_.Take(stamp_ns, map_id);
  }
  void DropEvidence() { evidence_.Clear(); }
  /// The frame judged last was believed wrongly: what it saw elsewhere was in its place.
  void TakeBack();
  /// Forgets what belongs to a map that is gone.
  void Reset();

 private:
  LandmarkVotes votes_;
  Elders elders_;
  RivalMotions rivals_;
  HiddenPlaces hidden_;
  MovedLandmarks moved_;
  MissingLandmarks missing_;
  EvidenceCounter evidence_;
  std::span<const LandmarkId> moved_now_;  ///< of the frame judged last
};

}  // namespace dmslam
