#include "dmslam/camera/camera.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "dmslam/camera/image_scale.h"
#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

Camera Freiburg1() {
  return Camera{640,      480,       517.306408, 516.469215, 318.643040, 255.313989,
                0.262383, -0.953104, -0.005358,  0.002628,   1.163314,   30.0};
}

TEST(Camera, UndistortIsInverseOfDistort) {
  const Camera camera = Freiburg1();
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector2d raw(random.Uniform(0, 639), random.Uniform(0, 479));
    const auto ideal = camera.Undistort(raw);
    ASSERT_TRUE(ideal.has_value()) << raw.transpose();
    EXPECT_NEAR((camera.Distort(*ideal) - raw).norm(), 0.0, 1e-5);
  }
}

TEST(ImageScale, SearchesNoNearerThanKeypointsScatterInTheImageOrTheImageEnlarged) {
  Camera camera = Freiburg1();
  EXPECT_EQ(SearchRadiusPx(camera, 1e-3), 2.5);
  EXPECT_EQ(SearchRadiusPx(camera, 0.02), 0.02 * FocalPx(camera));
  camera.width_px = 320;
  camera.height_px = 240;
  EXPECT_EQ(SearchRadiusPx(camera, 1e-3), 1.25);
  EXPECT_EQ(FinestPx(0, 0), 1.0) << "no image";
}

TEST(Camera, DistortionMovesCornersByPixels) {
  const auto ideal = Freiburg1().Undistort({10, 10});
  ASSERT_TRUE(ideal.has_value());
  EXPECT_GT((*ideal - Eigen::Vector2d(10, 10)).norm(), 2.0);
}

TEST(Camera, ProjectRefusesPointsBehind) {
  EXPECT_FALSE(Freiburg1().Project({0, 0, -1}).has_value());
  EXPECT_FALSE(Freiburg1().Project({0, 0, 0}).has_value());
}

/// 512 pixels of 190 degrees, as the cameras of head-mounted devices have them.
Camera Fisheye() {
  Camera camera{512, 512, 190.978, 190.973, 254.932, 256.897};
  camera.lens = Lens::kFisheye;
  camera.k1 = 0.0034823894;
  camera.k2 = 0.0007150348;
  camera.k3 = -0.0020532361;
  camera.k4 = 0.00020293673;
  return camera;
}

TEST(Fisheye, UndistortIsInverseOfDistort) {
  const Camera camera = Fisheye();
  Random random(2);
  int inverted = 0;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector2d raw(random.Uniform(0, 511), random.Uniform(0, 511));
    const double angle_rad = (raw - Eigen::Vector2d(camera.cx_px, camera.cy_px)).norm() / camera.fx_px;
    const auto ideal = camera.Undistort(raw);
    const bool near = angle_rad<1.45, far = angle_rad> 1.50;
    ASSERT_TRUE(!near || ideal) << raw.transpose();
    ASSERT_TRUE(!far || !ideal) << "no pinhole sees that far to the side: " << raw.transpose();
    if (!ideal) continue;
    ++inverted;
    EXPECT_NEAR((camera.Distort(*ideal) - raw).norm(), 0.0, 1e-7) << raw.transpose();
  }
  EXPECT_GT(inverted, 1500);
  const Eigen::Vector2d middle(camera.cx_px, camera.cy_px);
  EXPECT_EQ(camera.Distort(middle), middle);
  EXPECT_EQ(camera.Undistort(middle), middle);
}

TEST(Fisheye, APointsWayIntoTheImageAndBackIsItsRay) {
  const Camera camera = Fisheye();
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d p_cam(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(0.5, 4));
    const Eigen::Vector2d raw = camera.Distort(*camera.Project(p_cam));
    const auto ideal = camera.Undistort(raw);
    if (!ideal) continue;  // beyond 84 degrees
    EXPECT_LT((camera.Ray(*ideal) - p_cam / p_cam.z()).norm(), 1e-8 * p_cam.squaredNorm() / p_cam.z());
  }
}

TEST(Fisheye, WithoutCoefficientsTheAngleItselfIsThePlace) {
  Camera camera = Fisheye();
  camera.k1 = camera.k2 = camera.k3 = camera.k4 = 0;
  EXPECT_TRUE(camera.HasDistortion());
  const Eigen::Vector2d raw = camera.Distort(*camera.Project({1, 0, 1}));
  EXPECT_NEAR(raw.x(), camera.cx_px + camera.fx_px * 0.78539816339744831, 1e-9);
  EXPECT_FALSE(camera.WithoutLens().HasDistortion());
}

TEST(Fisheye, StretchIsHowMuchLargerAreasAre) {
  const Camera camera = Fisheye();
  for (const double x_px : {255.0, 300.0, 380.0, 440.0}) {
    const Eigen::Vector2d raw(x_px, 300), dx(1e-3, 0), dy(0, 1e-3);
    const Eigen::Vector2d at = *camera.Undistort(raw);
    Eigen::Matrix2d J;
    J << (*camera.Undistort(raw + dx) - *camera.Undistort(raw - dx)) / 2e-3,
        (*camera.Undistort(raw + dy) - *camera.Undistort(raw - dy)) / 2e-3;
    EXPECT_NEAR(camera.StretchAt(at), std::sqrt(J.determinant()), 1e-4 * camera.StretchAt(at)) << x_px;
  }
  EXPECT_EQ(Freiburg1().StretchAt({10, 10}), 1.0);
}

std::string WriteTemporary(const std::string& text) {
  const std::string path = testing::TempDir() + "/camera_test_" +
                           testing::UnitTest::GetInstance()->current_test_info()->name() + ".yaml";
  std::ofstream(path) << text;
  return path;
}

std::string ErrorOf(const std::string& text) {
  try {
    LoadCamera(WriteTemporary(text));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(CameraFile, NamesTheFieldThatIsWrong) {
  const std::string good = "width: 640\nheight: 480\nfx: 500\nfy: 500\ncx: 320\ncy: 240\n";
  EXPECT_EQ(ErrorOf(good), "");
  EXPECT_NE(ErrorOf("width: 640\n").find("'height'"), std::string::npos);
  EXPECT_NE(ErrorOf(good + "model: omni\n").find("'omni', which is not supported: pinhole and fisheye are"),
            std::string::npos);
  EXPECT_NE(ErrorOf(good + "distortion: [1, 2]\n").find("'distortion'"), std::string::npos);
  EXPECT_NE(ErrorOf("width: 640\nheight: 480\nfx: abc\nfy: 500\ncx: 320\ncy: 240\n").find("'fx'"),
            std::string::npos);
  EXPECT_NE(ErrorOf("width: 640\nheight: 480\nfx: 500\nfy: 500\ncx: 3200\ncy: 240\n").find("'cx'"),
            std::string::npos);
  EXPECT_NE(ErrorOf("width: 640.5\nheight: 480\nfx: 500\nfy: 500\ncx: 320\ncy: 240\n").find("'width'"),
            std::string::npos);
  EXPECT_NE(ErrorOf(good + "distorsion: [0, 0, 0, 0]\n").find("'distorsion' is not known"),
            std::string::npos);
  EXPECT_NE(ErrorOf("Camera.fx: 500\n").find("convert_camera"), std::string::npos);
  EXPECT_NE(ErrorOf("%YAML:1.0\nCamera.fx: 500\n").find("convert_camera"), std::string::npos);
  for (const std::string field : {"width", "height", "fx", "fy", "cx", "cy"}) {
    std::string lacking = good;
    const size_t at = lacking.find(field + ":");
    lacking.erase(at, lacking.find('\n', at) + 1 - at);
    EXPECT_NE(ErrorOf(lacking).find("field '" + field + "' is missing"), std::string::npos);
  }
  EXPECT_NE(ErrorOf("][").find("YAML"), std::string::npos);
  EXPECT_NE(ErrorOf(good + "distortion:\t[0, 0\nfps: 30\n").find(".yaml:8: is not valid YAML (column "),
            std::string::npos);
  EXPECT_THROW(LoadCamera("/nonexistent.yaml"), InputError);
}

TEST(CameraFile, NamesWhatIsWrongWithAFisheyeLens) {
  const std::string good = "model: fisheye\nwidth: 512\nheight: 512\nfx: 190\nfy: 190\ncx: 255\ncy: 255\n";
  EXPECT_EQ(ErrorOf(good + "distortion: [0, 0, 0, 0]\n"), "");
  EXPECT_NE(ErrorOf(good).find("'distortion' is missing; a fisheye lens needs it: [k1, k2, k3, k4]"),
            std::string::npos);
  EXPECT_NE(
      ErrorOf(good + "distortion: [0, 0, 0, 0, 0]\n").find("has 5 values; write four: [k1, k2, k3, k4]"),
      std::string::npos);
  EXPECT_NE(ErrorOf(good + "distortion: [-1, 0, 0, 0]\n").find("bends the image back within it"),
            std::string::npos)
      << "coefficients of a Brown lens, for one";
  EXPECT_NE(ErrorOf("model: equidistant\n").find("'equidistant', which is called 'fisheye' here"),
            std::string::npos);
}

struct PublishedCamera {
  const char* file;
  Camera camera;
};

// As https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats gives them for the colour cameras.
TEST(CameraFile, TumCamerasHoldThePublishedCalibrations) {
  const char* source_dir = std::getenv("DMSLAM_SOURCE_DIR");
  if (source_dir == nullptr) GTEST_SKIP() << "DMSLAM_SOURCE_DIR is not set";
  const PublishedCamera published[] = {
      {"TUM1.yaml", Freiburg1()},
      {"TUM2.yaml",
       {640, 480, 520.908620, 521.007327, 325.141442, 249.701764, 0.231222, -0.784899, -0.003257, -0.000105,
        0.917205, 30.0}},
      {"TUM3.yaml", {640, 480, 535.4, 539.2, 320.1, 247.6, 0, 0, 0, 0, 0, 30.0}}};
  for (const auto& [file, want] : published) {
    SCOPED_TRACE(file);
    const Camera camera = LoadCamera(std::string(source_dir) + "/config/" + file);
    EXPECT_EQ(camera.width_px, want.width_px);
    EXPECT_EQ(camera.height_px, want.height_px);
    EXPECT_EQ(camera.K(), want.K());
    EXPECT_EQ(Eigen::Vector3d(camera.k1, camera.k2, camera.k3), Eigen::Vector3d(want.k1, want.k2, want.k3));
    EXPECT_EQ(Eigen::Vector2d(camera.p1, camera.p2), Eigen::Vector2d(want.p1, want.p2));
    EXPECT_EQ(camera.fps, want.fps);
  }
}

TEST(CameraFile, WhatIsWrittenIsRead) {
  Camera camera = Freiburg1();
  camera.fps = 25;
  const std::string path = ::testing::TempDir() + "/written_camera.yaml";
  std::ofstream(path) << CameraText(camera);
  EXPECT_EQ(LoadCamera(path), camera);
  std::ofstream(path) << CameraText(camera.WithoutLens());
  EXPECT_EQ(LoadCamera(path), camera.WithoutLens());
  std::ofstream(path) << CameraText(Fisheye());
  EXPECT_EQ(LoadCamera(path), Fisheye());
}

TEST(Camera, AnotherRateSeesTheSameAnotherLensDoesNot) {
  const Camera camera = Freiburg1();
  Camera other = camera;
  other.fps = 60;
  EXPECT_TRUE(camera.SeesAs(other));
  EXPECT_FALSE(camera.SeesAs(camera.WithoutLens()));
  EXPECT_FALSE(camera.WithoutLens().HasDistortion());
}

/// The first field in which they differ, as "of a, of b"; empty: none.
std::string Differ(const Camera& a, const Camera& b) {
  const std::optional<CameraDifference> first = FirstDifference(a, b);
  return first ? first->a + ", " + first->b : "";
}

TEST(Camera, TheFirstFieldInWhichTwoDifferIsNamed) {
  const Camera camera = Freiburg1();
  Camera other = camera;
  other.fps = 60;
  EXPECT_EQ(Differ(camera, other), "") << "the rate does not count";
  other.p2 = 0.25;
  EXPECT_EQ(Differ(other, camera).find("distortion p2 0.25, distortion p2 "), 0u) << Differ(other, camera);
  other.fy_px = 525.505;
  other.cx_px += 1;
  EXPECT_EQ(Differ(other, camera).find("fy 525.505, fy "), 0u) << Differ(other, camera);
  other.height_px = 240;
  EXPECT_EQ(Differ(other, camera), "height 240, height 480");
  other.lens = Lens::kFisheye;
  EXPECT_EQ(Differ(other, camera), "model fisheye, model pinhole");
}

TEST(Camera, TwoThatDifferInAnyFieldDoNotSeeTheSame) {
  const Camera camera = Freiburg1();
  for (double Camera::*field : {&Camera::fx_px, &Camera::fy_px, &Camera::cx_px, &Camera::cy_px, &Camera::k1,
                                &Camera::k2, &Camera::p1, &Camera::p2, &Camera::k3, &Camera::k4}) {
    Camera other = camera;
    other.*field = std::nextafter(camera.*field, 1e9);
    EXPECT_FALSE(camera.SeesAs(other));
    const std::optional<CameraDifference> first = FirstDifference(camera, other);
    ASSERT_TRUE(first.has_value());
    EXPECT_NE(first->a, first->b) << "however little it is";
  }
}

}  // namespace
}  // namespace dmslam
