#include "dmslam/map/projection.h"

#include <gtest/gtest.h>

#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

Descriptor WithFlippedBits(Descriptor descriptor, uint32_t count) {
  for (uint32_t i = 0; i < count; ++i) descriptor.words[i / 64] ^= 1ULL << (i % 64);
  return descriptor;
}

/// Features near the middle of the image that differ from a descriptor by up to 120 bits.
class Crowd : public ::testing::Test {
 protected:
  Crowd() {
    Random random(5);
    for (uint64_t& word : descriptor_.words) word = random.Next();
    FeatureSet set;
    for (int i = 0; i < 400; ++i) {
      set.keypoints.push_back({static_cast<uint16_t>(16 * (250 + random.Below(140))),
                               static_cast<uint16_t>(16 * (170 + random.Below(140))),
                               static_cast<uint8_t>(random.Below(4)), 0});
      set.descriptors.push_back(WithFlippedBits(descriptor_, random.Below(120)));
      taken_.push_back(random.Below(5) == 0 ? 1 : 0);
    }
    features_ = MakeFrameFeatures(std::move(set), TestCamera(), Pyramid());
  }

  /// By asking all of them.
  std::optional<FeatureHit> Expected(const Eigen::Vector2d& uv_px, double radius_px) const {
    std::optional<FeatureHit> hit;
    for (size_t i = 0; i < features_->size(); ++i) {
      const int octave = features_->set.keypoints[i].octave;
      if ((features_->uv_px[i] - uv_px).norm() > radius_px || octave < 1 || octave > 2 || taken_[i] != 0)
        continue;
      const int distance = HammingDistance(features_->set.descriptors[i], descriptor_);
      if (!hit || distance < hit->distance) {
        const FeatureHit before = hit.value_or(FeatureHit{0, kNoDistance});
        hit = FeatureHit{static_cast<int>(i), distance, octave, before.distance};
      } else {
        hit->second_distance = std::min(hit->second_distance, distance);
      }
    }
    return hit;
  }

  Descriptor descriptor_;
  std::vector<uint8_t> taken_;
  std::shared_ptr<const FrameFeatures> features_;
};

TEST_F(Crowd, FindFeatureFindsTheTwoNearest) {
  Random random(6);
  int found = 0;
  for (int query = 0; query < 200; ++query) {
    const Eigen::Vector2d uv_px(random.Uniform(240, 400), random.Uniform(160, 320));
    const double radius_px = random.Uniform(2, 60);
    const auto hit = FindFeature(*features_, uv_px, radius_px, 1, 2, descriptor_, taken_);
    const auto expected = Expected(uv_px, radius_px);
    ASSERT_EQ(hit.has_value(), expected.has_value());
    if (!hit) continue;
    ++found;
    EXPECT_EQ(hit->feature, expected->feature);
    EXPECT_EQ(hit->distance, expected->distance);
    EXPECT_EQ(hit->octave, expected->octave);
    EXPECT_EQ(hit->second_distance, expected->second_distance);
    EXPECT_EQ(hit->second_octave.has_value(), hit->second_distance != kNoDistance);
  }
  EXPECT_GT(found, 100);
}

TEST_F(Crowd, WhatIsTooFarToMatterChangesNoDecision) {
  constexpr int kMost = 40;
  constexpr double kRatio = 0.7;
  Random random(7);
  int accepted = 0, ambiguous = 0;
  for (int query = 0; query < 500; ++query) {
    const Eigen::Vector2d uv_px(random.Uniform(240, 400), random.Uniform(160, 320));
    const double radius_px = random.Uniform(2, 30);
    const auto all = FindFeature(*features_, uv_px, radius_px, 1, 2, descriptor_, taken_);
    const auto near =
        FindFeature(*features_, uv_px, radius_px, 1, 2, descriptor_, taken_, FarthestSecond(kMost, kRatio));
    const auto accepts = [](const std::optional<FeatureHit>& hit) {
      return hit && hit->distance <= kMost && hit->distance <= kRatio * hit->second_distance;
    };
    EXPECT_EQ(accepts(near), accepts(all));
    if (accepts(all)) {
      EXPECT_EQ(near->feature, all->feature);
    }
    accepted += accepts(all) ? 1 : 0;
    ambiguous += all && all->distance <= kMost && !accepts(all) ? 1 : 0;
  }
  EXPECT_GT(accepted, 20);
  EXPECT_GT(ambiguous, 20);
}

}  // namespace
}  // namespace dmslam
