#include "dmslam/tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dmslam/camera/image_cells.h"
#include "dmslam/dynamics/proven.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

// For this time after a lost camera was found, a pose is searched for more widely and needs more inliers.
constexpr int64_t kCarefulNs = 1'000'000'000;
// A place that was recognised must predict what is seen for at most this time to be believed.
constexpr int64_t kConfirmNs = 500'000'000;
// While a weak pose still leads the search, places are looked for only after this time without a pose. A
// camera that is found turned after a longer time counts as found anew.
constexpr int64_t kCoastNs = 500'000'000;
// Where no weak pose leads the search, places are looked for after this time without a pose.
constexpr int64_t kNoPlacesNs = 200'000'000;
// A pose that may rest on what is no part of the room is followed for at most this time.
constexpr int64_t kDoubtNs = 1'000'000'000;
// A lost camera is looked for where it was, turned by up to this angle when it has just been lost.
constexpr double kTurnReachRad = 0.06;
// That angle grows at this rate with the time since then [rad/s].
constexpr double kTurnRadPerS = 0.3;
// That angle grows no larger than this.
constexpr double kMostTurnRad = 0.3;
// A place is seen as a whole where this share of what it should show is found.
constexpr double kWholeShare = 0.3;
// What lies in so many cells of the image is wider than somebody who stands in it.
constexpr int kWiderThanSomebodyCells = kFillingCells / 2;
// A place shows proven landmarks where this share of its frames does: now and then one is matched by chance.
constexpr double kProvenFrames = 0.25;
// A pose is thin where less than this share of what it should see is found.
constexpr double kThinShare = 0.25;
// A thin pose is compared with one beside it that is turned by up to this angle.
constexpr double kBesideRad = 0.1;
// The pose beside it takes its place only if it finds this many times as much.
constexpr double kClearlyMore = 1.3;

/// All over the image, which a person is not.
bool IsSeenAsAWhole(const TrackingReport& report) {
  return report.cells >= kFillingCells && report.num_static >= kWholeShare * report.num_expected;
}

/// Whether one pose of a frame explains clearly more of it than another does: of all landmarks and of those
/// that are older than people stand, and wider over the image.
bool ExplainsClearlyMore(const TrackingReport& a, const TrackingReport& b) {
  return a.num_static >= kClearlyMore * b.num_static && a.num_old >= kClearlyMore * b.num_old &&
         a.cells > b.cells;
}

/// How long a place that shows so many proven landmarks must predict: a few may be matched by chance, as many
/// as kManyProven are not. Each doubling shortens it by the same time.
int64_t ConfirmNs(int proven) {
  const double saved = std::log(static_cast<double>(proven) / kSomeProven) /
                       std::log(static_cast<double>(kManyProven) / kSomeProven);
  return static_cast<int64_t>((1.0 - saved) * static_cast<double>(kConfirmNs));
}

}  // namespace

Tracker::Tracker(const Setup& setup)
    : options_(setup.options),
      seed_(setup.seed),
      search_(setup.options, setup.camera),
      second_search_(setup.options, setup.camera),
      relocalizer_(setup.vocabulary),
      follower_(setup.options) {}

/// What was believed or doubted of another map before says nothing of this one.
void Tracker::BeginAt(const Keyframe& keyframe) {
  usual_speed_.Interrupt();
  search_.Reset();
  second_search_.Reset();
  unbelieved_.reset();
  relocalized_ns_.reset();
  follower_.BeginAt(keyframe, {keyframe.id.frame_index(), keyframe.stamp_ns});
}

void Tracker::OnMapForgotten() {
  usual_speed_ = UsualSpeed();
  relocalizer_.Clear();
  search_.Reset();
  second_search_.Reset();
  certainty_.Forget();
}

void Tracker::OnMapGivenUp() {
  usual_speed_.Interrupt();
  search_.Reset();
  second_search_.Reset();
  follower_.Stop();
  unbelieved_.reset();
}

TrackingResult Tracker::Track(const Map& map, const Request& request, TrackedFrame frame) {
  const Attempt attempt = FindPose(map, request, &frame);
  TrackingResult result{.report = attempt.report, .relocalized = attempt.relocalized};
  if (attempt.report.HasPose()) result.pose = PlacedPose::Of(search_.Reference(map), frame.T_cam_world);
  if (result.pose) {
    Follow(map, *result.pose, frame, attempt);
  } else if (attempt.weak_pose) {
    follower_.Coast(map, *attempt.weak_pose, {frame.index, frame.stamp_ns});
  }
  if (unbelieved_) Withhold(&result);
  if (result.pose) {
    result.certainty = certainty_.Estimate(map, frame, *result.pose, search_.basis(), !attempt.relocalized);
  } else {
    result.report.TakePoseAway();
  }
  result.frame = std::move(frame);
  return result;
}

/// Where the motion leads or beside it, or else turned from where it was lost, or else in all places.
Tracker::Attempt Tracker::FindPose(const Map& map, const Request& request, TrackedFrame* frame) {
  Attempt attempt = FollowMotion(map, frame);
  if (IsDoubtfulForLong(attempt.report, frame->stamp_ns)) attempt.report.TakePoseAway();
  if (IsCarriedAway(map, attempt.report, *frame)) Refuse(&attempt);
  if (!attempt.report.HasPose() && unbelieved_) GoBack();
  if (attempt.report.HasPose()) {
    FindBetterPlace(map, frame, &attempt);
  } else {
    FindTurned(map, frame, &attempt);
  }
  if (!attempt.report.HasPose() && request.may_relocalize && MayRelocalize(attempt, frame->stamp_ns))
    Relocalize(map, request, frame, &attempt);
  return attempt;
}

/// A camera that is followed and not believed has no pose, and where it was found anew it says nothing of
/// landmarks.
void Tracker::Withhold(TrackingResult* result) {
  result->pose.reset();
  if (unbelieved_->why != Unbelieved::Why::kFoundAnew) return;
  search_.judge().DropEvidence();
  result->report.TakePoseAway("a place was recognised that is not confirmed yet");
}

/// Goes on from a frame whose pose was found.
void Tracker::Follow(const Map& map, const PlacedPose& pose, const TrackedFrame& frame,
                     const Attempt& attempt) {
  if (attempt.relocalized) {
    unbelieved_ = Unbelieved{Unbelieved::Why::kFoundAnew, attempt.in_another_map, frame.stamp_ns, follower_};
  } else if (attempt.report.IsDoubtful() && !unbelieved_) {
    unbelieved_ =
        Unbelieved{Unbelieved::Why::kDoubtful, false, last_tracked_ns().value_or(frame.stamp_ns), follower_};
  }
  follower_.OnTracked(map, pose, search_.found(frame), {frame.index, frame.stamp_ns}, frame,
                      attempt.relocalized || attempt.begins_anew);
  if (unbelieved_) {
    const int proven = CountProven(map, frame.landmarks, {});
    unbelieved_->CountFrame(proven);
    if (IsBelieved(map, attempt.report, proven, frame.stamp_ns)) unbelieved_.reset();
  }
  if (!unbelieved_ && options_.usual_speed) usual_speed_.OnPose(map, pose, frame.stamp_ns);
}

/// The camera was carried away: the frame has no pose, and says nothing against a first map that is on trial.
void Tracker::Refuse(Attempt* attempt) {
  search_.judge().TakeBack();
  attempt->report.outcome = TrackingReport::Outcome::kNotSeen;
  attempt->report.reason = "the pose is farther away than the camera can have come";
  attempt->weak_pose.reset();
}

/// Where it was doubtful, when it is so no more. Where it was found anew, at once if the place is seen all
/// over the image and as a whole, which a person is not, or if much of what is seen is proven to be no
/// person; else when the place goes on to predict what is seen: in a map that is old enough to have proven
/// landmarks, some of those, and the more of them, the sooner; in a younger one, more than matches by chance
/// and more than somebody who stands there shows. In another map that is too young, it must both be seen as a
/// whole and predict.
bool Tracker::IsBelieved(const Map& map, const TrackingReport& report, int proven, int64_t stamp_ns) const {
  if (report.IsDoubtful()) return false;
  if (unbelieved_->why == Unbelieved::Why::kDoubtful) return true;
  const bool at_once = IsSeenAsAWhole(report) && !unbelieved_->in_another_map;
  if (at_once || proven >= kManyProven) return true;
  const int64_t since_ns = stamp_ns - unbelieved_->since_ns;
  if (!IsOldEnoughToProve(map)) return since_ns >= kConfirmNs && IsMoreThanSomebody(report);
  return proven >= kSomeProven && since_ns >= ConfirmNs(proven);
}

/// Whether a place in a map that is too young to have much proven shows more than matches by chance, and more
/// than somebody who stood there would: he is no landmark that is proven, and fills little of the image.
bool Tracker::IsMoreThanSomebody(const TrackingReport& report) const {
  const bool is_proven = unbelieved_->frames_with_proven >= kProvenFrames * unbelieved_->frames;
  return !report.MayMatchByChance() && (is_proven || report.cells >= kWiderThanSomebodyCells);
}

/// The map that the frame was placed in.
bool Tracker::IsOldEnoughToProve(const Map& map) const {
  const Keyframe* reference = search_.Reference(map);
  return reference != nullptr && CanBeProven(map, reference->map_id, {});
}

bool Tracker::IsDoubtfulForLong(const TrackingReport& report, int64_t stamp_ns) const {
  return report.IsDoubtful() && unbelieved_ && stamp_ns - unbelieved_->since_ns > kDoubtNs;
}

/// Whether the camera seems to have gone faster than it can, as when it follows somebody who begins to walk.
/// Not where the place is seen as a whole or is proven to be no person: there a lost camera comes back. Who
/// walks may also be a rival's motion, so those are not spared.
bool Tracker::IsCarriedAway(const Map& map, const TrackingReport& report, const TrackedFrame& frame) const {
  if (!options_.usual_speed || !report.HasPose()) return false;
  if (unbelieved_ && unbelieved_->why == Unbelieved::Why::kFoundAnew) return false;
  const std::optional<PlacedPose> pose = PlacedPose::Of(search_.Reference(map), frame.T_cam_world);
  if (!pose || !usual_speed_.IsTooFar(map, *pose, frame.stamp_ns)) return false;
  return !IsSeenAsAWhole(report) && CountProven(map, frame.landmarks, {}) < kManyProven;
}

/// What was followed does not predict what is seen: the camera is where it was believed last, and lost.
void Tracker::GoBack() {
  follower_ = std::move(unbelieved_->follower);
  if (unbelieved_->why == Unbelieved::Why::kFoundAnew) relocalized_ns_.reset();
  unbelieved_.reset();
}

/// While the motion still leads, a place that looks alike is no better guess: people are such places. Who was
/// nowhere yet has no motion.
bool Tracker::MayRelocalize(const Attempt& attempt, int64_t stamp_ns) const {
  const std::optional<int64_t> last_ns = last_tracked_ns();
  if (!last_ns) return true;
  const int64_t missing_ns = stamp_ns - *last_ns;
  return missing_ns > (attempt.weak_pose ? kCoastNs : kNoPlacesNs);
}

Tracker::Attempt Tracker::FollowMotion(const Map& map, TrackedFrame* frame) {
  const uint64_t seed = DeriveSeed(seed_, frame->index, "track_keyframe");
  const bool careful = IsCareful(frame->stamp_ns);
  return {follower_.Follow(map, {frame->index, frame->stamp_ns}, careful, seed, &search_, frame)};
}

/// A camera that was lost a moment ago is nearly where it was, and may look elsewhere. The frame stays as it
/// was where nothing is found.
void Tracker::FindTurned(const Map& map, TrackedFrame* frame, Attempt* attempt) {
  const std::optional<PlacedPose> last = follower_.motion().last();
  const std::optional<Rigid3d> T_last = last ? last->In(map) : std::nullopt;
  if (!T_last) return;
  const int64_t since_ns = frame->stamp_ns - *last_tracked_ns();
  const double since_s = static_cast<double>(since_ns) * 1e-9;
  if (since_s > options_.motion.reach_known_s) return;
  const double reach_rad = std::min(kTurnReachRad + kTurnRadPerS * since_s, kMostTurnRad);
  TrackedFrame found(frame->index, frame->stamp_ns, frame->features);
  if (!search_.FromTurn(map, follower_.last(), *T_last, {.most_rad = reach_rad}, &found)) return;
  const TrackingReport report = search_.InLocalMap(map, true, std::nullopt, &found);
  if (!report.IsTracked() ||
      !follower_.motion().IsReachable(map, found.T_cam_world, {frame->index, frame->stamp_ns}) ||
      IsCarriedAway(map, report, found))
    return;
  *frame = std::move(found);
  attempt->report = report;
  attempt->relocalized = since_ns > kCoastNs;
  if (attempt->relocalized) relocalized_ns_ = frame->stamp_ns;
}

/// A pose that finds little of what it should see may be a little beside the true one, where new landmarks
/// have been made in the wrong places and the old ones lie beyond the search around them. It gives way to one
/// nearby that explains clearly more of the same frame. One that is turned by no more than the search around
/// landmarks reaches finds the same.
void Tracker::FindBetterPlace(const Map& map, TrackedFrame* frame, Attempt* attempt) {
  const TrackingReport& now = attempt->report;
  if (now.num_static >= kThinShare * now.num_expected || now.num_old_expected < TrackingReport::kEnoughOld)
    return;
  TrackedFrame found(frame->index, frame->stamp_ns, frame->features);
  const PoseSearch::TurnRange beyond_search = {options_.local_radius_rad, kBesideRad};
  if (!second_search_.FromTurn(map, *frame, frame->T_cam_world, beyond_search, &found)) return;
  const TrackingReport beside = second_search_.InLocalMap(map, true, std::nullopt, &found);
  if (!beside.IsTracked() || !ExplainsClearlyMore(beside, now)) return;
  search_.judge().DropEvidence();  // what the pose that was wrong said of landmarks
  *frame = std::move(found);
  attempt->report = search_.InLocalMap(map, true, std::nullopt, frame);
  attempt->begins_anew = true;
}

/// The frame stays as it was where no place in the map fits.
void Tracker::Relocalize(const Map& map, const Request& asked, TrackedFrame* frame, Attempt* attempt) {
  TrackedFrame found(frame->index, frame->stamp_ns, frame->features);
  const uint64_t seed = DeriveSeed(seed_, frame->index, "relocalize");
  const FrameTime time{frame->index, frame->stamp_ns};
  const auto is_here = [&] {
    const Keyframe* reference = search_.Reference(map);
    const InMap* was_in = std::get_if<InMap>(&asked.whereabouts);
    return reference != nullptr && was_in != nullptr && reference->map_id == was_in->map_id;
  };
  // Far away, and in another map, only what is proven to be no person is believed; or, where that map is too
  // young to have anything proven, what is seen as a whole. Nearby, some of it must be; or, where the map is
  // too young, the place must lie where the motion leads or show more than matches by chance. Nearby is where
  // the camera can have come from where it was tracked: where a weak pose has led since is a guess.
  const auto credible = [&](const TrackedFrame& at, const TrackingReport& report) {
    const int proven = CountProven(map, at.landmarks, {});
    if (proven >= kManyProven) return true;
    const MotionModel& motion = follower_.motion();
    const bool nearby = is_here() && motion.IsReachableFromTracked(map, at.T_cam_world, time);
    if (IsOldEnoughToProve(map)) return nearby && (proven >= kSomeProven || IsSeenAsAWhole(report));
    if (!is_here()) return IsSeenAsAWhole(report);
    return nearby && (motion.IsReachable(map, at.T_cam_world, time) || !report.MayMatchByChance());
  };
  Relocalizer::Request request{.last_seen = last_reference(), .seed = seed, .by_unmapped = true};
  const bool may_be_elsewhere = !std::holds_alternative<InAnyMap>(asked.whereabouts);
  if (may_be_elsewhere) request.credible = credible;
  if (!relocalizer_.Relocalize(map, request, &search_, &found)) return;
  *frame = std::move(found);
  attempt->report = search_.InLocalMap(map, true, std::nullopt, frame);
  if (request.credible && !credible(*frame, attempt->report))
    attempt->report.TakePoseAway("the place that was recognised is out of reach");
  if (attempt->report.IsDoubtful()) attempt->report.TakePoseAway();
  attempt->relocalized = attempt->report.IsTracked();
  attempt->in_another_map = may_be_elsewhere && !is_here();
  if (attempt->relocalized) relocalized_ns_ = frame->stamp_ns;
}

/// Not while what was found waits to be confirmed, which asks for more than a number of landmarks.
bool Tracker::IsCareful(int64_t stamp_ns) const {
  if (unbelieved_) return false;
  return relocalized_ns_ && stamp_ns - *relocalized_ns_ < kCarefulNs;
}

}  // namespace dmslam
