// A fisheye lens bends as OpenCV's cv::fisheye does, whose calibrations are used.

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

struct Parameter {
  const char* name;
  double focal_px;
  cv::Vec4d k;
};

class FisheyeAndOpenCv : public testing::TestWithParam<Parameter> {
 protected:
  FisheyeAndOpenCv() : random_(1) {
    const Parameter& p = GetParam();
    camera_.width_px = camera_.height_px = 512;
    camera_.fx_px = p.focal_px;
    camera_.fy_px = 0.99 * p.focal_px;
    camera_.cx_px = 254.9;
    camera_.cy_px = 256.9;
    camera_.lens = Lens::kFisheye;
    camera_.k1 = p.k[0], camera_.k2 = p.k[1], camera_.k3 = p.k[2], camera_.k4 = p.k[3];
  }
  cv::Matx33d K() const {
    return {camera_.fx_px, 0, camera_.cx_px, 0, camera_.fy_px, camera_.cy_px, 0, 0, 1};
  }

  Camera camera_;
  Random random_;
};

TEST_P(FisheyeAndOpenCv, ProjectAlike) {
  ASSERT_FALSE(camera_.Problem()) << *camera_.Problem();
  std::vector<cv::Point3d> points;
  for (int i = 0; i < 500; ++i) points.emplace_back(random_.Uniform(-4, 4), random_.Uniform(-4, 4), 1.5);
  std::vector<cv::Point2d> expected;
  cv::fisheye::projectPoints(points, expected, cv::Vec3d(), cv::Vec3d(), K(), GetParam().k);
  for (size_t i = 0; i < points.size(); ++i) {
    const auto ideal = camera_.Project({points[i].x, points[i].y, points[i].z});
    ASSERT_TRUE(ideal.has_value());
    const Eigen::Vector2d raw = camera_.Distort(*ideal);
    EXPECT_NEAR(raw.x(), expected[i].x, 1e-9);
    EXPECT_NEAR(raw.y(), expected[i].y, 1e-9);
  }
}

TEST_P(FisheyeAndOpenCv, UnprojectAlike) {
  std::vector<cv::Point2d> raw, expected;
  for (int i = 0; i < 500; ++i) {
    const double angle = random_.Uniform(0, 6.28), radius_px = random_.Uniform(0, 1.3 * camera_.fy_px);
    raw.emplace_back(camera_.cx_px + radius_px * std::cos(angle),
                     camera_.cy_px + radius_px * std::sin(angle));
  }
  const cv::TermCriteria exact(cv::TermCriteria::MAX_ITER + cv::TermCriteria::EPS, 100, 1e-14);
  cv::fisheye::undistortPoints(raw, expected, K(), GetParam().k, cv::noArray(), cv::noArray(), exact);
  for (size_t i = 0; i < raw.size(); ++i) {
    const auto ideal = camera_.Undistort({raw[i].x, raw[i].y});
    ASSERT_TRUE(ideal.has_value()) << raw[i];
    const Eigen::Vector3d ray = camera_.Ray(*ideal);
    EXPECT_NEAR(ray.x(), expected[i].x, 1e-8);
    EXPECT_NEAR(ray.y(), expected[i].y, 1e-8);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Lenses, FisheyeAndOpenCv,
    testing::Values(Parameter{"HeadMounted", 191, {0.0034823894, 0.0007150348, -0.0020532361, 0.00020293673}},
                    Parameter{"Equidistant", 285, {0, 0, 0, 0}},
                    Parameter{"ActionCamera", 240, {-0.012, 0.031, -0.018, 0.003}}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace dmslam
