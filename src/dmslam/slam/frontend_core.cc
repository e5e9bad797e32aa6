#include "dmslam/slam/frontend_core.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "dmslam/initialization/initial_map.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int64_t kNsPerSecond = 1'000'000'000;
constexpr double kPredictionValid_s = 0.5;  // how long after the last pose the motion model is still tried
constexpr uint32_t kPriorValidFrames = 5;   // after so many the motion model says too little
constexpr int kLostAfterFrames = 10;
constexpr uint32_t kNearFrames = 10;        // a placed frame so near bounds where a frame may be
constexpr double kMaxShiftPerFrame = 0.05;  // share of the scene's depth
constexpr double kMaxTurnPerFrame_rad = 0.1;
constexpr int kWellSeen = 100;      // static features of a frame that becomes a keyframe at the end...
constexpr int kWellSeenCells = 12;  // ...and the cells of an 8 x 6 grid that hold them

int64_t ToNs(double seconds) { return static_cast<int64_t>(seconds * static_cast<double>(kNsPerSecond)); }

double MillisecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

OrbExtractorOptions WithMoreFeatures(OrbExtractorOptions options, double factor) {
  options.num_features = static_cast<int>(std::lround(factor * options.num_features));
  return options;
}

FrameRefinerOptions RefinerOptions(const FrontendOptions& frontend) {
  FrameRefinerOptions options = frontend.refiner;
  options.for_smoothing = options.for_smoothing || frontend.smooth_at_end;
  return options;
}

}  // namespace

FrontendCore::FrontendCore(Setup setup)
    : options_(setup.options),
      camera_(setup.camera),
      pyramid_(setup.pyramid),
      session_(setup.session),
      seed_(setup.seed),
      localize_only_(setup.localize_only),
      catch_up_in_portions_(setup.catch_up_in_portions),
      map_(setup.camera, setup.pyramid),
      refiner_(RefinerOptions(setup.options)),
      extractor_(setup.extractor),
      first_map_extractor_(WithMoreFeatures(setup.extractor, setup.options.initializer_feature_factor)),
      initializer_options_(setup.initializer),
      run_search_(std::move(setup.run_search)),
      initializer_(MakeInitializer()),
      tracker_(setup.options.tracking, setup.camera, setup.pyramid),
      searcher_(setup.options.tracking, setup.camera, setup.pyramid),
      relocalizer_(setup.vocabulary) {
  if (!setup.in_saved_map) return;
  state_ = TrackingState::kLost;
  map_id_ = 0;  // any, until it has found itself in one
}

FirstMapSearch FrontendCore::MakeInitializer() const {
  return run_search_ ? run_search_(MakeSearch()) : MakeSearch();
}

FirstMapSearch FrontendCore::MakeSearch() const {
  if (options_.initializer_method == "ransac") {
    auto baseline = std::make_shared<BaselineInitializer>(BaselineInitializerOptions(), camera_, seed_);
    return [baseline](const InitializerFrame& frame) { return baseline->AddFrame(frame); };
  }
  InitializerOptions options = initializer_options_;
  options.method = options_.initializer_method;
  auto initializer =
      std::make_shared<Initializer>(options, camera_, seed_, AdjustInitialMap(camera_.Ideal()));
  return [initializer](const InitializerFrame& frame) { return initializer->AddFrame(frame); };
}

void FrontendCore::ApplyMapDelta(const MapDelta& delta) {
  while (IsRefining()) RefineNext();
  map_.Apply(delta);
  PlaceNeighbourAgain();
  relocalizer_.Update(map_);
  const KeyframeId settled = delta.progress.settled;
  if (grows_back_ ? settled == awaited_ : settled >= awaited_) awaited_ = {};
  const bool at_the_end = delta.event == MapEvent::kGloballyAdjusted && !delta.about.valid();
  if (!at_the_end) return;
  // Now, as the next record may take landmarks away that are no part of the world but were good to see.
  refiner_.Begin(map_, delta.map_id);
}

/// The frame placed last, while the map grows back, may lie elsewhere now; where it became a keyframe that
/// knows more. Any other is forgotten.
void FrontendCore::PlaceNeighbourAgain() {
  if (!near_.next) return;
  const bool is_last = grows_back_ && near_.next->index == near_.moving;
  const bool is_keyframe = map_.FindKeyframe(KeyframeId::Make(session_, near_.next->index)) != nullptr;
  const std::optional<Rigid3d> T_cam_world =
      is_last && !is_keyframe ? PoseOf(last_placed_) : std::optional<Rigid3d>();
  if (T_cam_world) {
    near_.next->T_cam_world = *T_cam_world;
  } else {
    near_.next.reset();
  }
}

void FrontendCore::RefineRest() { refiner_.Begin(map_); }

void FrontendCore::RefineNext() {
  const auto search = [this](TrackedFrame* frame) {
    searcher_.Reset();  // what the frame before saw move may lie still in this one
    return searcher_.TrackLocalMap(map_, false, frame).ok;
  };
  if (auto pose = refiner_.RefineNext(map_, search)) final_poses_.Add(map_, std::move(*pose));
}

void FrontendCore::Resume() {
  if (map_.keyframes().empty()) return;
  const Keyframe& newest = map_.keyframes().rbegin()->second;
  state_ = TrackingState::kLost;
  map_id_ = newest.map_id;
  last_keyframe_ = newest.id;
  last_keyframe_ns_ = newest.stamp_ns;
}

void FrontendCore::ForgetMap() {
  near_ = {};
  map_.Clear();
  relocalizer_.Clear();
  tracker_.Reset();
}

void FrontendCore::ProcessImage(uint32_t frame_index, int64_t stamp_ns, const GrayView& image,
                                std::vector<FrontendEvent>* events) {
  const auto start = std::chrono::steady_clock::now();
  FeatureSet features;
  (state_ == TrackingState::kNotInitialized ? first_map_extractor_ : extractor_).Extract(image, &features);
  extract_ms_ = MillisecondsSince(start);
  ProcessFeatures(frame_index, stamp_ns, std::move(features), events);
}

void FrontendCore::ProcessFeatures(uint32_t frame_index, int64_t stamp_ns, FeatureSet features,
                                   std::vector<FrontendEvent>* events) {
  ++counters_.frames;
  frame_ = TrackedFrame(frame_index, stamp_ns, MakeFrameFeatures(std::move(features), camera_, pyramid_));
  if (counters_.frames == 1) last_tracked_ns_ = stamp_ns;  // in a saved map it is lost from now on
  if (IsBehind()) {
    AwaitTurn(events);
    return;
  }
  const bool tracks = state_ != TrackingState::kNotInitialized && state_ != TrackingState::kWaitingForMap;
  if (tracks && map_.keyframes().empty()) GiveUpMap(true, "the mapper began with an empty map", events);
  switch (state_) {
    case TrackingState::kNotInitialized:
      Initialize(events);
      break;
    case TrackingState::kWaitingForMap:
      AwaitMap(events);
      break;
    default:
      Track(events);
  }
}

// ---- Initialisation ----

void FrontendCore::KeepUnplaced(WaitingFrame frame) {
  unplaced_.push_back(std::move(frame));
  if (static_cast<int>(unplaced_.size()) > options_.max_kept_frames) unplaced_.pop_front();
}

void FrontendCore::Initialize(std::vector<FrontendEvent>* events) {
  KeepUnplaced(WaitingFrame(frame_));
  const InitializerReport report = initializer_({frame_.index, frame_.stamp_ns, frame_.features});
  TrackingReport status;
  status.reason = report.reason.c_str();
  if (report.result) {
    InitialMap proposal = MakeInitialMap(*report.result, session_, map_id_);
    initial_first_ = proposal.first.id;
    initial_second_ = proposal.second.id;
    last_keyframe_ = awaited_ = initial_second_;
    last_keyframe_ns_ = proposal.second.stamp_ns;
    state_ = TrackingState::kWaitingForMap;
    status.reason = "a first map was proposed";
    events->push_back(std::move(proposal));
    ++counters_.keyframes_proposed;
  }
  events->push_back(MakePose(state_, status));
}

void FrontendCore::AwaitMap(std::vector<FrontendEvent>* events) {
  const Keyframe* second = map_.FindKeyframe(initial_second_);
  if (second == nullptr) {
    KeepUnplaced(WaitingFrame(frame_));
    if (!awaited_.valid()) {  // settled without it: the mapper refused the proposal
      GiveUpMap(true, "the mapper refused the first map", events);
    }
    TrackingReport status;
    status.reason = "waiting for the mapper to answer the first map";
    events->push_back(MakePose(state_, status));
    return;
  }
  BeginTrial(*second);
  if (!catch_up_in_portions_) {
    TrackedFrame present = std::move(frame_);
    while (IsBehind()) CatchUp(events);
    frame_ = std::move(present);
    state_ == TrackingState::kNotInitialized ? Initialize(events) : Track(events);
  } else {
    AwaitTurn(events);
  }
}

/// The frames since the one that made the map are tracked in their order: in real time some came while it was
/// searched for and adjusted.
void FrontendCore::BeginTrial(const Keyframe& second) {
  last_ = FrameOfKeyframe(second);
  last_placed_ = {second.id, Rigid3d(), second.scale};
  velocity_.reset();
  coasting_.reset();
  last_tracked_ns_ = second.stamp_ns;
  trial_until_ns_ = second.stamp_ns + ToNs(options_.trial_s);
  state_ = TrackingState::kTrial;
  const uint32_t since = second.id.frame_index();
  const auto first = std::find_if(unplaced_.begin(), unplaced_.end(),
                                  [since](const WaitingFrame& frame) { return frame.index >= since; });
  behind_.assign(std::make_move_iterator(first), std::make_move_iterator(unplaced_.end()));
  unplaced_.erase(first, unplaced_.end());
}

void FrontendCore::AwaitTurn(std::vector<FrontendEvent>* events) {
  behind_.emplace_back(frame_);
  TrackingReport status;
  status.reason = "frames that waited for the first map come first";
  events->push_back(MakePose(TrackingState::kWaitingForMap, status));
}

void FrontendCore::CatchUp(std::vector<FrontendEvent>* events) {
  frame_ = std::move(behind_.front()).ToTracked(camera_, pyramid_);
  behind_.pop_front();
  if (map_.keyframes().empty()) {
    KeepUnplaced(WaitingFrame(frame_));
    GiveUpMap(true, "the mapper began with an empty map", events);
  } else {
    Track(events);
  }
}

TrackedFrame FrontendCore::FrameOfKeyframe(const Keyframe& keyframe) const {
  TrackedFrame frame(keyframe.id.frame_index(), keyframe.stamp_ns, keyframe.features);
  frame.landmarks = keyframe.landmarks;
  frame.T_cam_world = keyframe.T_cam_world;
  return frame;
}

// ---- Tracking ----

std::optional<Rigid3d> FrontendCore::PoseOf(const Placed& placed) const {
  const std::optional<Map::ResolvedPose> reference = map_.ResolvePose(placed.reference);
  if (!reference) return std::nullopt;
  return reference->Compose(placed.T_cam_reference, placed.scale);
}

std::optional<Rigid3d> FrontendCore::PredictPose() const {
  const Placed& newest = NewestPlaced();
  const std::optional<Rigid3d> T_last_world = PoseOf(newest);
  if (!T_last_world || !velocity_) return T_last_world;
  // The map may have been scaled since the velocity was measured.
  const double growth = map_.ResolvePose(newest.reference)->scale / newest.scale;
  return Rigid3d(velocity_->rotation, velocity_->translation * growth) * *T_last_world;
}

bool FrontendCore::FindPose() {
  const std::optional<Rigid3d> predicted = PredictPose();
  const bool recent = frame_.stamp_ns - last_tracked_ns_ < ToNs(kPredictionValid_s);
  relocalized_ = false;
  const Keyframe* reference = map_.FindKeyframe(last_placed_.reference);
  const std::optional<double> depth = reference != nullptr ? map_.MedianDepth(*reference) : std::nullopt;
  const uint32_t gap = frame_.index - NewestIndex();
  const bool trusted = velocity_ && predicted && gap <= kPriorValidFrames;
  tracker_.SetMotionPrior(trusted ? predicted : std::nullopt, depth.value_or(1.0), gap);
  if (!predicted || !recent) return false;
  if (tracker_.TrackFromFrame(map_, last_, *predicted, &frame_)) return true;
  if (trusted) {
    const int inliers = tracker_.TrackFromPrediction(map_, *predicted, &frame_);
    if (inliers >= options_.tracking.min_local_inliers) return true;
    if (inliers >= options_.tracking.min_coasting_inliers) weak_pose_ = frame_.T_cam_world;
  }
  const uint64_t seed = DeriveSeed(seed_, frame_.index, "track_keyframe");
  return tracker_.TrackFromKeyframe(map_, last_placed_.reference, seed, &frame_);
}

void FrontendCore::Track(std::vector<FrontendEvent>* events) {
  TrackingReport report;
  report.reason = "too few features match the last frame";
  weak_pose_.reset();
  if (FindPose()) {
    const bool careful = frame_.stamp_ns - relocalized_ns_ < kNsPerSecond && relocalized_ns_ != 0;
    report = tracker_.TrackLocalMap(map_, careful, &frame_);
    if (report.num_static >= options_.tracking.min_coasting_inliers) weak_pose_ = frame_.T_cam_world;
  }
  if (!report.ok && state_ != TrackingState::kTrial) {
    tracker_.SetMotionPrior(std::nullopt, 1.0);
    TrackedFrame attempt(frame_.index, frame_.stamp_ns, frame_.features);
    const uint64_t seed = DeriveSeed(seed_, frame_.index, "relocalize");
    if (relocalizer_.Relocalize(map_, map_id_, last_placed_.reference, seed, &tracker_, &attempt)) {
      frame_ = std::move(attempt);
      report = tracker_.TrackLocalMap(map_, true, &frame_);
      if (report.ok) {
        ++counters_.relocalizations;
        relocalized_ = true;
        relocalized_ns_ = frame_.stamp_ns;
        const Keyframe* reference = map_.FindKeyframe(tracker_.reference());
        if (map_id_ == 0 && reference != nullptr) map_id_ = reference->map_id;
      }
    }
  }
  if (report.ok) {
    OnTracked(report, events);
  } else {
    OnNotTracked(report, events);
  }
}

std::optional<FrontendCore::Placed> FrontendCore::Place(const Rigid3d& T_cam_world,
                                                        KeyframeId reference) const {
  const Keyframe* keyframe = map_.FindKeyframe(reference);
  if (keyframe == nullptr) return std::nullopt;
  return Placed{reference, T_cam_world * keyframe->T_cam_world.Inverse(), keyframe->scale};
}

void FrontendCore::OnTracked(const TrackingReport& report, std::vector<FrontendEvent>* events) {
  const std::optional<Rigid3d> last_pose = PoseOf(NewestPlaced());
  const std::optional<Placed> placed = Place(frame_.T_cam_world, tracker_.reference());
  if (!placed) {
    OnNotTracked(report, events);
    return;
  }
  ++counters_.tracked;
  const bool successive = frame_.index - NewestIndex() <= 2 && !relocalized_;
  velocity_.reset();
  if (successive && last_pose) velocity_ = frame_.T_cam_world * last_pose->Inverse();
  last_placed_ = *placed;
  coasting_.reset();
  last_tracked_ns_ = frame_.stamp_ns;
  if (state_ != TrackingState::kTrial || frame_.stamp_ns >= trial_until_ns_)
    state_ = TrackingState::kTracking;
  const bool keyframe = WantsKeyframe(report);
  if (++frames_since_evidence_ >= options_.evidence_every_frames || keyframe) FlushEvidence(events);
  if (keyframe) ProposeKeyframe(events);
  FramePose pose = MakePose(state_, report);
  refiner_.Keep(frame_, pose);
  events->push_back(std::move(pose));
  last_ = frame_;
}

void FrontendCore::Coast() {
  const std::optional<Rigid3d> last_pose = PoseOf(NewestPlaced());
  const std::optional<Placed> placed = Place(*weak_pose_, last_placed_.reference);
  if (!placed || !last_pose || frame_.index - NewestIndex() > kPriorValidFrames) return;
  if (frame_.index - NewestIndex() == 1) velocity_ = *weak_pose_ * last_pose->Inverse();
  coasting_ = Coasting{*placed, frame_.index};
}

void FrontendCore::OnNotTracked(const TrackingReport& report, std::vector<FrontendEvent>* events) {
  KeepUnplaced(WaitingFrame(frame_));
  if (weak_pose_) Coast();
  if (state_ == TrackingState::kTrial) {
    GiveUpMap(true, std::string("the first map does not predict the next frames: ") + report.reason, events);
    events->push_back(MakePose(state_, report));
    return;
  }
  const int64_t missing_ns = frame_.stamp_ns - last_tracked_ns_;
  const bool lost = missing_ns > ToNs(kLostAfterFrames / camera_.fps);
  state_ = lost ? TrackingState::kLost : TrackingState::kUncertain;
  ++(lost ? counters_.lost : counters_.uncertain);
  if (missing_ns > ToNs(options_.new_map_after_s) && !localize_only_) {
    GiveUpMap(false, "lost for too long", events);
  }
  events->push_back(MakePose(state_, report));
}

void FrontendCore::GiveUpMap(bool drop, const std::string& reason, std::vector<FrontendEvent>* events) {
  ++counters_.resets;
  if (map_id_ != 0) events->push_back(MapReset{map_id_, drop, reason});
  for (WaitingFrame& frame : std::exchange(behind_, {})) KeepUnplaced(std::move(frame));
  if (drop && options_.keyframes_at_end) PutBackFramesOf(map_id_);
  NextMapId();
  tracker_.Reset();
  velocity_.reset();
  coasting_.reset();
  initializer_ = MakeInitializer();
  state_ = TrackingState::kNotInitialized;
  awaited_ = {};
}

/// The poses of a map that was wrong are void: the next one may place its frames.
void FrontendCore::PutBackFramesOf(MapId map_id) {
  for (WaitingFrame& frame : refiner_.TakeFramesOf(map_id)) unplaced_.push_back(std::move(frame));
  std::sort(unplaced_.begin(), unplaced_.end(),
            [](const WaitingFrame& a, const WaitingFrame& b) { return a.index < b.index; });
  while (static_cast<int>(unplaced_.size()) > options_.max_kept_frames) unplaced_.pop_front();
}

/// A number that no map has had: those of a saved one are taken.
void FrontendCore::NextMapId() {
  for (const auto& [id, keyframe] : map_.keyframes()) map_id_ = std::max(map_id_, keyframe.map_id);
  ++map_id_;
}

FramePose FrontendCore::MakePose(TrackingState state, const TrackingReport& report) const {
  FramePose pose;
  pose.frame_index = frame_.index;
  pose.stamp_ns = frame_.stamp_ns;
  pose.state = state;
  pose.map_id = map_id_;
  pose.num_features = static_cast<uint16_t>(frame_.features->size());
  pose.num_static = static_cast<uint16_t>(report.num_static);
  pose.num_moving = static_cast<uint16_t>(report.num_moving);
  pose.num_unknown = static_cast<uint16_t>(report.num_unknown);
  pose.moving_image_share = static_cast<float>(report.moving_share);
  pose.reason = report.reason;
  if (!report.ok) return pose;
  pose.reference = last_placed_.reference;
  pose.T_cam_reference = last_placed_.T_cam_reference;
  pose.reference_scale = last_placed_.scale;
  pose.T_cam_world = frame_.T_cam_world;
  return pose;
}

// ---- Keyframes ----

bool FrontendCore::WantsKeyframe(const TrackingReport& report) {
  const KeyframeOptions& o = options_.keyframe;
  const Keyframe* reference = map_.FindKeyframe(tracker_.reference());
  if (localize_only_ || reference == nullptr || report.num_static <= o.min_inliers) return false;
  const int min_observations = map_.keyframes().size() <= 2 ? 2 : 3;
  const int expected = map_.CountTracked(*reference, min_observations);
  const int64_t since_ns =
      grows_back_ ? std::abs(frame_.stamp_ns - last_keyframe_ns_) : frame_.stamp_ns - last_keyframe_ns_;
  const bool weak = report.num_static < 0.5 * expected || report.num_static < 60;
  const bool behind = report.num_static < o.tracked_ratio * expected;
  const bool due = since_ns >= ToNs(o.max_interval_s) || since_ns >= ToNs(o.min_interval_s) || weak;
  if (!behind || !due) return false;
  if (withheld_ || awaited_.valid()) {  // one at a time: the mapper adjusts each, and is never overrun
    ++counters_.keyframes_withheld;
    return false;
  }
  return true;
}

void FrontendCore::ProposeKeyframe(std::vector<FrontendEvent>* events) {
  KeyframeProposal proposal;
  proposal.id = KeyframeId::Make(session_, frame_.index);
  proposal.map_id = map_id_;
  proposal.stamp_ns = frame_.stamp_ns;
  proposal.reference = last_placed_.reference;
  proposal.T_cam_reference = last_placed_.T_cam_reference;
  proposal.reference_scale = last_placed_.scale;
  proposal.features = frame_.features->set;
  for (size_t i = 0; i < frame_.classes.size(); ++i) {
    const uint16_t feature = static_cast<uint16_t>(i);
    if (frame_.classes[i] == FeatureClass::kUsed && frame_.landmarks[i].valid()) {
      proposal.matches.push_back({feature, frame_.landmarks[i]});
    } else if (frame_.classes[i] == FeatureClass::kMoving) {
      proposal.moving.push_back(feature);
    }
  }
  last_keyframe_ = awaited_ = proposal.id;
  last_keyframe_ns_ = proposal.stamp_ns;
  ++counters_.keyframes_proposed;
  events->push_back(std::move(proposal));
}

void FrontendCore::FlushEvidence(std::vector<FrontendEvent>* events) {
  frames_since_evidence_ = 0;
  FrameEvidence evidence = tracker_.TakeEvidence(frame_.stamp_ns, map_id_);
  if (!evidence.items.empty() && !localize_only_) events->push_back(std::move(evidence));
}

// ---- After the end ----

/// From the placed frame after it, and its motion.
TrackingReport FrontendCore::TrackBackwards(double depth, TrackedFrame* frame) {
  if (!near_.next) return {};
  const std::optional<Rigid3d> predicted = near_.Predict(frame->index);
  tracker_.SetMotionPrior(predicted, depth);
  const Rigid3d guess = predicted.value_or(near_.next->T_cam_world);
  if (!tracker_.TrackFromFrame(map_, *near_.next, guess, frame)) return {};
  TrackingReport report = tracker_.TrackLocalMap(map_, false, frame);
  report.ok = report.ok && near_.Plausible(*frame, depth);
  return report;
}

TrackingReport FrontendCore::LocalizeLater(TrackedFrame* frame) {
  const Keyframe* reference = map_.FindKeyframe(tracker_.reference());
  const double depth = reference != nullptr ? map_.MedianDepth(*reference).value_or(1.0) : 1.0;
  TrackingReport report = TrackBackwards(depth, frame);
  if (report.ok) return report;
  tracker_.DropEvidence();  // a pose that is not believed says nothing of landmarks
  frame->ClearMatches();
  tracker_.SetMotionPrior(std::nullopt, 1.0);
  const uint64_t seed = DeriveSeed(seed_, frame->index, "later");
  if (!relocalizer_.Relocalize(map_, 0, {}, seed, &tracker_, frame)) return {};
  report = tracker_.TrackLocalMap(map_, true, frame);
  report.ok = report.ok && (!near_.next || near_.Plausible(*frame, depth));
  return report;
}

std::optional<Rigid3d> FrontendCore::LaterNeighbours::Predict(uint32_t index) const {
  if (!T_moving_after || next->index != moving || moving - index != 1) return std::nullopt;
  return *T_moving_after * next->T_cam_world;
}

void FrontendCore::LaterNeighbours::MoveTo(TrackedFrame frame) {
  T_moving_after.reset();
  if (next && next->index - frame.index == 1)
    T_moving_after = frame.T_cam_world * next->T_cam_world.Inverse();
  moving = frame.index;
  next = std::move(frame);
}

bool FrontendCore::LaterNeighbours::Plausible(const TrackedFrame& frame, double depth) const {
  const double frames = next->index - frame.index;
  const Rigid3d motion = frame.T_cam_world * next->T_cam_world.Inverse();
  return motion.translation.norm() <= kMaxShiftPerFrame * depth * frames &&
         AngleBetween(motion.rotation, Eigen::Quaterniond::Identity()) <= kMaxTurnPerFrame_rad * frames;
}

bool FrontendCore::GrowBack(std::vector<FrontendEvent>* events) {
  if (!options_.keyframes_at_end || localize_only_) return false;
  grows_back_ = !unplaced_.empty() && !map_.keyframes().empty();
  if (!grows_back_) {
    for (WaitingFrame& frame : not_placed_) unplaced_.push_back(std::move(frame));
    not_placed_.clear();  // they are tried again in the adjusted map
    return false;
  }
  frame_ = TakeNewestUnplaced();
  const TrackingReport report = LocalizeLater(&frame_);
  if (report.ok && map_.FindKeyframe(tracker_.reference()) != nullptr) {
    KeepPlacedLater(report, events);
  } else {
    tracker_.DropEvidence();
    not_placed_.emplace_front(frame_);
  }
  return true;
}

/// Its last pose comes with those of the frames that were tracked.
void FrontendCore::KeepPlacedLater(const TrackingReport& report, std::vector<FrontendEvent>* events) {
  ++counters_.localized_later;
  last_placed_ = *Place(frame_.T_cam_world, tracker_.reference());
  map_id_ = map_.FindKeyframe(last_placed_.reference)->map_id;
  // The way on does not depend on it: what is seen in a corner only would be mapped as wrong as it is placed.
  const bool well_seen = report.num_static >= kWellSeen && report.cells >= kWellSeenCells;
  const bool known = map_.ResolveKeyframe(KeyframeId::Make(session_, frame_.index)).has_value();
  const bool keyframe = well_seen && !known && WantsKeyframe(report);
  if (++frames_since_evidence_ >= options_.evidence_every_frames || keyframe) FlushEvidence(events);
  if (keyframe) ProposeKeyframe(events);
  refiner_.Keep(frame_, MakePose(TrackingState::kLocalizedLater, report));
  near_.MoveTo(frame_);
}

/// Of a frame that was placed in the map. To be smoothed: by what it sees alone, without what was expected of
/// it; nothing is known where that does not agree.
FinalPose FrontendCore::LaterPose(const TrackedFrame& frame) const {
  FinalPose later;
  later.pose.frame_index = frame.index;
  later.pose.stamp_ns = frame.stamp_ns;
  later.pose.state = TrackingState::kLocalizedLater;
  const std::vector<Sight> sights = SightsOf(frame);
  const PoseOptimizationReport report = MeasureCheckedPose(map_, frame.T_cam_world, sights, &later);
  if (!Agrees(report)) {
    later.measured = frame.T_cam_world;
    later.information.setZero();
  }
  later.SetPose(*map_.FindKeyframe(tracker_.reference()),
                options_.smooth_at_end ? later.measured : frame.T_cam_world);
  return later;
}

/// From the newest back: the map lies after them.
TrackedFrame FrontendCore::TakeNewestUnplaced() {
  TrackedFrame frame = std::move(unplaced_.back()).ToTracked(camera_, pyramid_);
  unplaced_.pop_back();
  if (!near_.next || near_.next->index - frame.index > kNearFrames) {
    near_.next.reset();
    const uint32_t after = grows_back_ ? frame.index + 1 : frame.index;
    const auto next = map_.keyframes().lower_bound(KeyframeId::Make(session_, after));
    if (next != map_.keyframes().end()) near_.next = FrameOfKeyframe(next->second);
  }
  return frame;
}

void FrontendCore::LocalizeNextUnplaced() {
  TrackedFrame frame = TakeNewestUnplaced();
  if (!LocalizeLater(&frame).ok || map_.FindKeyframe(tracker_.reference()) == nullptr) return;
  ++counters_.localized_later;
  final_poses_.Add(map_, LaterPose(frame));
  near_.MoveTo(std::move(frame));
}

bool FrontendCore::WorkAtEnd() {
  if (!unplaced_.empty()) {
    LocalizeNextUnplaced();
    return true;
  }
  if (!options_.smooth_at_end || final_poses_.IsSettled()) return false;
  final_poses_.Improve(map_, pump_);
  return true;
}

void FrontendCore::Finish(std::vector<FrontendEvent>* events) {
  while (IsBehind()) CatchUp(events);
  RefineRest();
  while (IsRefining()) RefineNext();
  while (WorkAtEnd()) {
  }
  for (FramePose& pose : final_poses_.Take()) events->push_back(std::move(pose));
  near_ = {};
}

}  // namespace dmslam
