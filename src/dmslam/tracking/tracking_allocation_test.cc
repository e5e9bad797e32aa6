// Tracking runs in every frame: once its buffers have grown, it must not touch the heap.
#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/features/testing/allocation_counter.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/tracking/pose_search.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr uint32_t kLandmarks = 400, kKeyframes = 6;
constexpr int64_t kStepNs = 100'000'000;

/// Keyframes side by side that all see the same landmarks, and frames between them; a tenth of what a frame
/// sees has moved.
class Tracking : public ::testing::Test {
 protected:
  Tracking() : map_(TestCamera(), Pyramid()), search_({}, TestCamera()) {
    Random random(3);
    for (uint32_t i = 0; i < kLandmarks; ++i) {
      points_.emplace_back(random.Uniform(-1, 1), random.Uniform(-0.7, 0.7), random.Uniform(2, 4));
      descriptors_.push_back({{random.Next(), random.Next(), random.Next(), random.Next()}});
    }
    for (uint32_t k = 0; k < kKeyframes; ++k) AddKeyframe(k);
    for (uint32_t i = 0; i < kLandmarks; ++i) AddLandmark(i);
  }

  static Rigid3d PoseAt(double place) {
    return Rigid3d(Eigen::Quaterniond::Identity(), Eigen::Vector3d(-0.05 * place, 0.01 * place, 0));
  }

  TrackedFrame Seen(uint32_t index, double place, bool some_moved) const {
    FeatureSet features;
    for (uint32_t i = 0; i < kLandmarks; ++i) {
      Eigen::Vector2d uv_px = *map_.camera().Project(PoseAt(place) * points_[i]);
      if (some_moved && i % 10 == 0) uv_px.x() += 12;
      features.keypoints.push_back({static_cast<uint16_t>(std::lround(16 * uv_px.x())),
                                    static_cast<uint16_t>(std::lround(16 * uv_px.y())), 0, 0});
      features.descriptors.push_back(descriptors_[i]);
    }
    return TrackedFrame(index, kKeyframes * kStepNs + index * kStepNs,
                        MakeFrameFeatures(std::move(features), map_.camera(), map_.pyramid()));
  }

  void AddKeyframe(uint32_t k) {
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, k);
    keyframe.map_id = 1;
    keyframe.stamp_ns = k * kStepNs;
    keyframe.T_cam_world = PoseAt(k);
    keyframe.features = Seen(k, k, false).features;
    map_.AddKeyframe(std::move(keyframe));
  }

  void AddLandmark(uint32_t i) {
    Landmark landmark;
    landmark.id = LandmarkId::Make(1, i + 1);
    landmark.map_id = 1;
    landmark.p_world = points_[i];
    landmark.descriptor = descriptors_[i];
    landmark.reference = landmark.first_keyframe = KeyframeId::Make(1, 0);
    map_.AddLandmark(landmark);
    for (uint32_t k = 0; k < kKeyframes; ++k) {
      map_.SetObservation(map_.At(KeyframeId::Make(1, k)), static_cast<uint16_t>(i), map_.At(landmark.id));
    }
  }

  /// Tracks both frames in turn, each from the other, and returns how often memory was asked for.
  size_t TrackBoth(TrackedFrame* a, TrackedFrame* b) {
    const size_t before = testing::NumAllocations();
    for (int round = 0; round < 4; ++round) {
      EXPECT_EQ(search_.FromFrame(map_, *a, a->T_cam_world, {}, b), PoseSearch::FromFrameResult::kFound);
      const TrackingReport report = search_.InLocalMap(map_, false, {}, b);
      EXPECT_TRUE(report.HasPose()) << report.reason;
      EXPECT_GT(report.num_static, 250);
      EXPECT_GT(report.num_moving, 10);
      std::swap(a, b);
    }
    return testing::NumAllocations() - before;
  }

  MapEditor map_;
  PoseSearch search_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Descriptor> descriptors_;
};

TEST_F(Tracking, SteadyStateDoesNotAllocate) {
  TrackedFrame first = Seen(1, 2.3, false), second = Seen(2, 2.5, true);
  first.T_cam_world = PoseAt(2.3);
  for (uint32_t i = 0; i < kLandmarks; ++i) first.landmarks[i] = LandmarkId::Make(1, i + 1);
  EXPECT_EQ(search_.FromFrame(map_, first, first.T_cam_world, {}, &second),
            PoseSearch::FromFrameResult::kFound);
  EXPECT_TRUE(search_.InLocalMap(map_, false, {}, &second).HasPose());
  TrackedFrame third = Seen(3, 2.7, true);
  EXPECT_GT(TrackBoth(&second, &third), 0u);  // The counter works.
  EXPECT_EQ(TrackBoth(&second, &third), 0u);
  search_.judge().TakeEvidence(0, 1);  // what was counted is handed over, and is counted anew
  EXPECT_EQ(TrackBoth(&second, &third), 0u);
}

}  // namespace
}  // namespace dmslam
