#include "run/resume.h"

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/recording/checkpoint.h"
#include "dmslam/recording/frame_memory.h"
#include "dmslam/recording/journal.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/codec.h"
#include "run/run_plan.h"

namespace {

int syncs = 0;

}  // namespace

/// In the place of the library's.
extern "C" int fdatasync(int fd) {
  ++syncs;
  return static_cast<int>(syscall(SYS_fdatasync, fd));
}

namespace dmslam {
namespace {

namespace fs = std::filesystem;
constexpr uint32_t kSession = 7;

class ResumeTest : public testing::Test {
 protected:
  ResumeTest() : out_(testing::TempDir() + "/dmslam_resume_" + std::to_string(getpid())) {
    fs::create_directories(out_ + "/log");
    identity_.session = kSession;
    identity_.folder = "/somewhere";
    identity_.arguments = {"--sequence", "a b", "--set", "x=\"1\""};
    identity_.pid = 17;
    identity_.resumed = 2;
  }
  ~ResumeTest() override { fs::remove_all(out_); }

  void AppendPose(Journal* journal, uint32_t frame, TrackingState state = TrackingState::kTracking) const {
    FramePose pose;
    pose.frame_index = frame;
    pose.state = state;
    RecordHeader header{};
    header.session = kSession;
    header.stream = static_cast<int32_t>(StreamId::kFrontend);
    header.epoch = header.writer = header.seq = 1;
    Bytes bytes = wire::Encode(pose);
    Seal(header, channels::kFramePose, bytes);
    journal->Append(bytes);
  }
  /// Frames 0 to `last`, and one that was placed later.
  void WriteJournal(uint32_t last) const {
    Journal journal(out_ + "/collector.journal");
    journal.Begin(kSession);
    journal.AppendNote("process player 1");
    for (uint32_t frame = 0; frame <= last; ++frame) AppendPose(&journal, frame);
    AppendPose(&journal, last + 5, TrackingState::kLocalizedLater);
  }
  void WriteMap(uint32_t keyframes, uint32_t session = kSession) const {
    MapEditor map(TestCamera(), Pyramid());
    for (uint32_t i = 0; i < keyframes; ++i) {
      Keyframe keyframe;
      keyframe.id = KeyframeId::Make(session, i);
      keyframe.map_id = 1;
      keyframe.features = MakeFrameFeatures(FeatureSet(), TestCamera(), Pyramid());
      map.AddKeyframe(std::move(keyframe));
    }
    SessionStart start;
    start.session = session;
    start.camera = TestCamera();
    WriteCheckpoint(CheckpointPath(out_), Cut("checkpoint", map), start);
  }
  std::string Refusal() const {
    try {
      FindResumePoint(out_, identity_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  std::string out_;
  RunIdentity identity_;
};

TEST_F(ResumeTest, TheRunIsReadAsItWasWritten) {
  identity_.Write(out_);
  const RunIdentity read = RunIdentity::Read(out_);
  EXPECT_EQ(read.session, kSession);
  EXPECT_EQ(read.folder, "/somewhere");
  EXPECT_EQ(read.arguments, identity_.arguments);
  EXPECT_EQ(read.pid, 17);
  EXPECT_EQ(read.resumed, 2);
  std::ofstream(out_ + "/run.json") << "{\"session\": 1";
  EXPECT_THROW(RunIdentity::Read(out_), InputError);
  fs::remove(out_ + "/run.json");
  EXPECT_THROW(RunIdentity::Read(out_), InputError);
}

TEST_F(ResumeTest, GoesOnBehindTheNewestFrameInTheCheckpointsMap) {
  WriteJournal(41);
  WriteMap(3);
  const ResumePoint point = FindResumePoint(out_, identity_);
  EXPECT_EQ(point.session, kSession);
  EXPECT_EQ(point.last_frame, std::optional<uint32_t>(41)) << "what was placed later was there before";
  EXPECT_EQ(point.keyframes, 3U);
  EXPECT_EQ(point.newest_keyframe, std::optional<uint32_t>(2));
  EXPECT_GT(point.lead_s, 0);
  EXPECT_EQ(point.warning, "");
}

/// Those who had written it may have died before they did.
TEST_F(ResumeTest, WhatItGoesOnFromIsMadeSafe) {
  WriteJournal(41);
  WriteMap(3);
  syncs = 0;
  FindResumePoint(out_, identity_);
  EXPECT_EQ(syncs, 1);
}

/// A keyframe that was proposed and is in no checkpoint: the recording is played again from there.
TEST_F(ResumeTest, ARecordingIsPlayedAgainFromTheFirstKeyframeThatIsLost) {
  const auto propose = [](Journal* journal, uint32_t frame, MapId map_id) {
    journal->AppendNote("keyframe " + std::to_string(KeyframeId::Make(kSession, frame).value) + " " +
                        std::to_string(map_id));
  };
  const auto behind = [this] { return FindResumePoint(out_, identity_).play_behind; };
  Journal journal(out_ + "/collector.journal");
  journal.Begin(kSession);
  for (uint32_t frame : {0, 1, 2}) propose(&journal, frame, 1);
  propose(&journal, 7, 9);
  journal.AppendNote("dropped 9");
  for (uint32_t frame = 0; frame <= 40; ++frame) AppendPose(&journal, frame);
  WriteMap(3);
  EXPECT_EQ(behind(), std::optional<uint32_t>(40)) << "all that is not in it was dropped";
  propose(&journal, 20, 1);
  propose(&journal, 30, 1);
  EXPECT_EQ(behind(), std::optional<uint32_t>(19));
  EXPECT_EQ(FindResumePoint(out_, identity_).last_frame, std::optional<uint32_t>(40));
  journal.AppendNote("resumed");
  EXPECT_EQ(behind(), std::optional<uint32_t>(19)) << "it died again before its first frame";
  AppendPose(&journal, 20);
  AppendPose(&journal, 21);
  EXPECT_EQ(behind(), std::optional<uint32_t>(21)) << "what this life has not seen is still to be played";
  propose(&journal, 21, 1);
  EXPECT_EQ(behind(), std::optional<uint32_t>(20));
  EXPECT_EQ(FindResumePoint(out_, identity_).last_frame, std::optional<uint32_t>(40));
  journal.AppendNote("resumed");
  journal.AppendNote("resumed");
  EXPECT_EQ(behind(), std::optional<uint32_t>(20));
}

TEST_F(ResumeTest, ATornJournalEndsAtItsLastWholePose) {
  WriteJournal(41);
  WriteMap(3);
  const std::string journal = out_ + "/collector.journal";
  const auto size = fs::file_size(journal);
  fs::resize_file(journal, size - size / 3);
  const ResumePoint point = FindResumePoint(out_, identity_);
  ASSERT_TRUE(point.last_frame.has_value());
  EXPECT_LT(*point.last_frame, 41U);
  EXPECT_GT(*point.last_frame, 20U);
}

TEST_F(ResumeTest, RefusesByNameWhatCannotBeResumed) {
  EXPECT_NE(Refusal().find("died before its first frame"), std::string::npos) << Refusal();
  std::ofstream(out_ + "/summary.json") << "{}\n";
  EXPECT_NE(Refusal().find("this run has ended"), std::string::npos) << Refusal();
  WriteJournal(41);
  EXPECT_NE(Refusal().find("died before there was a map"), std::string::npos) << Refusal();
  WriteMap(3, kSession + 1);
  EXPECT_NE(Refusal().find("no checkpoint of this run"), std::string::npos) << Refusal();
  fs::resize_file(CheckpointPath(out_), fs::file_size(CheckpointPath(out_)) / 2);
  EXPECT_NE(Refusal().find("checkpoint.lcmlog: "), std::string::npos) << Refusal();
  WriteMap(3);
  EXPECT_EQ(Refusal(), "");
}

TEST_F(ResumeTest, WhereTheCheckpointIsDamagedTheOneBeforeServesAndItIsSaid) {
  WriteJournal(41);
  WriteMap(3);
  WriteMap(4);
  fs::resize_file(CheckpointPath(out_), fs::file_size(CheckpointPath(out_)) / 2);
  const ResumePoint point = FindResumePoint(out_, identity_);
  EXPECT_EQ(point.keyframes, 3U);
  EXPECT_NE(point.warning.find("checkpoint.lcmlog.former"), std::string::npos) << point.warning;
}

TEST_F(ResumeTest, AFolderIsHeldByOneRun) {
  identity_.Write(out_);
  {
    const RunLock lock(out_);
    try {
      const RunLock second(out_);
      FAIL() << "two hold it";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("pid 17) is alive"), std::string::npos) << error.what();
    }
    const std::string copy = out_ + "/copy";
    fs::create_directories(copy);
    const RunLock of_a_copy(copy);
  }
  const RunLock again(out_);
}

TEST_F(ResumeTest, WhatAnotherRunLeftIsKeptAndCanBeResumed) {
  identity_.Write(out_);
  WriteJournal(41);
  EXPECT_EQ(KeepUnfinishedRun(out_), std::nullopt) << "without a map it cannot be resumed";
  WriteMap(3);
  WriteMap(4);
  fs::create_directories(FrameMemoryPath(out_));
  for (const std::string name : {"/former-7", "/former-7-2"}) {
    ASSERT_EQ(KeepUnfinishedRun(out_), std::optional(out_ + name));
    for (const std::string& file : {CheckpointPath(out_), JournalPath(out_), out_ + "/run.json"})
      EXPECT_FALSE(fs::exists(file)) << file;
    const ResumePoint point = FindResumePoint(out_ + name, RunIdentity::Read(out_ + name));
    EXPECT_EQ(point.last_frame, std::optional<uint32_t>(41));
    EXPECT_EQ(point.keyframes, 4U);
    EXPECT_TRUE(fs::exists(FrameMemoryPath(out_ + "/former-7")) && !fs::exists(FrameMemoryPath(out_)));
    EXPECT_TRUE(fs::exists(FormerCheckpointPath(CheckpointPath(out_ + "/former-7"))));
    identity_.Write(out_);
    WriteJournal(41);
    WriteMap(4);
  }
}

TEST_F(ResumeTest, ARunThatHasEndedIsNotKept) {
  EXPECT_EQ(KeepUnfinishedRun(out_), std::nullopt);
  identity_.Write(out_);
  WriteMap(3);
  EXPECT_EQ(KeepUnfinishedRun(out_), std::nullopt) << "the journal is removed first";
  WriteJournal(41);
  ++identity_.session;
  identity_.Write(out_);
  EXPECT_EQ(KeepUnfinishedRun(out_), std::nullopt) << "the journal is of another run";
}

TEST_F(ResumeTest, ProcessesAreToldToGoOn) {
  RunArguments arguments;
  arguments.source.sequence = arguments.output.folder = out_;
  arguments.source.frames = "100";
  RunPlace place;
  place.programs = "/bin";
  place.out = out_;
  place.port = 20001;
  place.session = kSession;
  ResumePoint point;
  point.session = kSession;
  point.last_frame = 41;
  point.play_behind = 30;
  place.resume = point;
  const auto line = [](const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) text += word + " ";
    return text;
  };
  for (const ChildSpec& child : MakeRunPlan(arguments, place).pipeline) {
    const std::string always = line(child.arguments), first = line(child.first);
    EXPECT_NE(always.find("--session 7 "), std::string::npos) << always;
    EXPECT_EQ(first.rfind("--fresh-system --resumed ", 0), 0U) << first;
    EXPECT_EQ(always.find("--resumed"), std::string::npos) << "whoever dies alone is begun as ever";
    EXPECT_EQ(always.find("--behind 30 ") != std::string::npos, child.name == "player") << always;
    EXPECT_EQ(first.find("--lead ") != std::string::npos, child.name == "player") << first;
    EXPECT_EQ(child.environment.contains("DMSLAM_CHECKPOINT"), child.name == "mapper");
    if (child.name == "mapper") {
      EXPECT_EQ(child.environment.at("DMSLAM_CHECKPOINT"), out_ + "/checkpoint.lcmlog");
    }
  }
  arguments.source.sequence = "/dev/video0";
  EXPECT_NE(line(MakeRunPlan(arguments, place).pipeline.back().arguments).find("--behind 41 "),
            std::string::npos)
      << "what a camera saw is not seen again";
  arguments.source.sequence = out_;
  place.resume.reset();
  for (const ChildSpec& child : MakeRunPlan(arguments, place).pipeline) {
    EXPECT_EQ(line(child.first), "--fresh-system ");
    EXPECT_EQ(line(child.arguments).find("--behind"), std::string::npos);
  }
  arguments.source.sequence.clear();
  arguments.source.replay = "a.log";
  place.resume = point;
  EXPECT_THROW(MakeRunPlan(arguments, place), InputError);
}

}  // namespace
}  // namespace dmslam
