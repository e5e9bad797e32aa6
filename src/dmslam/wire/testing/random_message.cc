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

void MakeSound(Camera& camera, Random& random) {
  camera.width_px = 1 + static_cast<int>(random.Below(4096));
  camera.height_px = 1 + static_cast<int>(random.Below(4096));
  camera.fx_px = random.Uniform(1, 4000);
  camera.fy_px = random.Uniform(1, 4000);
  camera.fps = random.Uniform(1, 200);
}

void MakeSound(FeatureSet& features, Random& random) {
  Filler fill(random.Next(), 0);
  features.descriptors.resize(features.keypoints.size());
  for (Descriptor& descriptor : features.descriptors) fill(descriptor);
  for (Keypoint& keypoint : features.keypoints) keypoint.octave %= 32;
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
  MakeSound(m.session);
  MakeSound(m.camera, random);
  Draw(m.mode, PlaybackMode::kRealtime, PlaybackMode::kLockstep, random);
  m.speed = random.Uniform(0, 10);
}

void MakeSound(Frame& m, Random& random) {
  MakeSound(m.session);
  Draw(m.encoding, FrameEncoding::kJpeg, FrameEncoding::kBgr8, random);
  m.width_px = 1 + static_cast<int>(random.Below(4));
  m.height_px = 1 + static_cast<int>(random.Below(4));
  if (m.data.empty()) m.data.push_back(0xff);
  const auto pixels = static_cast<size_t>(m.width_px * m.height_px);
  if (m.encoding == FrameEncoding::kGray8) m.data.resize(pixels, 7);
  if (m.encoding == FrameEncoding::kRgb8 || m.encoding == FrameEncoding::kBgr8) m.data.resize(3 * pixels, 7);
}

void MakeSound(EndOfSequence& m, Random&) { MakeSound(m.session); }
void MakeSound(GroundTruthPose& m, Random&) { MakeSound(m.session); }

void MakeSound(PlayerStatus& m, Random& random) {
  MakeSound(m.head.session);
  Draw(m.state, PlayerStatus::State::kStarting, PlayerStatus::State::kDone, random);
}

void MakeSound(SessionStart& m, Random& random) {
  MakeSound(m.session);
  MakeSound(m.camera, random);
  Draw(m.mode, PlaybackMode::kRealtime, PlaybackMode::kLockstep, random);
  m.pyramid = {1 + static_cast<int>(random.Below(32)), random.Uniform(1.01, 4)};
}

void MakeSound(KeyframeProposal& m, Random& random) {
  MakeSound(m.map_id);
  if (random.Below(4) == 0) m.reference = {};
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
}

void MakeSound(FramePose& m, Random& random) {
  Draw(m.state, TrackingState::kNotInitialized, TrackingState::kLocalizedLater, random);
  if (random.Below(4) == 0) m.reference = {};
  m.reference_scale = random.Uniform(0.1, 10);
  m.moving_image_share = static_cast<float>(random.Uniform());
}

void MakeSound(FrameEvidence& m, Random& random) {
  const auto before = [](const auto& a, const auto& b) { return a.landmark < b.landmark; };
  const auto same = [](const auto& a, const auto& b) { return a.landmark == b.landmark; };
  std::sort(m.items.begin(), m.items.end(), before);
  m.items.erase(std::unique(m.items.begin(), m.items.end(), same), m.items.end());
  for (FrameEvidence::Item& item : m.items) item.chi2_sum = static_cast<float>(random.Uniform(0, 100));
}

void MakeSound(MapReset& m, Random&) { MakeSound(m.map_id); }
void MakeSound(FrameDone& m, Random&) { MakeSound(m.session); }

void MakeSound(PoseView& m, Random& random) {
  MakeSound(m.session);
  Draw(m.state, TrackingState::kNotInitialized, TrackingState::kLocalizedLater, random);
  m.moving_share = random.Uniform();
}

void MakeSound(FeatureView& m, Random& random) {
  MakeSound(m.session);
  for (FeatureView::Item& item : m.items) {
    Draw(item.kind, FeatureView::Kind::kUnmatched, FeatureView::Kind::kMoving, random);
  }
}

void MakeSound(FrameTrace& m, Random&) { MakeSound(m.session); }

void MakeSound(FrontendStatus& m, Random& random) {
  Draw(m.state, TrackingState::kNotInitialized, TrackingState::kLocalizedLater, random);
}

void MakeSound(MapDelta& m, Random& random) {
  Draw(m.event, MapEvent::kKeyframeInserted, MapEvent::kRefused, random);
  for (KeyframeState& keyframe : m.keyframes) {
    MakeSound(keyframe.map_id);
    keyframe.scale = random.Uniform(0.1, 10);
    std::sort(keyframe.loop_edges.begin(), keyframe.loop_edges.end());
    if (!keyframe.has_features) keyframe.features = {};
    MakeSound(keyframe.features, random);
  }
  for (KeyframePose& pose : m.keyframe_poses) pose.scale = random.Uniform(0.1, 10);
  for (LandmarkState& landmark : m.landmarks) MakeSound(landmark.map_id);
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
  if (random.Below(2) == 0) m.matched = {};
}

void MakeSound(LoopcloserStatus& m, Random& random) {
  Draw(m.state, LoopcloserStatus::State::kStarting, LoopcloserStatus::State::kDone, random);
}

}  // namespace dmslam::wire::testing
