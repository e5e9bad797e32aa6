#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "dmslam/dataset/frame_source.h"
#include "dmslam/dataset/image_folder.h"
#include "dmslam/dataset/trajectory.h"
#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/dataset/video_source.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

class DatasetTest : public testing::Test {
 protected:
  DatasetTest()
      : root_(fs::path(testing::TempDir()) /
              (std::string("dataset_") + testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  ~DatasetTest() override { fs::remove_all(root_); }

  void Write(const std::string& name, const std::string& text) {
    fs::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name) << text;
  }
  void WriteImage(const std::string& name, uint8_t value) {
    fs::create_directories((root_ / name).parent_path());
    WriteFileBytes((root_ / name).string(), EncodePng(GrayImage(40, 32, value)));
  }
  template <typename Function>
  static std::string ErrorOf(Function function) {
    try {
      function();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  std::string TumError(const std::string& list) {
    Write("rgb.txt", list);
    return ErrorOf([&] { TumSequence sequence(root_.string()); });
  }

  fs::path root_;
};

TEST_F(DatasetTest, TumFolderCountsWhatIsMissing) {
  WriteImage("rgb/a.png", 10);
  WriteImage("rgb/c.png", 30);
  Write(
      "rgb.txt",
      "# color images\n1341836537.655662 rgb/a.png\n1341836537.687415 rgb/b.png\r\n1341836537.7 rgb/c.png\n");
  Write("groundtruth.txt", "1341836537.6 0 0 0 0 0 0 1\n");
  Write("mask.txt", "1341836537.655662 mask/a.png\n");
  TumSequence sequence(root_.string());
  ASSERT_EQ(sequence.size(), 2u);
  EXPECT_EQ(sequence.missing(), 1u);
  EXPECT_EQ(sequence.listed(), 3u);
  EXPECT_EQ(sequence.StampNs(0), 1341836537655662000);
  EXPECT_EQ(DecodeGray(sequence.Read(1), sequence.Name(1)).at(0, 0), 30);
  EXPECT_EQ(sequence.masks().size(), 1u);
  ASSERT_TRUE(sequence.GroundTruthPath());
  EXPECT_EQ(ReadTrajectory(*sequence.GroundTruthPath()).size(), 1u);
  EXPECT_THROW(sequence.Read(2), std::out_of_range);
}

TEST_F(DatasetTest, TumBadInputNamesFileAndLine) {
  WriteImage("rgb/a.png", 10);
  EXPECT_NE(TumError("1 rgb/a.png\n2\n").find("rgb.txt:2: has 1 columns"), std::string::npos);
  EXPECT_NE(TumError("1 rgb/a.png x\n").find("rgb.txt:1: has 3 columns"), std::string::npos);
  EXPECT_NE(TumError("x rgb/a.png\n").find("rgb.txt:1: 'x' is not a stamp"), std::string::npos);
  EXPECT_NE(TumError("-1.5 rgb/a.png\n").find("rgb.txt:1: stamp -1.500000 is below zero; add"),
            std::string::npos);
  EXPECT_NE(TumError("2 rgb/a.png\n# c\n2 rgb/a.png\n").find("rgb.txt:3: stamp 2.000000 repeats"),
            std::string::npos);
  EXPECT_NE(TumError("2 rgb/a.png\n1 rgb/a.png\n").find("rgb.txt:2: stamp 1.000000 is earlier"),
            std::string::npos);
  EXPECT_NE(TumError("# empty\n").find("lists no image"), std::string::npos);
  EXPECT_NE(TumError("1 rgb/x.png\n2 rgb/y.png\n").find("none of its 2 images is there"), std::string::npos);
  EXPECT_NE(ErrorOf([] { TumSequence sequence("/nonexistent"); }).find("no such folder"), std::string::npos);
  fs::remove(root_ / "rgb.txt");
  EXPECT_NE(ErrorOf([&] { TumSequence sequence(root_.string()); }).find("has no rgb.txt"), std::string::npos);
}

TEST_F(DatasetTest, NearestFileWithinTolerance) {
  const std::vector<StampedFile> files = {{100, "a"}, {200, "b"}};
  EXPECT_EQ(FindNearest(files, 120, 30)->path, "a");
  EXPECT_EQ(FindNearest(files, 190, 30)->path, "b");
  EXPECT_EQ(FindNearest(files, 250, 50)->path, "b");
  EXPECT_FALSE(FindNearest(files, 150, 30));
  EXPECT_FALSE(FindNearest({}, 150, 30));
}

TEST_F(DatasetTest, NumberedImagesComeInTheirOrder) {
  WriteImage("frame10.png", 10);
  WriteImage("frame9.PNG", 9);
  Write("notes7.txt", "no image");
  ImageFolder folder(root_.string(), 10.0);
  ASSERT_EQ(folder.size(), 2u);
  EXPECT_EQ(DecodeGray(folder.Read(0), "x").at(0, 0), 9);
  EXPECT_EQ(folder.StampNs(1), 100'000'000);
  WriteImage("frame009.png", 9);
  EXPECT_NE(ErrorOf([&] { ImageFolder twice(root_.string(), 10.0); }).find("same number"), std::string::npos);
}

TEST_F(DatasetTest, EurocFolderAndItsCamera) {
  WriteImage("mav0/cam0/data/1403636579763555584.png", 5);
  Write("mav0/cam0/data.csv",
        "#timestamp "
        "[ns],filename\r\n1403636579763555584,1403636579763555584.png\r\n1403636579813555456,none.png\n");
  Write("mav0/cam0/sensor.yaml",
        "rate_hz: 20\nresolution: [752, 480]\nintrinsics: [458.654, 457.296, 367.215, 248.375]\n"
        "distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n");
  const auto source = OpenFrameSource(root_.string());
  ASSERT_EQ(source->size(), 1u);
  EXPECT_EQ(source->missing(), 1u);
  EXPECT_EQ(source->StampNs(0), 1403636579763555584);
  const auto camera = FindCamera(root_.string(), "/nonexistent");
  ASSERT_TRUE(camera);
  EXPECT_DOUBLE_EQ(camera->fx_px, 458.654);
  EXPECT_DOUBLE_EQ(camera->p2, 1.76187114e-05);
  EXPECT_DOUBLE_EQ(camera->fps, 20);
  Write("mav0/cam0/sensor.yaml", "resolution: [752, 480]\nintrinsics: [458.654]\n");
  EXPECT_NE(ErrorOf([&] { FindCamera(root_.string(), ""); }).find("'intrinsics'"), std::string::npos);
  Write("mav0/cam0/sensor.yaml", "camera_model: pinhole\ndistortion_model: fov\n");
  EXPECT_NE(ErrorOf([&] { FindCamera(root_.string(), ""); }).find("'distortion_model' is 'fov'"),
            std::string::npos);
  Write("mav0/cam0/sensor.yaml",
        "resolution: [512, 512]\nintrinsics: [190.978, 190.973, 254.932, 256.897]\n"
        "camera_model: pinhole\ndistortion_model: equidistant\n"
        "distortion_coefficients: [0.0034823894, 0.0007150348, -0.0020532361, 0.00020293673]\n");
  const auto fisheye = FindCamera(root_.string(), "");
  ASSERT_TRUE(fisheye);
  EXPECT_EQ(fisheye->lens, Lens::kFisheye);
  EXPECT_DOUBLE_EQ(fisheye->k4, 0.00020293673);
  Write("mav0/cam0/sensor.yaml", "rate_hz: 20\nresolution:\t[752, 480\n");
  EXPECT_NE(
      ErrorOf([&] { FindCamera(root_.string(), ""); }).find("sensor.yaml:3: is not valid YAML (column "),
      std::string::npos);
  Write("mav0/cam0/sensor.yaml", "5\n");
  EXPECT_NE(ErrorOf([&] { FindCamera(root_.string(), ""); }).find("not a map"), std::string::npos);
  Write("mav0/cam0/data.csv", "5.5,a.png\n");
  EXPECT_NE(ErrorOf([&] { OpenFrameSource(root_.string()); }).find("data.csv:1: '5.5' is not a stamp"),
            std::string::npos);
  Write("mav0/cam0/data.csv", "-5,a.png\n");
  EXPECT_NE(ErrorOf([&] { OpenFrameSource(root_.string()); }).find("data.csv:1: stamp -0.000000005 is below"),
            std::string::npos);
}

TEST_F(DatasetTest, WhatIsNoSequenceIsRefused) {
  EXPECT_NE(ErrorOf([&] { OpenFrameSource(root_.string()); }).find("is no sequence"), std::string::npos);
  EXPECT_NE(ErrorOf([] { OpenFrameSource("/nonexistent"); }).find("no such file or folder"),
            std::string::npos);
  Write("broken.avi", "this is not a video");
  EXPECT_THROW(OpenFrameSource((root_ / "broken.avi").string()), InputError);
}

TEST_F(DatasetTest, CameraIsFoundByTheFoldersName) {
  EXPECT_EQ(TumCameraName("/data/rgbd_dataset_freiburg1_xyz"), "TUM1");
  EXPECT_EQ(TumCameraName("/data/rgbd_dataset_freiburg2_desk/"), "TUM2");
  EXPECT_EQ(TumCameraName("fr3_walking_xyz"), "TUM3");
  EXPECT_FALSE(TumCameraName("/data/fr34_x"));
  EXPECT_FALSE(TumCameraName("/data/kitchen"));
  const char* source_dir = std::getenv("DMSLAM_SOURCE_DIR");
  if (source_dir == nullptr) GTEST_SKIP() << "DMSLAM_SOURCE_DIR is not set";
  const std::string config = std::string(source_dir) + "/config";
  EXPECT_DOUBLE_EQ(FindCamera("/data/rgbd_dataset_freiburg2_desk", config)->k3, 0.917205);
  for (const char* name : {"TUM1", "TUM2", "TUM3", "kitchen", "synthetic"}) {
    EXPECT_EQ(LoadCamera(config + "/" + name + ".yaml").width_px, 640) << name;
  }
}

TEST_F(DatasetTest, RealSequences) {
  const char* data = std::getenv("DMSLAM_DATA");
  const char* source_dir = std::getenv("DMSLAM_SOURCE_DIR");
  const fs::path root = data ? fs::path(data) : fs::path(source_dir ? source_dir : ".") / "../shared/data";
  if (!fs::exists(root / "kitchen")) GTEST_SKIP() << "no real data at " << root;
  TumSequence kitchen((root / "kitchen").string());
  EXPECT_EQ(kitchen.size(), 1000u);
  EXPECT_EQ(kitchen.missing(), 0u);
  const GrayImage first = DecodeGray(kitchen.Read(0), kitchen.Name(0));
  EXPECT_EQ(first.width, 640);
  EXPECT_EQ(ReadTrajectory(*kitchen.GroundTruthPath()).size(), 1000u);
  TumSequence far((root / "rgbd_dataset_freiburg3_structure_notexture_far").string());
  EXPECT_EQ(far.size(), 60u);
  EXPECT_EQ(far.listed(), 814u);
  EXPECT_GT(ReadTrajectory(*far.GroundTruthPath()).size(), 1000u);
  TumSequence walk((root / "kitchen_walk2").string());
  ASSERT_EQ(walk.masks().size(), 700u);
  const GrayImage mask = LoadGray(walk.masks()[100].path);
  for (const uint8_t value : mask.data) ASSERT_TRUE(value == 0 || value == 128 || value == 255) << int{value};
}

}  // namespace
}  // namespace dmslam
