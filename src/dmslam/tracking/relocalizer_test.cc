// A lost camera is found in a replica of the map: there is neither mapper nor loop closer here.
#include "dmslam/tracking/relocalizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/map/replica.h"
#include "dmslam/tracking/tracker.h"
#include "dmslam/tracking/unmapped_points.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int kPoints = 3000, kKeyframes = 30;
constexpr double kStep = 0.35;  // between two keyframes [map units]
constexpr size_t kPoorEvery = 8;
constexpr int kPoorFlips = 32;
constexpr int kChangedFlips = 80;
constexpr size_t kUnchangedEvery = 12;
constexpr double kMoverStep = 0.4;                  // how far the movers have gone when the camera is lost
constexpr int64_t kInterval_ns = 1'000'000'000;     // between two keyframes
constexpr uint32_t kStoodFrom = 11, kStoodTo = 14;  // keyframes that see movers who stood for a while

std::shared_ptr<const Vocabulary> ShippedVocabulary() {
  const char* source = std::getenv("DMSLAM_SOURCE_DIR");
  return std::make_shared<const Vocabulary>(
      LoadOrbVocabulary(std::string(source == nullptr ? "." : source) + "/data/vocabulary.dmv"));
}

Rigid3d PoseAt(double x) { return Rigid3d(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-x, 0.0, 0.0)); }

/// A long wall along which a camera has gone; a share of its points belongs to things that move, of which the
/// map believes so with `belief` (log odds).
class Wall {
 public:
  explicit Wall(double moving_share = 0.0, float belief = 0.0F, bool they_stood = false,
                size_t landmark_every = 1)
      : map_(TestCamera(525, 319.5, 239.5), Pyramid()),
        they_stood_(they_stood),
        landmark_every_(landmark_every) {
    Random random(5);
    for (int i = 0; i < kPoints; ++i) {
      points_.emplace_back(random.Uniform(-2.0, kStep * kKeyframes + 2.0), random.Uniform(-1.2, 1.2),
                           random.Uniform(2.0, 4.0));
      descriptors_.push_back({{random.Next(), random.Next(), random.Next(), random.Next()}});
      moves_.push_back(random.Uniform() < moving_share);
      Landmark landmark;
      landmark.id = LandmarkId::Make(1, static_cast<uint64_t>(i) + 1);
      landmark.map_id = 1;
      landmark.p_world = points_.back();
      landmark.descriptor = descriptors_.back();
      landmark.reference = landmark.first_keyframe = KeyframeId::Make(1, 1);
      if (moves_.back()) landmark.evidence.motion_belief = belief;
      landmarks_.push_back(std::move(landmark));
    }
  }

  /// The map with the keyframes so far, one more with each call.
  MapDelta Next() {
    const auto k = static_cast<uint32_t>(map_.keyframes().size());
    std::vector<size_t> seen;
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, k + 1);
    keyframe.map_id = 1;
    keyframe.stamp_ns = k * kInterval_ns;
    keyframe.T_cam_world = PoseAt(k * kStep);
    if (k > 0) keyframe.parent = KeyframeId::Make(1, k);
    keyframe.features = See(keyframe.T_cam_world, 0.0, k, &seen);
    const KeyframeId id = keyframe.id;
    map_.AddKeyframe(std::move(keyframe));
    const bool there = !they_stood_ || (k >= kStoodFrom && k <= kStoodTo);
    for (size_t feature = 0; feature < seen.size(); ++feature) {
      if ((moves_[seen[feature]] && !there) || seen[feature] % landmark_every_ != 0) continue;
      Landmark& landmark = landmarks_[seen[feature]];
      if (map_.FindLandmark(landmark.id) == nullptr) {
        landmark.reference = landmark.first_keyframe = id;
        map_.AddLandmark(landmark);
      }
      map_.SetObservation(map_.At(id), static_cast<uint16_t>(feature), map_.At(landmark.id));
      map_.UpdateDescriptor(map_.At(landmark.id));
    }
    return map_.TakeDelta(MapEvent::kMapped, id, 1);
  }

  /// What a camera sees after the movers have gone by `moved`.
  TrackedFrame Frame(double x, double moved = 0.0) const {
    return TrackedFrame(1000, 1'000'000'000'000, See(PoseAt(x), moved, 1000, nullptr));
  }
  /// A few of the features at `x`, each with many bits wrong.
  TrackedFrame Poor(double x) const {
    const FeatureSet all = Frame(x).features->set;
    FeatureSet few;
    Random random(11);
    for (size_t i = 0; i < all.size(); i += kPoorEvery) {
      few.keypoints.push_back(all.keypoints[i]);
      few.descriptors.push_back(all.descriptors[i]);
      for (int flips = 0; flips < kPoorFlips; ++flips)
        few.descriptors.back().words[random.Below(4)] ^= uint64_t{1} << random.Below(64);
    }
    return TrackedFrame(1000, 1'000'000'000'000,
                        MakeFrameFeatures(std::move(few), map_.camera(), map_.pyramid()));
  }
  /// The features at `x`, of which most of those that show landmarks have changed too much to be recognised.
  TrackedFrame Changed(double x, bool with_others = true) const {
    std::vector<size_t> seen;
    const FeatureSet all = See(PoseAt(x), 0.0, 1000, &seen)->set;
    FeatureSet features;
    Random random(13);
    for (size_t i = 0; i < seen.size(); ++i) {
      const bool is_landmark = seen[i] % landmark_every_ == 0;
      if (!is_landmark && !with_others) continue;
      features.keypoints.push_back(all.keypoints[i]);
      features.descriptors.push_back(all.descriptors[i]);
      if (!is_landmark || seen[i] % (kUnchangedEvery * landmark_every_) == 0) continue;
      for (int flips = 0; flips < kChangedFlips; ++flips)
        features.descriptors.back().words[random.Below(4)] ^= uint64_t{1} << random.Below(64);
    }
    return TrackedFrame(1000, 1'000'000'000'000,
                        MakeFrameFeatures(std::move(features), map_.camera(), map_.pyramid()));
  }
  double DistanceTo(const Eigen::Vector3d& point) const {
    double least = 1e9;
    for (const Eigen::Vector3d& own : points_) least = std::min(least, (point - own).norm());
    return least;
  }
  /// As many features as at `x`, that look like nothing in the map.
  TrackedFrame Elsewhere(double x) const {
    FeatureSet features = Frame(x).features->set;
    Random random(99);
    for (Descriptor& d : features.descriptors)
      d = {{random.Next(), random.Next(), random.Next(), random.Next()}};
    return TrackedFrame(1000, 1'000'000'000'000,
                        MakeFrameFeatures(std::move(features), map_.camera(), map_.pyramid()));
  }

 private:
  std::shared_ptr<const FrameFeatures> See(const Rigid3d& T_cam_world, double moved, uint64_t seed,
                                           std::vector<size_t>* seen) const {
    Random random(DeriveSeed(3, seed, "view"));
    FeatureSet features;
    for (size_t i = 0; i < points_.size(); ++i) {
      const Eigen::Vector3d shift = moves_[i] ? Eigen::Vector3d(moved, 0, 0) : Eigen::Vector3d::Zero();
      const auto uv = map_.camera().Project(T_cam_world * (points_[i] + shift));
      if (!uv || uv->x() < 1 || uv->y() < 1 || uv->x() > 638 || uv->y() > 478) continue;
      Descriptor descriptor = descriptors_[i];
      for (int flips = 0; flips < 8; ++flips)
        descriptor.words[random.Below(4)] ^= uint64_t{1} << random.Below(64);
      const Eigen::Vector2d noisy = *uv + 0.3 * Eigen::Vector2d(random.Gaussian(), random.Gaussian());
      features.keypoints.push_back({static_cast<uint16_t>(std::lround(noisy.x() * 16)),
                                    static_cast<uint16_t>(std::lround(noisy.y() * 16)), 0, 0});
      features.descriptors.push_back(descriptor);
      if (seen != nullptr) seen->push_back(i);
    }
    return MakeFrameFeatures(std::move(features), map_.camera(), map_.pyramid());
  }

  MapEditor map_;
  bool they_stood_;        ///< the movers, when they were mapped; else they were seen as long as the wall
  size_t landmark_every_;  ///< point is a landmark
  std::vector<Eigen::Vector3d> points_;
  std::vector<Descriptor> descriptors_;
  std::vector<bool> moves_;
  std::vector<Landmark> landmarks_;
};

/// A frontend's side: a replica and what looks for the camera in it.
class Lost {
 public:
  explicit Lost(Wall& wall)
      : replica_(TestCamera(525, 319.5, 239.5), Pyramid()),
        relocalizer_(ShippedVocabulary()),
        search_({}, replica_.camera()) {
    for (int k = 0; k < kKeyframes; ++k) {
      replica_.Apply(wall.Next());
      relocalizer_.Update(replica_);
    }
  }
  bool Find(TrackedFrame* frame,
            std::function<bool(const TrackedFrame&, const TrackingReport&)> credible = {}) {
    return relocalizer_.Relocalize(
        replica_, {.credible = std::move(credible), .seed = 1, .by_unmapped = true}, &search_, frame);
  }
  void Clear() { relocalizer_.Clear(); }

 private:
  Replica replica_;
  Relocalizer relocalizer_;
  PoseSearch search_;
};

TEST(RelocalizerTest, ACameraIsFoundWhereverItReappears) {
  Wall wall;
  Lost lost(wall);
  for (const double x : {0.1, 1.9, 4.4, 7.3, 9.9}) {
    TrackedFrame frame = wall.Frame(x);
    ASSERT_TRUE(lost.Find(&frame)) << "at " << x;
    EXPECT_LT((frame.T_cam_world.Center() - PoseAt(x).Center()).norm(), 0.02) << "at " << x;
  }
}

TEST(RelocalizerTest, APlaceThatWasNeverSeenIsNotFound) {
  Wall wall;
  Lost lost(wall);
  TrackedFrame frame = wall.Elsewhere(4.4);
  EXPECT_FALSE(lost.Find(&frame));
}

TEST(RelocalizerTest, WhatNoKeyframeShowsWellEnoughPlacesShowTogether) {
  Wall wall;
  Lost lost(wall);
  for (const double x : {1.9, 4.4, 7.3}) {
    TrackedFrame frame = wall.Poor(x);
    ASSERT_TRUE(lost.Find(&frame)) << "at " << x;
    EXPECT_LT((frame.T_cam_world.Center() - PoseAt(x).Center()).norm(), 0.03) << "at " << x;
  }
}

TEST(RelocalizerTest, WhereFewLandmarksAreRecognisedOtherPointsFindThePlace) {
  Wall wall(0.0, 0.0F, false, 8);
  Lost lost(wall);
  for (const double x : {1.9, 4.4, 7.3}) {
    TrackedFrame frame = wall.Changed(x);
    ASSERT_TRUE(lost.Find(&frame)) << "at " << x;
    EXPECT_LT((frame.T_cam_world.Center() - PoseAt(x).Center()).norm(), 0.03) << "at " << x;
  }
  TrackedFrame landmarks_only = wall.Changed(4.4, false);
  EXPECT_FALSE(lost.Find(&landmarks_only)) << "too few of them are recognised";
}

TEST(UnmappedPointsTest, LieOnTheWallAndAreKeptOfFewKeyframes) {
  Wall wall(0.0, 0.0F, false, 8);
  Replica replica(TestCamera(525, 319.5, 239.5), Pyramid());
  for (int k = 0; k < kKeyframes; ++k) replica.Apply(wall.Next());
  UnmappedPoints unmapped;
  for (const auto& [id, keyframe] : replica.keyframes()) {
    const std::vector<Landmark>& points = unmapped.Of(replica, keyframe);
    EXPECT_GT(points.size(), 2 * keyframe.seen.size());
    EXPECT_LT(wall.DistanceTo(points.front().p_world), 0.05);
    EXPECT_FALSE(points.front().id.valid());
    EXPECT_LE(unmapped.size(), 16U);
  }
  unmapped.Clear();
  EXPECT_EQ(unmapped.size(), 0U);
}

TEST(RelocalizerTest, LandmarksThatAreBelievedToMoveDoNotVote) {
  Wall wall(0.65, 2.0F);  // most of what is seen has gone on together
  Lost lost(wall);
  TrackedFrame frame = wall.Frame(4.4, kMoverStep);
  ASSERT_TRUE(lost.Find(&frame));
  EXPECT_LT((frame.T_cam_world.Center() - PoseAt(4.4).Center()).norm(), 0.02);

  Wall unknowing(0.65, -2.0F);  // were they believed to stand, they would decide
  Lost misled(unknowing);
  frame = unknowing.Frame(4.4, kMoverStep);
  ASSERT_TRUE(misled.Find(&frame));
  EXPECT_GT((frame.T_cam_world.Center() - PoseAt(4.4).Center()).norm(), kMoverStep / 2);

  Wall crowd(1.0, 2.0F);  // nothing else was ever mapped
  Lost among_them(crowd);
  frame = crowd.Frame(4.4);
  EXPECT_FALSE(among_them.Find(&frame));
}

TEST(RelocalizerTest, PeopleWhoStoodForAWhileDoNotVoteWhereTheRoomIsProven) {
  Wall wall(0.65, -2.0F, true);  // most of what these keyframes show has gone on together
  Lost lost(wall);
  TrackedFrame frame = wall.Frame(4.4, kMoverStep);
  ASSERT_TRUE(lost.Find(&frame));
  EXPECT_LT((frame.T_cam_world.Center() - PoseAt(4.4).Center()).norm(), 0.02);
}

TEST(RelocalizerTest, APlaceThatIsNotCredibleIsRefused) {
  Wall wall;
  Lost lost(wall);
  TrackedFrame frame = wall.Frame(4.4);
  const auto near = [](double x) {
    return [x](const TrackedFrame& found, const TrackingReport&) {
      return (found.T_cam_world.Center() - PoseAt(x).Center()).norm() < 0.6;
    };
  };
  EXPECT_FALSE(lost.Find(&frame, near(0.5)));
  EXPECT_TRUE(lost.Find(&frame, near(4.2)));
}

TEST(RelocalizerTest, AMapThatIsForgottenIsNotSearched) {
  Wall wall;
  Lost lost(wall);
  TrackedFrame frame = wall.Frame(4.4);
  EXPECT_TRUE(lost.Find(&frame));
  lost.Clear();
  EXPECT_FALSE(lost.Find(&frame));
}

TEST(RelocalizerTest, WhoIsLostInOneMapIsLookedForInAll) {
  Wall wall;  // map 1
  Replica replica(TestCamera(525, 319.5, 239.5), Pyramid());
  Tracker tracker({{}, replica.camera(), ShippedVocabulary(), 1});
  for (int k = 0; k < kKeyframes; ++k) {
    replica.Apply(wall.Next());
    tracker.OnMapChanged(replica);
  }
  const int64_t now_ns = kKeyframes * kInterval_ns;
  tracker.BeginLost();
  TrackedFrame frame = wall.Frame(4.4);
  frame.stamp_ns = now_ns + 1'000'000'000;
  const TrackingResult result = tracker.Track(replica, {Tracker::InMap{7}}, std::move(frame));
  ASSERT_TRUE(result.pose) << result.report.reason;
  EXPECT_TRUE(result.relocalized);
  EXPECT_LT((result.frame.T_cam_world.Center() - PoseAt(4.4).Center()).norm(), 0.02);
}

}  // namespace
}  // namespace dmslam
