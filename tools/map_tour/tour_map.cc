#include "tour_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dmslam/mapping/correction.h"

namespace dmslam {
namespace {

constexpr double kAisleLength = 48, kAisleDistance = 5;  // [m]
constexpr int kAisles = 7;
constexpr double kEyeHeight = 1.5, kRoof = 2.6;  // above the floor, above the eye [m]
constexpr size_t kSeenAgain = 110;               // landmarks of the keyframes before that a keyframe sees
constexpr size_t kRecent = 480;                  // landmarks that can be seen again
constexpr int64_t kStepNs = 100'000'000;
constexpr uint32_t kFramesPerKeyframe = 3;
constexpr uint64_t kPersonEvery = 90;  // keyframes between people

/// 0..1, the same for the same place: how full a shelf is there.
double Fullness(double along, double across, int level) {
  const auto cell = static_cast<uint64_t>(std::llround(along / 0.8) * 1000 + std::llround(across));
  return static_cast<double>(Mix64(cell * 8 + static_cast<uint64_t>(level)) >> 40) * 0x1.0p-24;
}

}  // namespace

Camera TourMap::TourCamera() {
  Camera camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 500;
  camera.cx_px = 319.5;
  camera.cy_px = 239.5;
  return camera;
}

TourMap::TourMap(const TourOptions& options, uint32_t session)
    : options_(options),
      session_(session),
      random_(DeriveSeed(options.seed, 0, "map tour")),
      map_(TourCamera(), Pyramid()) {
  const auto add = [this](double x, double z) {
    const Eigen::Vector2d at(x, z);
    way_.push_back({at, way_.empty() ? 0 : way_.back().walked + (at - way_.back().at).norm()});
  };
  for (int aisle = 0; aisle < kAisles; ++aisle) {
    add(aisle % 2 == 0 ? 0 : kAisleLength, aisle * kAisleDistance);
    add(aisle % 2 == 0 ? kAisleLength : 0, aisle * kAisleDistance);
  }
  add(kAisleLength + 4, (kAisles - 1) * kAisleDistance);
  add(kAisleLength + 4, -4);
  add(-2, -4);
  add(0, 0);
  add(6, 0);
}

Eigen::Vector2d TourMap::PlaceAt(double walked) const {
  walked = std::clamp(walked, 0.0, way_.back().walked);
  size_t i = 1;
  while (i + 1 < way_.size() && way_[i].walked < walked) ++i;
  const Corner &from = way_[i - 1], &to = way_[i];
  return from.at + (to.at - from.at) * ((walked - from.walked) / (to.walked - from.walked));
}

/// Corners are cut: a mean over two metres of the way.
Rigid3d TourMap::PoseAt(double walked) const {
  const auto smooth = [this](double at) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (int i = -4; i <= 4; ++i) sum += PlaceAt(at + 0.25 * i);
    return Eigen::Vector2d(sum / 9);
  };
  const Eigen::Vector2d here = smooth(walked), ahead = smooth(walked + 0.8) - smooth(walked - 0.8);
  const double yaw = std::atan2(ahead.x(), ahead.y()) + 0.25 * std::sin(walked * 0.7);
  const Eigen::Vector3d center(here.x(), 0.04 * std::sin(walked * 2.3), here.y());
  const Eigen::Quaterniond world_from_cam(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()));
  return Rigid3d(world_from_cam, center).Inverse();
}

Descriptor TourMap::MakeDescriptor() {
  return {{random_.Next(), random_.Next(), random_.Next(), random_.Next()}};
}

/// On a shelf, the floor or the roof some metres ahead; now and then on somebody who walks there.
Landmark TourMap::MakeLandmark(const Keyframe& keyframe) {
  static constexpr std::array<double, 5> kLevels = {1.1, 0.55, 0.0, -0.55, -1.1};
  const Rigid3d T_world_cam = keyframe.T_cam_world.Inverse();
  Landmark landmark;
  landmark.id = LandmarkId::Make(1, ++landmarks_made_);
  landmark.map_id = 1;
  landmark.reference = landmark.first_keyframe = keyframe.id;
  landmark.first_ns = keyframe.stamp_ns;
  landmark.descriptor = MakeDescriptor();
  landmark.evidence.visible = landmark.evidence.found = 5 + random_.Below(40);
  landmark.evidence.motion_belief = static_cast<float>(random_.Uniform(-3, -0.6));
  const double kind = random_.Uniform();
  const bool person = next_ % kPersonEvery < 6 && kind < 0.3;
  Eigen::Vector3d p;
  if (person) {
    p = {0.6 + 0.18 * random_.Gaussian(), random_.Uniform(-0.2, 1.4), 3 + 0.15 * random_.Gaussian()};
    landmark.evidence.motion_belief = static_cast<float>(random_.Uniform(0.3, 4));
    landmark.evidence.moved = 8;
  } else if (kind < 0.8) {
    const double side = random_.Uniform() < 0.5 ? -1 : 1, along = random_.Uniform(0.8, 5);
    const int level = static_cast<int>(random_.Below(5));
    const Eigen::Vector3d at = T_world_cam * Eigen::Vector3d(2 * side, 0, along);
    const double height = 0.5 * Fullness(at.x(), at.z(), level);
    p = {side * (1.7 + 0.05 * random_.Gaussian()),
         kLevels[static_cast<size_t>(level)] - height * random_.Uniform(), along};
  } else if (kind < 0.93) {
    p = {random_.Uniform(-1.7, 1.7), kEyeHeight + 0.01 * random_.Gaussian(), random_.Uniform(1.2, 6)};
  } else {
    p = {0.5 * std::round(random_.Uniform(-4, 4)), -kRoof + 0.02 * random_.Gaussian(), random_.Uniform(2, 7)};
  }
  landmark.p_world = T_world_cam * p;
  return landmark;
}

MapDelta TourMap::Correct(const LoopAnswer& answer) {
  ApplyCorrection(map_, answer, {});
  const bool loop = answer.kind == LoopAnswer::Kind::kLoop;
  MapDelta change =
      map_.TakeDelta(loop ? MapEvent::kCorrected : MapEvent::kGloballyAdjusted, answer.keyframe, 1);
  change.correction_id = answer.correction_id;
  return change;
}

MapDelta TourMap::Step() {
  const double step = way_.back().walked / static_cast<double>(std::max<size_t>(1, options_.keyframes - 1));
  const size_t wanted = options_.landmarks * (next_ + 1) / options_.keyframes - landmarks_made_;
  const size_t again = std::min(kSeenAgain, recent_.size());
  FeatureSet features;
  for (size_t i = 0; i < std::max(wanted + again, options_.features); ++i) {
    features.keypoints.push_back(
        {static_cast<uint16_t>(random_.Below(639 * 16)), static_cast<uint16_t>(random_.Below(479 * 16)),
         static_cast<uint8_t>(random_.Below(8)), static_cast<uint8_t>(random_.Below(256))});
    features.descriptors.push_back(MakeDescriptor());
  }
  Keyframe keyframe;
  keyframe.id = KeyframeId::Make(session_, static_cast<uint32_t>(next_) * kFramesPerKeyframe);
  keyframe.map_id = 1;
  keyframe.stamp_ns = 1'000'000'000 + static_cast<int64_t>(next_) * kStepNs;
  keyframe.T_cam_world = PoseAt(step * static_cast<double>(next_));
  if (!map_.keyframes().empty()) keyframe.parent = map_.keyframes().rbegin()->first;
  keyframe.features = MakeFrameFeatures(std::move(features), map_.camera(), map_.pyramid());
  const Keyframe& added = map_.AddKeyframe(keyframe);
  size_t feature = 0;
  const auto see = [&](const Landmark& landmark) {
    map_.SetObservation(added, static_cast<uint16_t>(feature++), landmark);
  };
  for (size_t i = 0; i < again; ++i)
    see(map_.At(recent_[random_.Below(static_cast<uint32_t>(recent_.size()))]));
  for (size_t i = 0; i < wanted; ++i) {
    const Landmark& landmark = map_.AddLandmark(MakeLandmark(keyframe));
    recent_.push_back(landmark.id);
    see(landmark);
  }
  if (recent_.size() > kRecent) recent_.erase(recent_.begin(), recent_.end() - kRecent);
  ++next_;
  if (done()) map_.AddLoopEdge(map_.keyframes().begin()->second, added);
  MapDelta change = map_.TakeDelta(next_ == 1 ? MapEvent::kMapStarted
                                   : done()   ? MapEvent::kCorrected
                                              : MapEvent::kMapped,
                                   keyframe.id, 1);
  if (done()) change.correction_id = keyframe.id.value;
  return change;
}

}  // namespace dmslam
