#include "run/map_check.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/event_log.h"
#include "dmslam/place_recognition/places_test_util.h"
#include "dmslam/recording/map_file.h"
#include "dmslam/runtime/load_vocabulary.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

/// A saved map of one keyframe, and a run that begins in it.
class MapCheckTest : public testing::Test {
 protected:
  MapCheckTest() {
    fs::create_directories(folder_ + "/sequence");
    made_.session = 1;
    made_.camera = TestCamera();
    WriteCamera(TestCamera());
    arguments_.source.sequence = folder_ + "/sequence";
    arguments_.map.begin = folder_ + "/a.map";
    Save();
  }
  ~MapCheckTest() override { fs::remove_all(folder_); }

  void WriteCamera(const Camera& camera) {
    arguments_.camera.file = folder_ + "/camera.yaml";
    std::ofstream(arguments_.camera.file) << CameraText(camera);
  }
  void Save() const {
    MapEditor map(TestCamera(), Pyramid());
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, 1);
    keyframe.map_id = 1;
    keyframe.features = MakeFrameFeatures(FeatureSet(), map.camera(), map.pyramid());
    map.AddKeyframe(std::move(keyframe));
    SaveMap(arguments_.map.begin, map, made_);
  }
  /// A log of a run in which two keyframes were made; `second`: number of the second one's record.
  void WriteLog(int64_t second) {
    arguments_.map.begin = folder_ + "/run.lcmlog";
    EventLogWriter log(arguments_.map.begin);
    WriteRecord(made_, StreamId::kFrontend, 1, &log);
    MapEditor map(TestCamera(), Pyramid());
    for (const int64_t seq : {int64_t{1}, second}) {
      Keyframe keyframe;
      keyframe.id = KeyframeId::Make(1, static_cast<uint32_t>(seq));
      keyframe.map_id = 1;
      keyframe.features = MakeFrameFeatures(FeatureSet(), map.camera(), map.pyramid());
      const KeyframeId id = keyframe.id;
      map.AddKeyframe(std::move(keyframe));
      WriteRecord(map.TakeDelta(MapEvent::kMapped, id, 1), StreamId::kMap, seq, &log);
    }
    log.Close();
  }
  template <typename Message>
  static void WriteRecord(const Message& message, StreamId stream, int64_t seq, EventLogWriter* log) {
    RecordHeader header{};
    header.session = 1;
    header.stream = static_cast<int32_t>(stream);
    header.flags = RecordHeader::FLAG_FRESH;
    header.epoch = 100;
    header.writer = 5;
    header.seq = seq;
    std::string channel = wire::Info<Message>().channel;
    Bytes bytes = wire::Encode(message);
    Seal(header, channel, bytes);
    log->Write(seq, channel, bytes);
  }
  /// Why the run is not begun; empty: it is.
  std::string Refusal() const {
    try {
      CheckMap(arguments_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  const std::string folder_ = testing::TempDir() + "/map_check_" + std::to_string(getpid());
  SessionStart made_;
  RunArguments arguments_;
};

TEST_F(MapCheckTest, AMapThatFitsIsBegunIn) {
  EXPECT_EQ(Refusal(), "");
  arguments_.map.begin = "";
  arguments_.camera.file = "/nowhere.yaml";
  EXPECT_EQ(Refusal(), "") << "there is no map to judge";
}

TEST_F(MapCheckTest, ACameraThatDoesNotFitIsNamedWhereverItIsFound) {
  Camera other = TestCamera();
  other.fx_px = 510;
  WriteCamera(other);
  const std::string why =
      arguments_.map.begin +
      ": was made with fx 500, the camera that plays has fx 510: give the camera file of that map";
  EXPECT_EQ(Refusal(), why);
  fs::rename(arguments_.camera.file, arguments_.source.sequence + "/camera.yaml");
  arguments_.camera.file = "";
  EXPECT_EQ(Refusal(), why) << "the sequence brings it along";
}

TEST_F(MapCheckTest, SettingsThatDoNotFitAreNamed) {
  arguments_.settings.sets = {"features.levels=7"};
  EXPECT_NE(Refusal().find("a.map: was made with features.levels=8 "), std::string::npos) << Refusal();
}

TEST_F(MapCheckTest, AnotherVocabularyIsAMisfit) {
  made_.vocabulary_checksum = 0xabc;
  Save();
  EXPECT_THROW(CheckMap(arguments_), MisfitError);
  EXPECT_NE(Refusal().find("a.map: was made with another vocabulary (checksum 0000000000000abc)"),
            std::string::npos);
  arguments_.build_folder = "/elsewhere";
  EXPECT_EQ(Refusal(), "") << "programs from elsewhere may have that one";
}

TEST_F(MapCheckTest, TheVocabularyOfTheMapMayBeGiven) {
  arguments_.settings.vocabulary = folder_ + "/small.dmv";
  places_test::SmallVocabulary().SaveBinary(arguments_.settings.vocabulary);
  made_.vocabulary_checksum = LoadVocabulary(arguments_.settings.vocabulary)->checksum();
  Save();
  EXPECT_EQ(Refusal(), "");
  arguments_.build_folder = "/elsewhere";
  EXPECT_EQ(Refusal(), "");
  made_.vocabulary_checksum = 0xabc;
  Save();
  EXPECT_NE(Refusal().find("give its own with --vocabulary"), std::string::npos)
      << "one that is given is judged, whoever uses it";
}

TEST_F(MapCheckTest, ALogThatLacksRecordsOfItsMapIsNotBegunIn) {
  WriteLog(2);
  EXPECT_EQ(Refusal(), "");
  WriteLog(3);
  EXPECT_NE(Refusal().find("run.lcmlog: is not whole: 1 map records are missing"), std::string::npos)
      << Refusal();
}

TEST_F(MapCheckTest, ALogThatEndsBeforeItsRunDidIsBegunInAndSaidSo) {
  WriteLog(2);
  const std::optional<std::string> notice = CheckMap(arguments_);
  ASSERT_TRUE(notice);
  EXPECT_NE(notice->find("run.lcmlog: the log ends before its run did; the map has the 2 keyframes"),
            std::string::npos)
      << *notice;
  arguments_.map.begin = folder_ + "/a.map";
  EXPECT_FALSE(CheckMap(arguments_)) << "a saved map stands for itself";
}

TEST_F(MapCheckTest, WhatIsNoMapIsNamed) {
  arguments_.map.begin = arguments_.camera.file;
  EXPECT_NE(Refusal().find(arguments_.map.begin), std::string::npos);
}

}  // namespace
}  // namespace dmslam
