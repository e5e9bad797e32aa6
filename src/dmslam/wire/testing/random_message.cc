#include "dmslam/wire/testing/random_message.h"

#include <algorithm>

namespace dmslam::wire::testing {
namespace {

template <typename Enum>
void Draw(Enum& value, Enum first, Enum last, Random& random) {
  const auto low = static_cast<uint32_t>(first);
  value = static_cast<Enum>(low + random.Below(static_cast<uint32_t>(last) - low + 1));
}

void MakeSound(uint32_t& session) { session = std::max(session, 1U); }

/// Numbers and stamps that are zero travel as none.
void MakeSound(std::optional<int64_t>& number) {
  if (number == 0) number.reset();
}

void MakeSound(Camera& camera, Random& random) {
  camera.width_px = 1 + static_cast<int>(random.Below(kMaxImageSidePx));
  camera.height_px = 1 + static_cast<int>(random.Below(kMaxImageSidePx));
  camera.fx_px = random.Uniform(1, 4000);
  camera.fy_px = random.Uniform(1, 4000);
  camera.fps = random.Uniform(1, 200);
  Draw(camera.lens, Lens::kBrown, Lens::kFisheye, random);
  if (camera.lens == Lens::kFisheye) {
    camera.p1 = camera.p2 = 0;
  } else {
    camera.k4 = 0;
  }
}

void MakeSound(std::pmr::vector<float>& list, size_t size, Random& random) {
  list.resize(size);
  for (float& value : list) value = static_cast<float>(random.Uniform(0.01, 10));
}

void MakeSound(FeatureSet& features, Random& random) {
  Filler fill(random.Next(), 0);
  const size_t size = features.keypoints.size();
  const size_t num_depths = random.Below(2) * size;
  MakeSound(features.depths_m, num_depths, random);
  MakeSound(features.depth_sigmas_m, num_depths, random);
  if (num_depths > 0) features.depths_m[0] = features.depth_sigmas_m[0] = -1;
  MakeSound(features.sigmas_px, random.Below(2) * size, random);
  features.descriptors.resize(size);
  for (Descriptor& descriptor : features.descriptors) fill(descriptor);
  for (Keypoint& keypoint : features.keypoints) keypoint.octave %= 32;
}

/// A sound covariance, or none.
void MakeSound(std::vector<double>& covariance, Random& random) {
  covariance.resize(random.Below(2) * kPoseCovarianceSize);
  for (double& value : covariance) value = random.Uniform(0, 1);
}

void MakeSoundCamera(auto& m) { m.camera_id %= 256; }

void MakeSound(RecordGroup& group, Random& random) {
  group = {};
  if (random.Below(2) == 0) return;
  group.id = 1 + random.Below(1000);
  group.count = 2 + random.Below(5);
  group.index = random.Below(group.count);
}

/// An index into a list that is not empty.
uint16_t Index(size_t size, Random& random) {
  return static_cast<uint16_t>(random.Below(static_cast<uint32_t>(size)));
}

template <typename T>
void SortUnique(std::vector<T>& items) {
  std::sort(items.begin(), items.end());
  items.erase(std::unique(items.begin(), items.end()), items.end());
}

}  // namespace

void MakeSound(CameraInfo& m, Random& random) {
  MakeSoundCamera(m);
  MakeSound(m.session);
  MakeSound(m.camera, random);
  MakeSound(m.num_frames);
  Draw(m.mode, PlaybackMode::kRealtime, PlaybackMode::kLockstep, random);
  m.speed = random.Uniform(0, 10);
}

void MakeSound(Frame& m, Random& random) {
  MakeSoundCamera(m);
  MakeSound(m.session);
  Draw(m.encoding, FrameEncoding::kJpeg, FrameEncoding::kBgr8, random);
  m.width_px = 1 + static_cast<int>(random.Below(4));
  m.height_px = 1 + static_cast<int>(random.Below(4));
  if (m.data.empty()) m.data.push_back(0xff);
  const auto pixels = static_cast<size_t>(m.width_px * m.height_px);
  if (m.encoding == FrameEncoding::kGray8) m.data.resize(pixels, 7);
  if (m.encoding == FrameEncoding::kRgb8 || m.encoding == FrameEncoding::kBgr8) m.data.resize(3 * pixels, 7);
}

void MakeSound(EndOfSequence& m, Random&) {
  MakeSoundCamera(m);
  MakeSound(m.session);
}

void MakeSound(GroundTruthPose& m, Random&) {
  MakeSoundCamera(m);
  MakeSound(m.session);
}

void MakeSound(PlayerStatus& m, Random& random) {
  MakeSoundCamera(m);
  MakeSound(m.head.session);
  MakeSound(m.frames_total);
  Draw(m.state, PlayerStatus::State::kStarting, PlayerStatus::State::kDone, random);
}

void MakeSound(SessionStart& m, Random& random) {
  MakeSoundCamera(m);
  MakeSound(m.session);
  MakeSound(m.camera, random);
  Draw(m.mode, PlaybackMode::kRealtime, PlaybackMode::kLockstep, random);
  m.pyramid = {1 + static_cast<int>(random.Below(32)), random.Uniform(1.01, 4)};
}

void MakeSound(KeyframeProposal& m, Random& random) {
  MakeSoundCamera(m);
  MakeSound(m.map_id);
  m.reference_scale = random.Uniform(0.1, 10);
  MakeSound(m.features, random);
  if (m.features.size() == 0) m.matches.clear(), m.moving.clear();
  for (KeyframeProposal::Match& match : m.matches) match.feature = Index(m.features.size(), random);
  for (uint16_t& feature : m.moving) feature = Index(m.features.size(), random);
  SortUnique(m.moving);
}

void MakeSound(InitialMap& m, Random& random) {
  MakeSound(m.map_id);
  MakeSound(m.first, random);
  MakeSound(m.second, random);
  if (m.first.features.size() == 0 || m.second.features.size() == 0) m.points.clear();
  for (InitialMap::Point& point : m.points) {
    point.feature_first = Index(m.first.features.size(), random);
    point.feature_second = Index(m.second.features.size(), random);
  }
  for (InitialMap::View& view : m.between) {
    MakeSound(view.keyframe, random);
    if (m.points.empty() || view.keyframe.features.size() == 0) view.sights.clear();
    for (InitialMap::View::Sight& sight : view.sights)
      sight = {Index(m.points.size(), random), Index(view.keyframe.features.size(), random)};
  }
  uint32_t frame = random.Below(1000);
  const auto number = [&](KeyframeProposal& keyframe) {
    keyframe.id = KeyframeId::Make(m.first.id.session(), ++frame, m.first.camera_id % kMaxCameras);
    keyframe.camera_id = m.first.camera_id;
    keyframe.map_id = m.map_id;
  };
  number(m.first);
  for (InitialMap::View& view : m.between) number(view.keyframe);
  number(m.second);
}

void MakeSound(FramePose& m, Random& random) {
  MakeSoundCamera(m);
  Draw(m.state, TrackingState::kNotInitialized, TrackingState::kMissing, random);
  if (!HasPose(m.state)) m.reference.reset();
  m.reference_scale = random.Uniform(0.1, 10);
  m.moving_image_share = static_cast<float>(random.Uniform());
  MakeSound(m.covariance, random);
  MakeSound(m.step_covariance, random);
  if (m.step_from) *m.step_from %= 1000000;
  if (!m.step_from) m.step_covariance.clear();
}

void MakeSound(FrameEvidence& m, Random&) {
  MakeSoundCamera(m);
  const auto before = [](const auto& a, const auto& b) { return a.landmark < b.landmark; };
  const auto same = [](const auto& a, const auto& b) { return a.landmark == b.landmark; };
  std::sort(m.items.begin(), m.items.end(), before);
  m.items.erase(std::unique(m.items.begin(), m.items.end(), same), m.items.end());
}

void MakeSound(MapReset& m, Random&) {
  MakeSoundCamera(m);
  MakeSound(m.map_id);
}

void MakeSound(AdjustRequest& m, Random&) {
  MakeSoundCamera(m);
  MakeSound(m.request);
}

void MakeSound(TurnRequest& m, Random&) {
  m.camera_id %= kMaxCameras;
  m.frame_index %= kMaxFrames;
}

void MakeSound(FrameDone& m, Random&) {
  MakeSoundCamera(m);
  MakeSound(m.session);
}

void MakeSound(SequenceDone& m, Random&) {
  MakeSoundCamera(m);
  MakeSound(m.session);
}

void MakeSound(Odometry& m, Random& random) {
  MakeSoundCamera(m);
  MakeSound(m.session);
  Draw(m.state, TrackingState::kNotInitialized, TrackingState::kMissing, random);
  m.segment &= 0x7fffffff;
  m.scale_map_odom = random.Uniform(0.1, 10);
  m.depth = random.Uniform(0.1, 10);
  MakeSound(m.step_covariance, random);
  if (!m.step_from) m.step_covariance.clear();
}

void MakeSound(PoseView& m, Random& random) {
  MakeSoundCamera(m);
  MakeSound(m.session);
  Draw(m.state, TrackingState::kNotInitialized, TrackingState::kMissing, random);
  m.moving_share = random.Uniform();
}

void MakeSound(FeatureView& m, Random& random) {
  MakeSoundCamera(m);
  MakeSound(m.session);
  for (FeatureView::Item& item : m.items) {
    Draw(item.kind, FeatureView::Kind::kUnmatched, FeatureView::Kind::kMoving, random);
  }
}

void MakeSound(FrameTrace& m, Random&) {
  MakeSoundCamera(m);
  MakeSound(m.session);
}

void MakeSound(FrontendStatus& m, Random& random) {
  MakeSoundCamera(m);
  Draw(m.state, TrackingState::kNotInitialized, TrackingState::kMissing, random);
}

void MakeSound(MapDelta& m, Random& random) {
  Draw(m.event, MapEvent::kKeyframeInserted, MapEvent::kTurn, random);
  m.progress.camera %= kMaxCameras;
  m.progress.frontend.seq &= (int64_t{1} << 56) - 1;
  if (!m.about) m.about = KeyframeId::Make(1, 7);
  if (!m.map_id) m.map_id = 3;
  if (!m.correction_id) m.correction_id = 5;
  m.request.reset();
  if (m.event == MapEvent::kRequestDone) m.request = 1 + random.Below(9);
  if (m.event == MapEvent::kEnded) m.about.reset(), m.map_id.reset(), m.correction_id.reset();
  MakeSound(m.group, random);
  for (KeyframeState& keyframe : m.keyframes) {
    MakeSoundCamera(keyframe);
    MakeSound(keyframe.map_id);
    keyframe.scale = random.Uniform(0.1, 10);
    std::sort(keyframe.loop_edges.begin(), keyframe.loop_edges.end());
    FeatureSet features = keyframe.features != nullptr ? *keyframe.features : FeatureSet();
    MakeSound(features, random);
    if (keyframe.features != nullptr) keyframe.features = std::make_shared<const FeatureSet>(features);
  }
  for (KeyframePose& pose : m.keyframe_poses) pose.scale = random.Uniform(0.1, 10);
  for (ReferenceMove& move : m.reference_moves) move.after_from_before.scale = random.Uniform(0.1, 10);
  for (LandmarkState& landmark : m.landmarks) {
    MakeSound(landmark.map_id);
    MakeSound(landmark.evidence.last_moved_ns);
  }
  for (LandmarkEvidenceState& state : m.landmark_evidence) MakeSound(state.evidence.last_moved_ns);
  for (KeyframeTombstone& dead : m.keyframe_tombstones) dead.parent_scale = random.Uniform(0.1, 10);
  for (LandmarkTombstone& dead : m.landmark_tombstones) {
    if (random.Below(2) == 0) dead.replaced_by = {};
  }
  for (size_t i = 0; i + 1 < m.observations.size(); ++i) {
    if (random.Below(2) == 0) m.observations[i + 1].keyframe = m.observations[i].keyframe;
    if (random.Below(3) == 0) m.observations[i].landmark = {};
  }
}

void MakeSound(MapperStatus& m, Random& random) {
  Draw(m.state, MapperStatus::State::kStarting, MapperStatus::State::kDone, random);
}

void MakeSound(LoopAnswer& m, Random& random) {
  Draw(m.kind, LoopAnswer::Kind::kNone, LoopAnswer::Kind::kGlobalAdjustment, random);
  const bool corrects = m.kind != LoopAnswer::Kind::kNone;
  m.correction_id = corrects ? std::optional<uint64_t>(1 + random.Below(1000)) : std::nullopt;
  m.matched.reset();
  m.seen_from.reset();
  if (m.kind == LoopAnswer::Kind::kLoop) {
    m.matched = KeyframeId::Make(1, random.Below(1000));
    m.seen_from = KeyframeId::Make(1, 1000 + random.Below(1000));
  }
  MakeSound(m.group, random);
}

void MakeSound(LoopcloserStatus& m, Random& random) {
  Draw(m.state, LoopcloserStatus::State::kStarting, LoopcloserStatus::State::kDone, random);
}

}  // namespace dmslam::wire::testing
