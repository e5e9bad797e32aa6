#include "run/source_check.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/dataset/image.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

/// A run of two cameras, each with a sequence of two frames.
class SourceCheckTest : public testing::Test {
 protected:
  SourceCheckTest() {
    arguments_.source.sequence = MakeSequence("first", TestCamera());
    arguments_.source.others = {MakeSequence("second", TestCamera())};
    arguments_.camera.file = WriteCamera("first.yaml", TestCamera());
  }
  ~SourceCheckTest() override { fs::remove_all(folder_); }

  std::string MakeSequence(const std::string& name, const Camera& camera) const {
    const std::string sequence = folder_ + "/" + name;
    fs::create_directories(sequence);
    const GrayImage image(camera.width_px, camera.height_px);
    for (const char* frame : {"/0001.png", "/0002.png"}) WriteFileBytes(sequence + frame, EncodePng(image));
    return sequence;
  }
  std::string WriteCamera(const std::string& name, const Camera& camera) const {
    std::ofstream(folder_ + "/" + name) << CameraText(camera);
    return folder_ + "/" + name;
  }
  /// Why the run is not begun; empty: it is.
  std::string Refusal() const {
    try {
      CheckSources(arguments_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  void ExpectRefused(const std::string& part) const {
    EXPECT_NE(Refusal().find(part), std::string::npos) << "it says '" << Refusal() << "'";
  }

  const std::string folder_ = testing::TempDir() + "/source_check_" + std::to_string(getpid());
  RunArguments arguments_;
};

TEST_F(SourceCheckTest, WhatCanBePlayedIs) { EXPECT_EQ(Refusal(), ""); }

TEST_F(SourceCheckTest, ACameraThatDoesNotSeeWhatTheFirstOneDoesIsRefused) {
  Camera narrow = TestCamera();
  narrow.fx_px *= 2;
  narrow.fy_px *= 2;
  arguments_.source.other_cameras = {WriteCamera("second.yaml", narrow)};
  ExpectRefused("/second: its camera sees 25 % of what the one sees that its frames are to be told by");
  arguments_.source.other_cameras = {WriteCamera("second.yaml", TestCamera())};
  EXPECT_EQ(Refusal(), "");
}

TEST_F(SourceCheckTest, ACameraFileThatCannotBeReadIsRefused) {
  arguments_.source.other_cameras = {folder_ + "/second.yaml"};
  std::ofstream(folder_ + "/second.yaml") << "width: 640\n";
  ExpectRefused("second.yaml");
}

TEST_F(SourceCheckTest, AnotherModelThatIsNotToldByTheFirstIsAMisfit) {
  arguments_.camera.file.clear();
  Camera other = TestCamera();
  other.fx_px = 510;
  std::ofstream(arguments_.source.sequence + "/camera.yaml") << CameraText(TestCamera());
  std::ofstream(arguments_.source.others[0] + "/camera.yaml") << CameraText(other);
  ExpectRefused("/second: its camera has fx 510, that of " + arguments_.source.sequence + " has fx 500");
  EXPECT_THROW(CheckSources(arguments_), MisfitError);
}

TEST_F(SourceCheckTest, FramesOfAnotherSizeAreAMisfitOfWhicheverCamera) {
  Camera small = TestCamera();
  small.width_px = 320;
  for (const char* name : {"second", "first"}) {
    MakeSequence(name, small);
    ExpectRefused(std::string(name) + "/0001.png: is 320x480 pixels, but the camera file says 640x480");
  }
  EXPECT_THROW(CheckSources(arguments_), MisfitError);
  std::ofstream(arguments_.source.sequence + "/0001.png") << "no picture";
  std::ofstream(arguments_.source.others[0] + "/0001.png") << "no picture";
  EXPECT_EQ(Refusal(), "") << "the player leaves out what cannot be read";
}

TEST_F(SourceCheckTest, WhatIsNoSequenceIsRefused) {
  arguments_.source.others = {folder_};
  ExpectRefused(folder_ + ": is no sequence");
  arguments_.source.others.clear();
  EXPECT_EQ(Refusal(), "");
  arguments_.source.start = "2";
  ExpectRefused("/first: --start 2 leaves no frame of 2");
}

TEST_F(SourceCheckTest, WhatIsOnlyForRecordingsIsRefusedOfACamera) {
  arguments_.source.others = {"/dev/video77"};
  EXPECT_EQ(Refusal(), "") << "a camera may come later";
  arguments_.pace.lockstep = true;
  ExpectRefused("/dev/video77: a camera waits for nobody; leave --lockstep out");
  arguments_.pace.lockstep = false;
  arguments_.source.other_cameras = {arguments_.camera.file};
  ExpectRefused("--also-camera is for recordings; /dev/video77 is a camera");
}

TEST_F(SourceCheckTest, SettingsAndChangesOfFramesAreRefusedByName) {
  arguments_.settings.sets = {"no.such.key=1"};
  ExpectRefused("no.such.key");
  arguments_.settings.sets.clear();
  arguments_.source.black_outs = {"10"};
  ExpectRefused("--black-out 10: write FROM,SECONDS");
  arguments_.source.black_outs.clear();
  arguments_.source.jumps = {"10,5"};
  ExpectRefused("--jump 10,5: write FROM,TO");
}

TEST_F(SourceCheckTest, AVocabularyThatIsNoneIsRefused) {
  arguments_.settings.vocabulary = arguments_.camera.file;
  ExpectRefused(arguments_.camera.file + ":");
}

TEST_F(SourceCheckTest, ChangesOfFramesThatAreNotThereAreRefusedByName) {
  arguments_.source.black_outs = {"1,0.5", "2,1"};
  ExpectRefused("--black-out 2,1: there is no frame 2, the last of 2 frames is 1");
  arguments_.source.black_outs = {"1,0.5"};
  arguments_.source.jumps = {"0,1", "1,500"};
  ExpectRefused("--jump 1,500: there is no frame 500, the last of 2 frames is 1");
  arguments_.source.jumps = {"0,1"};
  EXPECT_EQ(Refusal(), "");
  WriteFileBytes(arguments_.source.others[0] + "/0003.png", EncodePng(GrayImage(640, 480)));
  arguments_.source.black_outs = {"2,1"};
  EXPECT_EQ(Refusal(), "") << "the other camera has that frame";
}

}  // namespace
}  // namespace dmslam
