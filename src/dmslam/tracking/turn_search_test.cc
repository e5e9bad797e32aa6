// Which way a camera looks that turned too fast to be followed.
#include "dmslam/tracking/turn_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "dmslam/map/testing/map_scene.h"

namespace dmslam {
namespace {

using testing::MapScene;

class Turning : public ::testing::Test {
 protected:
  Turning() {
    scene_.AddCloud(300, {0, 0, 4}, {1.2, 0.9, 0.5});
    scene_.MapAll();
    for (size_t i = 0; i < scene_.size(); ++i) ids_.push_back(MapScene::IdOf(i));
  }

  /// So many bits of each descriptor are blurred.
  std::shared_ptr<const FrameFeatures> See(const Rigid3d& T_cam_world, int blurred_bits,
                                           double twins_px = 0) {
    FeatureSet set = scene_.See(9, 0, T_cam_world).features->set;
    const size_t seen = set.keypoints.size();
    for (size_t i = 0; i < seen; ++i) {
      if (twins_px > 0 && set.keypoints[i].x_q4 > 0) {  // a feature elsewhere that looks more like it
        Keypoint twin = set.keypoints[i];
        const double angle = random_.Uniform(0, 6.28);
        twin.x_q4 =
            static_cast<uint16_t>(std::clamp(twin.x_q4 + 16 * twins_px * std::cos(angle), 0.0, 16 * 639.0));
        twin.y_q4 =
            static_cast<uint16_t>(std::clamp(twin.y_q4 + 16 * twins_px * std::sin(angle), 0.0, 16 * 479.0));
        set.keypoints.push_back(twin);
        set.descriptors.push_back(set.descriptors[i]);
      }
      for (int b = 0; b < blurred_bits; ++b) {
        const auto bit = static_cast<size_t>(random_.Uniform(0, 255.9));
        set.descriptors[i].words[bit / 64] ^= uint64_t{1} << (bit % 64);
      }
    }
    return MakeFrameFeatures(std::move(set), scene_.map().camera(), scene_.map().pyramid());
  }
  std::optional<Rigid3d> Find(const std::shared_ptr<const FrameFeatures>& features, double reach_rad = 0.3) {
    return turns_.Find(scene_.map(), votes_, ids_, Rigid3d(), reach_rad, *features);
  }

  /// The roll is found to a step.
  void ExpectTurned(const std::optional<Rigid3d>& found) const {
    ASSERT_TRUE(found);
    EXPECT_LT(AngleBetween(found->rotation, turned_.rotation), 0.06);
    const Eigen::Vector3d axis(0, 0, 1);
    const Eigen::Vector3d looks = found->rotation.conjugate() * axis,
                          should = turned_.rotation.conjugate() * axis;
    EXPECT_LT((looks - should).norm(), 0.02);
  }

  const Rigid3d turned_{ExpSo3({0.04, 0.13, 0.05}), Eigen::Vector3d(0.02, 0, 0)};
  MapScene scene_;
  Random random_{4};
  std::vector<LandmarkId> ids_;
  LandmarkVotes votes_{{}};
  TurnSearch turns_;
};

TEST_F(Turning, IsFoundInABlurredPicture) { ExpectTurned(Find(See(turned_, 70))); }

TEST_F(Turning, WhatLooksMoreAlikeElsewhereDoesNotMatter) { ExpectTurned(Find(See(turned_, 70, 60.0))); }

TEST_F(Turning, NothingIsFoundWhereNothingIsAlike) { EXPECT_FALSE(Find(See(turned_, 250))); }

TEST_F(Turning, NotFartherThanItCanHaveTurned) {
  const auto found = Find(See(turned_, 0), 0.05);
  EXPECT_TRUE(!found || AngleBetween(found->rotation, turned_.rotation) > 0.05);
}

}  // namespace
}  // namespace dmslam
