#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/map/proposals.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/util/random.h"

namespace dmslam::testing {

inline constexpr int kKeyframes = 120;  // one and a quarter rounds
inline constexpr int kPerRound = 96;
inline constexpr int kPoints = 1600;  // on a cylinder around the path
inline constexpr double kPathRadius = 2.0, kWallRadius = 5.0;
inline constexpr double kDriftPerKeyframe = 0.002;    // of the scale, and of the position
inline constexpr int64_t kInterval_ns = 650'000'000;  // between two keyframes
inline constexpr int kPersonPoints = 500;
inline constexpr int kPersonStands = 6;  // keyframes, 3.9 s

inline std::shared_ptr<const Vocabulary> ShippedVocabulary() {
  const char* source = std::getenv("DMSLAM_SOURCE_DIR");
  return std::make_shared<const Vocabulary>(
      LoadOrbVocabulary(std::string(source == nullptr ? "." : source) + "/data/vocabulary.dmv"));
}

inline Descriptor RandomDescriptor(Random& random) {
  return {{random.Next(), random.Next(), random.Next(), random.Next()}};
}

/// Looks outwards from a circle, upright.
inline Rigid3d TruePose(int k) {
  const double angle = 2 * std::numbers::pi * k / kPerRound;
  Eigen::Matrix3d R_world_cam;  // columns: right, down, forward
  R_world_cam.col(2) = Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
  R_world_cam.col(1) = Eigen::Vector3d(0, 0, -1);
  R_world_cam.col(0) = R_world_cam.col(1).cross(R_world_cam.col(2));
  const Eigen::Vector3d center = kPathRadius * R_world_cam.col(2);
  return Rigid3d(Eigen::Quaterniond(R_world_cam), center).Inverse();
}

/// What a keyframe and the landmarks made in it believe of the world: it grows and slides as the camera goes
/// on.
inline Sim3d Drift(int k) {
  return Sim3d(Eigen::Quaterniond::Identity(), k * kDriftPerKeyframe * Eigen::Vector3d(1, 0.5, 0),
               1.0 + k * kDriftPerKeyframe / 4);
}

struct WorldOptions {
  int points = kPoints;                 ///< on the walls
  bool second_visit_elsewhere = false;  ///< after one round the camera sees another wall...
  double picture_rad = 0;               ///< a patch of the wall, so wide, hangs on the other side, too
  bool first_wall_moves = false;        ///< its landmarks are believed to move
  size_t landmark_every = 1;            ///< in the second round only every so many features get a landmark
  size_t fused_every = 0;               ///< every so many points are known again in the second round; 0: none
  /// Keyframes before which somebody stands, near enough to hide most of the wall; he stands for
  /// kPersonStands keyframes each, and looks the same.
  std::vector<int> person_at = {};
  double person_half_width_rad = 0.45;  ///< how much he hides, and half of his height
  int second_map_at = 1'000'000;        ///< from this keyframe on the camera is in a map of its own
};

/// What the second map believes of the world: it lies turned, elsewhere, and is half as large.
inline Sim3d SecondWorld() {
  return Sim3d(ExpSo3(Eigen::Vector3d(0.2, -0.4, 1.0)), Eigen::Vector3d(3, 1, -2), 0.5);
}

/// A camera that goes around a room; landmarks of the second round are not known to be those of the first.
class Room {
 public:
  explicit Room(const WorldOptions& options)
      : options_(options), map_(TestCamera(525, 319.5, 239.5), Pyramid()) {
    Random random(7);
    for (int i = 0; i < options.points; ++i) {
      const double angle = random.Uniform(0, 2 * std::numbers::pi);
      const double radius = kWallRadius + random.Uniform(-0.6, 0.6);
      points_.push_back({radius * std::cos(angle), radius * std::sin(angle), random.Uniform(-2.0, 2.0)});
      first_.push_back(RandomDescriptor(random));
      second_.push_back(RandomDescriptor(random));
      if (!options.second_visit_elsewhere) second_.back() = first_.back();
      if (angle >= options.picture_rad) continue;
      points_.push_back({-points_.back().x(), -points_.back().y(), points_.back().z()});
      first_.push_back(first_.back());
      second_.push_back(second_.back());
    }
    walls_ = points_.size();
    AddPerson(random);
  }

  /// The next keyframe with what it sees, as a delta.
  MapDelta Next() {
    const int k = next_++;
    const KeyframeId id = IdOf(k);
    Random random(DeriveSeed(3, static_cast<uint64_t>(k), "keyframe"));
    const Rigid3d T_cam_true = TruePose(k);
    FeatureSet features;
    std::vector<size_t> seen;
    for (size_t i = 0; i < points_.size(); ++i) {
      const auto uv = map_.camera().Project(T_cam_true * points_[i]);
      if (!uv || uv->x() < 1 || uv->y() < 1 || uv->x() > 638 || uv->y() > 478) continue;
      if (IsHidden(i, k, *uv)) continue;
      Descriptor descriptor = DescriptorOf(i, k);
      for (int flips = 0; flips < 8; ++flips)
        descriptor.words[random.Below(4)] ^= uint64_t{1} << random.Below(64);
      const Eigen::Vector2d noisy = *uv + 0.3 * Eigen::Vector2d(random.Gaussian(), random.Gaussian());
      features.keypoints.push_back({static_cast<uint16_t>(std::lround(noisy.x() * 16)),
                                    static_cast<uint16_t>(std::lround(noisy.y() * 16)), 1, 0});
      features.descriptors.push_back(descriptor);
      seen.push_back(i);
    }
    AddKeyframe(k, id, std::move(features));
    const size_t step = Round(k) == 0 ? 1 : options_.landmark_every;
    for (size_t feature = 0; feature < seen.size(); feature += step) {
      const LandmarkId landmark = LandmarkFor(seen[feature], k, id);
      map_.SetObservation(map_.At(id), static_cast<uint16_t>(feature), map_.At(landmark));
      map_.UpdateDescriptor(map_.At(landmark));
    }
    return map_.TakeDelta(MapEvent::kMapped, id, MapOf(k));
  }

  /// The mapper's word on a correction. It stays where it is: these tests look at answers alone.
  MapDelta SayOf(const LoopAnswer& answer, MapEvent event) {
    MapDelta delta = map_.TakeDelta(event, answer.keyframe, 1);
    delta.correction_id = answer.correction_id;
    return delta;
  }

  const Map& map() const { return map_; }

  static KeyframeId IdOf(int k) { return KeyframeId::Make(1, static_cast<uint32_t>(k + 1)); }
  /// Camera of keyframe `a` from camera of keyframe `b`, each in the unit that its map has there.
  Sim3d TrueSimilarity(int a, int b) const { return InItsUnit(a) * InItsUnit(b).Inverse(); }

 private:
  int Round(int k) const { return k / kPerRound; }
  MapId MapOf(int k) const { return k < options_.second_map_at ? 1 : 2; }
  Sim3d Believed(int k) const { return MapOf(k) == 1 ? Drift(k) : SecondWorld(); }
  Sim3d InItsUnit(int k) const {
    const Sim3d unit(Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero(), Believed(k).scale);
    return unit * Sim3d(TruePose(k));
  }
  const Descriptor& DescriptorOf(size_t point, int k) const {
    return Round(k) == 0 ? first_[point] : second_[point];
  }

  /// A slab, rigid, that fills most of the image of the keyframe before which it stands.
  void AddPerson(Random& random) {
    std::vector<Eigen::Vector3d> body;
    std::vector<Descriptor> looks;
    for (int i = 0; i < kPersonPoints; ++i) {
      const double half = options_.person_half_width_rad;
      body.push_back({random.Uniform(-half, half), random.Uniform(-half, half), random.Uniform(0.9, 1.1)});
      looks.push_back(RandomDescriptor(random));
    }
    for (const int at : options_.person_at) {
      const Rigid3d T_world_cam = TruePose(at).Inverse();
      for (const Eigen::Vector3d& p_cam : body) points_.push_back(T_world_cam * p_cam);
      first_.insert(first_.end(), looks.begin(), looks.end());
      second_.insert(second_.end(), looks.begin(), looks.end());
    }
  }
  /// Before which keyframe somebody stands while keyframe `k` looks; -1: nobody does.
  int PersonBefore(int k) const {
    for (const int at : options_.person_at) {
      if (k >= at - kPersonStands / 2 && k < at + kPersonStands / 2) return at;
    }
    return -1;
  }
  bool IsHidden(size_t point, int k, const Eigen::Vector2d& uv_px) const {
    const int at = PersonBefore(k);
    if (point >= walls_) return at < 0 || options_.person_at[(point - walls_) / kPersonPoints] != at;
    if (at < 0) return false;
    const auto middle =
        map_.camera().Project(TruePose(k) * (TruePose(at).Inverse() * Eigen::Vector3d(0, 0, 1)));
    const double half_px = 533 * options_.person_half_width_rad;
    return middle && std::abs(uv_px.x() - middle->x()) < half_px &&
           std::abs(uv_px.y() - middle->y()) < half_px;
  }

  void AddKeyframe(int k, KeyframeId id, FeatureSet features) {
    Keyframe keyframe;
    keyframe.id = id;
    keyframe.map_id = MapOf(k);
    keyframe.stamp_ns = k * kInterval_ns;
    keyframe.T_cam_world = (Sim3d(TruePose(k)) * Believed(k).Inverse()).ToRigid();
    if (k > 0 && k != options_.second_map_at) keyframe.parent = IdOf(k - 1);
    keyframe.features = MakeFrameFeatures(std::move(features), map_.camera(), map_.pyramid());
    map_.AddKeyframe(std::move(keyframe));
  }

  LandmarkId LandmarkFor(size_t point, int k, KeyframeId id) {
    // Seen again in the second round it is another landmark; so are those that the first round's end sees of
    // its start.
    const bool fused = options_.fused_every > 0 && point % options_.fused_every == 0;
    const int era = MapOf(k) == 1 ? Era(point, k) : 1000;
    const auto [known, is_new] = landmarks_.try_emplace({point, fused ? 0 : era});
    if (!is_new) return known->second;
    Landmark landmark;
    landmark.id = known->second = LandmarkId::Make(1, ++last_landmark_);
    landmark.map_id = MapOf(k);
    landmark.p_world = Believed(k) * points_[point];
    landmark.reference = landmark.first_keyframe = id;
    if (options_.first_wall_moves && Round(k) == 0) landmark.evidence.motion_belief = 2.0F;
    map_.AddLandmark(landmark);
    return landmark.id;
  }
  int Era(size_t point, int k) {
    const auto last = last_seen_.find(point);
    if (last != last_seen_.end() && k - last->second > kPerRound / 2) ++era_[point];
    last_seen_[point] = k;
    return era_[point];
  }

  WorldOptions options_;
  MapEditor map_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Descriptor> first_, second_;
  size_t walls_ = 0;  ///< points of the walls; those of people follow
  std::map<std::pair<size_t, int>, LandmarkId> landmarks_;
  std::map<size_t, int> last_seen_, era_;
  uint64_t last_landmark_ = 0;
  int next_ = 0;
};

}  // namespace dmslam::testing
