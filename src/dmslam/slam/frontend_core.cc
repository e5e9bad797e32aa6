#include "dmslam/slam/frontend_core.h"

#include <algorithm>
#include <utility>

#include "dmslam/map/may_drop.h"
#include "dmslam/tracking/keyframe_policy.h"
#include "dmslam/util/check.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr double kUncertainPosition = 0.03;     // standard deviation over the depth of the scene, and...
constexpr double kUncertainRotationRad = 0.03;  // ...of the rotation: beyond, a pose is called uncertain

constexpr double kDarkShare = 0.1;  // of the features that are looked for: with fewer it is dark

/// Of a pose that was told a moment ago; what is told of it later is another matter.
void TellCertainty(const PoseCertainty& certainty, FramePose* told) {
  const bool badly =
      certainty.position_share > kUncertainPosition || certainty.rotation_rad > kUncertainRotationRad;
  if (badly && told->state == TrackingState::kTracking) {
    told->state = TrackingState::kUncertain;
    told->reason = "the static features fix the pose badly";
  }
  told->covariance = UpperTriangle(certainty.covariance);
  if (!certainty.step) return;
  told->step_from = certainty.step->from;
  told->step_covariance = UpperTriangle(certainty.step->covariance);
}

std::function<FirstMapSearch()> SearchMaker(const FrontendCore::Setup& setup) {
  return [method = setup.options.initializer_method, options = setup.initializer, camera = setup.camera,
          pyramid = setup.pyramid, seed = setup.seed, run = setup.run_search] {
    FirstMapSearch search = MakeFirstMapSearch(method, options, camera, pyramid, seed);
    return run ? run(std::move(search)) : search;
  };
}

}  // namespace

FrontendCore::FrontendCore(const Setup& setup)
    : options_(setup.options),
      camera_(setup.camera),
      pyramid_(setup.pyramid),
      session_(setup.session),
      camera_id_(setup.camera_id),
      localize_only_(setup.localize_only),
      catch_up_in_portions_(setup.catch_up_in_portions),
      remember_(setup.remember),
      map_(setup.camera, setup.pyramid),
      own_maps_(setup.camera_id),
      features_(setup.extractor, setup.options.initializer_feature_factor),
      first_map_(SearchMaker(setup)),
      tracker_({setup.options.tracking, setup.camera, setup.vocabulary, setup.seed}),
      turns_(setup.camera),
      late_(setup.session, setup.camera_id, setup.seed, setup.options.tracking),
      last_poses_(setup.options.refiner, setup.options.smooth_at_end, setup.options.tracking, setup.camera),
      unplaced_(setup.options.max_kept_frames),
      evidence_(ToNs(setup.options.evidence_every_s)) {
  map_.KeepFeaturesIn(setup.feature_store);
  if (setup.in_saved_map) {
    phase_.BeginLost();
  } else {
    map_id_ = own_maps_.First();
  }
}

// ---- The map ----

void FrontendCore::ApplyMapDelta(const MapDelta& delta) {
  while (IsRefining()) RefineNext();
  map_.Apply(delta);
  late_.OnMapChanged(map_);
  tracker_.OnMapChanged(map_);
  FollowJoinedMap();
  if (delta.event == MapEvent::kFirstMapRefused) phase_.OnRefused(*delta.about);
  if (delta.progress.settled) gate_.OnSettled(*delta.progress.settled);
  // Now, as the next record may take landmarks away that are no part of the world but were good to see.
  if (delta.event == MapEvent::kMapAdjusted) last_poses_.Begin(map_, delta.map_id);
}

void FrontendCore::Resume() {
  if (map_.keyframes().empty()) return;
  const Keyframe* own = map_.NewestKeyframeOf(camera_id_);
  phase_.BeginLost();
  map_id_ = own != nullptr ? own->map_id : map_.keyframes().rbegin()->second.map_id;
  if (own != nullptr) gate_.ContinueAfter(own->stamp_ns);
}

/// One that became a keyframe has its pose by that; one whose map was given up waits for a pose again.
void FrontendCore::TakeOver(RememberedFrame remembered) {
  KeyframeProposal& seen = remembered.seen;
  TrackedFrame frame(seen.id.frame_index(), seen.stamp_ns,
                     MakeFrameFeatures(std::move(seen.features), camera_, pyramid_));
  for (const KeyframeProposal::Match& match : seen.matches) {
    frame.landmarks[match.feature] = match.landmark;
    frame.classes[match.feature] = FeatureClass::kUsed;
  }
  const std::optional<FramePose>& pose = remembered.pose;
  if (pose && pose->HasPose() && map_.ResolvePose(*pose->reference))
    return last_poses_.KeepEarlier(frame, *pose);
  if (!map_.ResolvePose(KeyframeIdOf(frame))) unplaced_.PutBack({WaitingFrame(frame)});
}

void FrontendCore::KeepUnplaced(const TrackedFrame& frame) {
  unplaced_.Keep(WaitingFrame(frame));
  if (remember_) remember_({SeenBy(frame), std::nullopt});
}

void FrontendCore::ForgetMap() {
  late_.Forget();
  map_.Clear();
  tracker_.OnMapForgotten();
}

FrontendOutput FrontendCore::GiveUpMap(int64_t stamp_ns, MapReset::Fate wanted, const std::string& reason) {
  FrontendOutput output;
  ++counters_.resets;
  for (WaitingFrame& frame : std::exchange(behind_, {})) unplaced_.Keep(std::move(frame));
  if (map_id_) output.Add(LeaveMap(*map_id_, stamp_ns, wanted, reason));
  map_id_ = own_maps_.Next(map_);
  tracker_.OnMapGivenUp();
  first_map_.Restart();
  phase_.GiveUpMap();
  gate_.Open();
  return output;
}

/// A map that others have keyframes in stays, too. The poses of a map that was wrong are void: the next one
/// may place its frames.
MapReset FrontendCore::LeaveMap(MapId left, int64_t stamp_ns, MapReset::Fate wanted,
                                const std::string& reason) {
  const MapReset::Fate fate = MayDrop(map_, left, camera_id_) ? wanted : MapReset::Fate::kKeep;
  if (fate == MapReset::Fate::kDrop) {
    own_maps_.Drop(left);
    if (options_.keyframes_at_end) unplaced_.PutBack(last_poses_.TakeFramesOf(left));
  }
  own_maps_.Take(left);
  return {left, fate, reason, stamp_ns, camera_id_};
}

/// The map that was tracked in may have become part of another.
void FrontendCore::FollowJoinedMap() {
  if (!phase_.HasMap() || !map_id_ || map_.HasMap(*map_id_)) return;
  own_maps_.Take(*map_id_);
  const std::optional<KeyframeId> reference = tracker_.last_reference();
  const Keyframe* last = reference ? map_.Resolve(*reference) : nullptr;
  if (last != nullptr) map_id_ = last->map_id;
}

TrackingState FrontendCore::state() const {
  if (turns_.IsMeasured() && !phase_.IsWaiting()) return TrackingState::kRotationOnly;
  return phase_.IsSearching() && !map_.keyframes().empty() ? TrackingState::kLost : phase_.state();
}

// ---- Frames ----

FrontendOutput FrontendCore::ProcessImage(uint32_t frame_index, int64_t stamp_ns, const GrayView& image) {
  return ProcessFeatures(frame_index, stamp_ns, features_.Extract(image, phase_.IsSearching()));
}

FrontendOutput FrontendCore::ProcessFeatures(uint32_t frame_index, int64_t stamp_ns, FeatureSet features) {
  frame_ = TrackedFrame(frame_index, stamp_ns, MakeFrameFeatures(std::move(features), camera_, pyramid_));
  gate_.OnFrame(stamp_ns);
  // In a saved map it is lost from now on.
  odometry_.Predict({frame_index, stamp_ns});
  if (++counters_.frames == 1) tracker_.BeginLost();
  if (IsBehind()) return AwaitTurn();
  FrontendOutput output;
  if (phase_.HasMap() && map_.keyframes().empty())
    output = GiveUpMap(stamp_ns, MapReset::Fate::kDrop, "the mapper began with an empty map");
  output.Append(ProcessFrame());
  return output;
}

FrontendOutput FrontendCore::ProcessFrame() {
  if (phase_.IsSearching()) return Initialize();
  if (phase_.IsWaiting()) return AwaitMap();
  return Track(&frame_);
}

/// While a first map is looked for, every frame also asks the maps that there are where it is: who is
/// recognised goes on there.
std::optional<FrontendOutput> FrontendCore::FindAgain() {
  if (map_.keyframes().empty() || own_maps_.HasDropped(map_)) return std::nullopt;
  TrackingResult result = tracker_.Track(map_, {.whereabouts = Tracker::PerhapsInNone{}}, std::move(frame_));
  frame_ = std::move(result.frame);
  if (!result.pose) return std::nullopt;
  ++counters_.relocalizations;
  map_id_ = map_.At(result.pose->reference).map_id;
  first_map_.Restart();
  phase_.BeginLost();
  return OnTracked(frame_, result);
}

FrontendOutput FrontendCore::Initialize() {
  if (std::optional<FrontendOutput> found = FindAgain()) return std::move(*found);
  FrontendOutput output;
  FollowTurn(frame_);
  KeepUnplaced(frame_);
  FirstMapPhase::Answer answer = first_map_.AddFrame(frame_, session_, camera_id_, *map_id_);
  if (answer.proposal) {
    const KeyframeProposal& second = answer.proposal->second;
    gate_.OnProposed(second.id, second.stamp_ns);
    phase_.Propose(second.id);
    ++counters_.keyframes_proposed;
    output.Add(std::move(*answer.proposal));
  }
  output.Add(NoPose(frame_, state(), std::move(answer.reason)));
  return output;
}

FrontendOutput FrontendCore::AwaitMap() {
  FrontendOutput output;
  const Keyframe* second = map_.FindKeyframe(phase_.awaited_second().value());
  if (second == nullptr) {
    KeepUnplaced(frame_);
    // A mapper that was started again may have settled it without a word.
    if (phase_.IsRefused() || !awaited()) output = GiveUpRefusedMap();
    output.Add(NoPose(frame_, phase_.state(), "waiting for the mapper to answer the first map"));
    return output;
  }
  BeginTrial(*second);
  if (catch_up_in_portions_) return AwaitTurn();
  while (IsBehind()) output.Append(CatchUp());
  output.Append(phase_.IsSearching() ? Initialize() : Track(&frame_));
  return output;
}

/// Where a map of that number is there, it is another one, which stays.
FrontendOutput FrontendCore::GiveUpRefusedMap() {
  const bool is_taken = map_.HasMap(*map_id_);
  return GiveUpMap(frame_.stamp_ns, is_taken ? MapReset::Fate::kKeep : MapReset::Fate::kDrop,
                   "the mapper refused the first map");
}

/// The frames since the one that made the map are tracked in their order: in real time some came while it was
/// searched for and adjusted.
void FrontendCore::BeginTrial(const Keyframe& second) {
  tracker_.BeginAt(second);
  phase_.BeginTrial(second.stamp_ns + ToNs(options_.trial_s));
  behind_ = unplaced_.TakeFrom(second.id.frame_index());
}

FrontendOutput FrontendCore::AwaitTurn() {
  behind_.emplace_back(frame_);
  if (remember_) remember_({SeenBy(frame_), std::nullopt});
  FrontendOutput output;
  output.Add(
      NoPose(frame_, TrackingState::kWaitingForMap, "frames that waited for the first map come first"));
  return output;
}

double FrontendCore::seconds_behind() const {
  if (behind_.empty()) return 0.0;
  return 1e-9 * static_cast<double>(behind_.back().stamp_ns - behind_.front().stamp_ns);
}

FrontendOutput FrontendCore::CatchUp() {
  TrackedFrame frame = std::move(behind_.front()).ToTracked(camera_, pyramid_);
  behind_.pop_front();
  odometry_.Predict({frame.index, frame.stamp_ns});
  if (!map_.keyframes().empty()) return Track(&frame);
  unplaced_.Keep(WaitingFrame(frame));
  return GiveUpMap(frame.stamp_ns, MapReset::Fate::kDrop, "the mapper began with an empty map");
}

// ---- Tracking ----

FrontendOutput FrontendCore::Track(TrackedFrame* frame) {
  Tracker::Request request{.whereabouts = Tracker::InAnyMap{}, .may_relocalize = !phase_.IsTrial()};
  if (map_id_) request.whereabouts = Tracker::InMap{*map_id_};
  TrackingResult result = tracker_.Track(map_, request, std::move(*frame));
  *frame = std::move(result.frame);
  if (result.relocalized) ++counters_.relocalizations;
  if (!result.pose) return OnNotTracked(*frame, result.report);
  map_id_ = map_.At(result.pose->reference).map_id;
  return OnTracked(*frame, result);
}

FrontendOutput FrontendCore::OnTracked(const TrackedFrame& frame, const TrackingResult& result) {
  const TrackingReport& report = result.report;
  const PlacedPose& pose = *result.pose;
  ++counters_.tracked;
  turns_.Begin(frame);
  lit_since_ns_.reset();
  phase_.OnTracked(frame.stamp_ns);
  odometry_.OnTracked(map_, {frame.index, frame.stamp_ns}, pose, frame.T_cam_world, result.certainty,
                      !result.relocalized);
  FrontendOutput output;
  ReportLandmarks(frame, pose, WantsKeyframe(frame, report, pose.reference), EvidenceSchedule::Way::kForward,
                  &output);
  FramePose told = MakePose(frame, phase_.state(), report, pose);
  last_poses_.Keep(frame, told);
  if (remember_) remember_({SeenBy(frame), told});
  if (result.certainty) TellCertainty(*result.certainty, &told);
  output.Add(std::move(told));
  return output;
}

/// Where no position is known, the way the camera looks may be.
void FrontendCore::FollowTurn(const TrackedFrame& frame) {
  turns_.Follow(frame);
  if (turns_.IsMeasured()) odometry_.OnTurned(turns_.begun_ns(), turns_.R_now_begun());
}

FrontendOutput FrontendCore::OnNotTracked(const TrackedFrame& frame, const TrackingReport& report) {
  FrontendOutput output;
  FollowTurn(frame);
  KeepUnplaced(frame);
  if (phase_.IsTrial() && report.outcome == TrackingReport::Outcome::kContradicted) {
    output = GiveUpMap(frame.stamp_ns, MapReset::Fate::kDrop,
                       std::string("the first map does not predict the next frames: ") + report.reason);
  } else {
    const std::optional<int64_t> last_ns = tracker_.last_tracked_ns();
    const int64_t missing_ns = last_ns ? frame.stamp_ns - *last_ns : INT64_MAX;
    phase_.OnMissing(missing_ns);
    if (IsLostInTheLight(frame, missing_ns) && !localize_only_ && !tracker_.IsUndecided())
      output = GiveUpMap(frame.stamp_ns, MapReset::Fate::kKeep, "lost for too long");
  }
  output.Add(MakePose(frame, phase_.IsSearching() ? phase_.state() : state(), report, std::nullopt));
  return output;
}

/// For so long that another map is looked for. Darkness is no new place.
bool FrontendCore::IsLostInTheLight(const TrackedFrame& frame, int64_t missing_ns) {
  const size_t wanted = static_cast<size_t>(features_.wanted());
  if (static_cast<double>(frame.features->size()) < kDarkShare * static_cast<double>(wanted)) {
    lit_since_ns_.reset();
    return false;
  }
  if (!lit_since_ns_) lit_since_ns_ = frame.stamp_ns;
  const int64_t lost_ns = std::min(missing_ns, frame.stamp_ns - *lit_since_ns_);
  return lost_ns > ToNs(options_.new_map_after_s);
}

FramePose FrontendCore::NoPose(const TrackedFrame& frame, TrackingState state, std::string reason) const {
  FramePose told = MakePose(frame, state, {}, std::nullopt);
  told.reason = std::move(reason);
  return told;
}

FramePose FrontendCore::MakePose(const TrackedFrame& frame, TrackingState state, const TrackingReport& report,
                                 const std::optional<PlacedPose>& pose) const {
  FramePose told;
  told.frame_index = frame.index;
  told.camera_id = camera_id_;
  told.stamp_ns = frame.stamp_ns;
  told.state = state;
  told.map_id = map_id_;
  told.num_features = static_cast<uint16_t>(frame.features->size());
  told.num_static = static_cast<uint16_t>(report.num_static);
  told.num_moving = static_cast<uint16_t>(report.num_moving);
  told.num_unknown = static_cast<uint16_t>(report.num_unknown);
  told.moving_image_share = static_cast<float>(report.moving_share);
  told.reason = report.reason;
  if (!pose) return told;
  told.reference = pose->reference;
  told.T_cam_reference = pose->T_cam_reference;
  told.reference_scale = pose->scale;
  told.T_cam_world = frame.T_cam_world;
  return told;
}

// ---- Keyframes and evidence ----

bool FrontendCore::WantsKeyframe(const TrackedFrame& frame, const TrackingReport& report,
                                 KeyframeId reference_id) {
  const Keyframe* reference = map_.FindKeyframe(reference_id);
  if (localize_only_ || reference == nullptr) return false;
  const KeyframeInputs inputs{report.num_static, ExpectedOf(map_, *reference), gate_.SinceNs(frame.stamp_ns),
                              gate_.step_ns()};
  if (!dmslam::WantsKeyframe(options_.keyframe, inputs)) return false;
  if (!gate_.IsOpen()) ++counters_.keyframes_withheld;
  return gate_.IsOpen();
}

/// What frames said of landmarks, from time to time and before each keyframe; and the keyframe.
void FrontendCore::ReportLandmarks(const TrackedFrame& frame, const PlacedPose& pose, bool keyframe,
                                   EvidenceSchedule::Way way, FrontendOutput* output) {
  if (evidence_.IsDueAt(frame.stamp_ns, keyframe, way)) {
    FrameEvidence evidence = tracker_.TakeEvidence(frame.stamp_ns, map_id_);
    evidence.camera_id = camera_id_;
    if (!evidence.items.empty() && !localize_only_) output->Add(std::move(evidence));
  }
  if (keyframe) output->Add(ProposeKeyframe(frame, pose));
}

KeyframeProposal FrontendCore::ProposeKeyframe(const TrackedFrame& frame, const PlacedPose& pose) {
  DMSLAM_CHECK(map_id_.has_value(), "a keyframe without a map");
  KeyframeProposal proposal = SeenBy(frame);
  proposal.map_id = *map_id_;
  proposal.reference = pose.reference;
  proposal.T_cam_reference = pose.T_cam_reference;
  proposal.reference_scale = pose.scale;
  gate_.OnProposed(proposal.id, proposal.stamp_ns);
  ++counters_.keyframes_proposed;
  return proposal;
}

/// As a keyframe without a pose.
KeyframeProposal FrontendCore::SeenBy(const TrackedFrame& frame) const {
  KeyframeProposal seen;
  seen.id = KeyframeIdOf(frame);
  seen.camera_id = camera_id_;
  seen.map_id = map_id_.value_or(MapId{1});
  seen.stamp_ns = frame.stamp_ns;
  seen.features = frame.features->set;
  for (size_t i = 0; i < frame.classes.size(); ++i) {
    const uint16_t feature = static_cast<uint16_t>(i);
    if (frame.classes[i] == FeatureClass::kUsed && frame.landmarks[i].valid()) {
      seen.matches.push_back({feature, frame.landmarks[i]});
    } else if (frame.classes[i] == FeatureClass::kMoving) {
      seen.moving.push_back(feature);
    }
  }
  return seen;
}

// ---- After the end ----

/// A frame without a pose, with its pose if it can be placed.
std::optional<LatePlacement::Placed> FrontendCore::PlaceLate(LateMap late_map, TrackedFrame* frame) {
  const LatePlacement::Found found = late_.Place(
      map_, late_map, {&tracker_.search(), tracker_.relocalizer(), tracker_.usual_speed()}, frame);
  if (!found.report.IsTracked()) return std::nullopt;
  const auto pose = PlacedPose::Of(tracker_.search().Reference(map_), frame->T_cam_world);
  if (!pose) return std::nullopt;
  return LatePlacement::Placed{*frame, found.report, *pose, found.jumped};
}

std::optional<FrontendOutput> FrontendCore::GrowBack() {
  if (!options_.keyframes_at_end || localize_only_) return std::nullopt;
  if (unplaced_.empty() || map_.keyframes().empty()) {
    unplaced_.ReturnSetAside();  // they are tried again in the adjusted map
    late_.Forget();
    return std::nullopt;
  }
  TrackedFrame frame = TakeNewestUnplaced();
  std::optional<LatePlacement::Placed> placed = PlaceLate(LateMap::kGrows, &frame);
  if (!placed) {
    tracker_.search().judge().DropEvidence();
    unplaced_.SetAside(WaitingFrame(frame));
    return FrontendOutput();
  }
  const KeyframeId reference = placed->pose.reference;
  map_id_ = map_.At(reference).map_id;
  // The way on does not depend on it: what is seen in a corner only would be mapped as wrong as it is placed.
  const bool known = map_.Resolve(KeyframeIdOf(frame)) != nullptr;
  const bool wanted = IsWellSeen(placed->report) && !known && WantsKeyframe(frame, placed->report, reference);
  FrontendOutput output;
  ReportLandmarks(frame, placed->pose, wanted, EvidenceSchedule::Way::kBack, &output);
  if (!KeepBelieved(LateMap::kGrows, *std::move(placed))) unplaced_.SetAside(WaitingFrame(frame));
  return output;
}

/// Whether any frame is believed now: this one, and those after it that were not yet. While the map grows,
/// last poses come with those of the frames that were tracked.
bool FrontendCore::KeepBelieved(LateMap late_map, LatePlacement::Placed placed) {
  const MapId map_id = map_.At(placed.pose.reference).map_id;
  const auto before = last_poses_.TrackedBefore(map_, map_id, placed.frame.index);
  auto believed = late_.GoOnFrom(map_, late_map, tracker_.search(), std::move(placed), before);
  const bool grows = late_map == LateMap::kGrows;
  for (const LatePlacement::Placed& told : believed) {
    const FramePose pose = MakePose(told.frame, TrackingState::kLocalizedLater, told.report, told.pose);
    if (grows) {
      unplaced_.ForgetSetAside(told.frame.index);
      last_poses_.KeepPlaced(told.frame, pose, told.confirmed);
    } else {
      last_poses_.AddPlaced(map_, told.frame, pose, told.confirmed);
    }
  }
  return !believed.empty();
}

bool FrontendCore::WorkAtEnd() {
  if (unplaced_.empty()) return last_poses_.Improve(map_);
  TrackedFrame frame = TakeNewestUnplaced();
  if (auto placed = PlaceLate(LateMap::kStands, &frame)) KeepBelieved(LateMap::kStands, *std::move(placed));
  return true;
}

FrontendOutput FrontendCore::Finish() {
  FrontendOutput output;
  while (IsBehind()) output.Append(CatchUp());
  RefineRest();
  while (IsRefining()) RefineNext();
  while (WorkAtEnd()) {
  }
  for (FramePose& pose : last_poses_.Take(map_)) output.Add(std::move(pose));
  late_.Forget();
  return output;
}

}  // namespace dmslam
