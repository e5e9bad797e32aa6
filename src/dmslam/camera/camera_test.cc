#include "dmslam/camera/camera.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

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

TEST(Camera, DistortionMovesCornersByPixels) {
  const auto ideal = Freiburg1().Undistort({10, 10});
  ASSERT_TRUE(ideal.has_value());
  EXPECT_GT((*ideal - Eigen::Vector2d(10, 10)).norm(), 2.0);
}

TEST(Camera, ProjectRefusesPointsBehind) {
  EXPECT_FALSE(Freiburg1().Project({0, 0, -1}).has_value());
  EXPECT_FALSE(Freiburg1().Project({0, 0, 0}).has_value());
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
  EXPECT_NE(ErrorOf(good + "model: fisheye\n").find("fisheye"), std::string::npos);
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
  EXPECT_THROW(LoadCamera("/nonexistent.yaml"), InputError);
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
}

TEST(Camera, AnotherRateSeesTheSameAnotherLensDoesNot) {
  const Camera camera = Freiburg1();
  Camera other = camera;
  other.fps = 60;
  EXPECT_TRUE(camera.SeesAs(other));
  EXPECT_FALSE(camera.SeesAs(camera.WithoutLens()));
  EXPECT_FALSE(camera.WithoutLens().HasDistortion());
}

}  // namespace
}  // namespace dmslam
