#include "dmslam/slam/first_map_phase.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "dmslam/motion_segmentation/synthetic_pair.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

/// What a camera that moves sideways sees of a cloud of points, all of it on one level of the pyramid, and as
/// inexact as that level is.
class CoarseView {
 public:
  CoarseView(uint8_t octave, const Pyramid& pyramid) : octave_(octave), pyramid_(pyramid) {
    Random random(5);
    for (int k = 0; k < 600; ++k) {
      const double depth = random.Uniform(2.0, 5.0);
      const double x = random.Uniform(-0.5, 0.5), y = random.Uniform(-0.4, 0.4);
      points_.push_back(depth * Eigen::Vector3d(x, y, 1.0));
      for (uint64_t& word : descriptors_.emplace_back().words) word = random.Next();
    }
  }

  InitializerFrame Frame(uint32_t index) const {
    FeatureSet set;
    Random random(DeriveSeed(3, index, "frame"));
    const double sigma_px = 0.7 * pyramid_.Scale(octave_);
    for (size_t k = 0; k < points_.size(); ++k) {
      const Rigid3d T_cam_world(Eigen::Quaterniond::Identity(), {-0.03 * index, 0, 0});
      const auto uv = camera_.Project(T_cam_world * points_[k]);
      const double dx = sigma_px * random.Gaussian(), dy = sigma_px * random.Gaussian();
      if (!uv || uv->x() + dx < 1 || uv->y() + dy < 1) continue;
      Keypoint keypoint;
      keypoint.x_q4 = static_cast<uint16_t>((uv->x() + dx) * 16);
      keypoint.y_q4 = static_cast<uint16_t>((uv->y() + dy) * 16);
      keypoint.octave = octave_;
      set.keypoints.push_back(keypoint);
      set.descriptors.push_back(descriptors_[k]);
    }
    return {index, int64_t{index} * 33'333'333, MakeFrameFeatures(std::move(set), camera_, pyramid_)};
  }

  bool HasFirstMap(FirstMapMethod method, const Pyramid& pyramid) const {
    const FirstMapSearch search = MakeFirstMapSearch(method, {}, camera_, pyramid, 1);
    for (uint32_t frame = 0; frame < 40; ++frame) {
      if (search(Frame(frame)).result) return true;
    }
    return false;
  }

 private:
  Camera camera_ = SyntheticCamera();
  uint8_t octave_;
  Pyramid pyramid_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Descriptor> descriptors_;
};

TEST(MakeFirstMapSearch, KnowsHowExactTheFeaturesOfEachLevelAre) {
  Pyramid fine, coarse;
  fine.scale_factor = 1.05;
  coarse.levels = 12;
  const CoarseView view(8, coarse);
  EXPECT_TRUE(view.HasFirstMap(FirstMapMethod::kDlrsac, coarse));
  EXPECT_FALSE(view.HasFirstMap(FirstMapMethod::kDlrsac, fine))
      << "it would take them for as exact as those of level 0";
  EXPECT_TRUE(view.HasFirstMap(FirstMapMethod::kTwoFrameRansac, coarse));
}

}  // namespace
}  // namespace dmslam
