#include "dmslam/recording/checkpoint.h"

#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/recording/journal.h"
#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;
constexpr int64_t kSecond = 1'000'000'000;

// ---- When

/// The schedule in a run whose map changes at times, told so every 100 ms; writing takes `duration_ns`.
class Play {
 public:
  explicit Play(double every_s, int64_t duration_ns = 0) : schedule_(every_s), duration_ns_(duration_ns) {}

  /// `speed`: how much faster than the clock the frames come.
  void Until(int64_t end_ns, bool changes, int64_t speed = 1) {
    for (; now_ns_ < end_ns; now_ns_ += kSecond / 10) {
      if (changes && version_ == 0) oldest_unsaved_ns_ = now_ns_;
      if (changes) ++version_;
      if (version_ > 0) schedule_.OnMap(version_, now_ns_ * speed, now_ns_);
      if (writing_since_ns_ && now_ns_ - *writing_since_ns_ >= duration_ns_) End();
      if (!writing_since_ns_ && schedule_.Due()) Begin();
      if (writing_since_ns_ && duration_ns_ == 0) End();
      if (version_ > on_disk_) most_lost_ns_ = std::max(most_lost_ns_, now_ns_ - oldest_unsaved_ns_);
    }
  }
  void FailFrom(int64_t from_ns, int64_t until_ns) { fail_from_ns_ = from_ns, fail_until_ns_ = until_ns; }

  int begun = 0;
  int64_t most_lost_ns() const { return most_lost_ns_; }
  int64_t on_disk() const { return static_cast<int64_t>(on_disk_); }
  const CheckpointSchedule& schedule() const { return schedule_; }

 private:
  void Begin() {
    schedule_.OnBegun();
    ++begun;
    writing_since_ns_ = now_ns_;
    being_written_ = version_;
  }
  void End() {
    const bool written = now_ns_ < fail_from_ns_ || now_ns_ >= fail_until_ns_;
    schedule_.OnEnded(written, now_ns_);
    if (written) on_disk_ = being_written_, oldest_unsaved_ns_ = *writing_since_ns_;
    writing_since_ns_.reset();
  }

  CheckpointSchedule schedule_;
  int64_t duration_ns_, now_ns_ = 0, oldest_unsaved_ns_ = 0, most_lost_ns_ = 0;
  int64_t fail_from_ns_ = INT64_MAX, fail_until_ns_ = INT64_MAX;
  uint64_t version_ = 0, on_disk_ = 0, being_written_ = 0;
  std::optional<int64_t> writing_since_ns_;
};

TEST(CheckpointScheduleTest, NoChangeIsOlderThanAskedFor) {
  Play play(10);
  play.Until(60 * kSecond, true);
  EXPECT_EQ(play.begun, 6) << "the first at once, then every 10 s";
  EXPECT_LE(play.most_lost_ns(), 10 * kSecond);
}

TEST(CheckpointScheduleTest, TheTimeThatWritingTakesIsTakenOff) {
  Play play(10, 2 * kSecond);
  play.Until(120 * kSecond, true);
  EXPECT_LE(play.most_lost_ns(), 102 * kSecond / 10);
  EXPECT_GT(play.most_lost_ns(), 8 * kSecond);
}

TEST(CheckpointScheduleTest, WhereNothingChangesNothingIsWritten) {
  Play play(10);
  play.Until(60 * kSecond, false);
  EXPECT_EQ(play.begun, 0) << "there is no map";
  play.Until(61 * kSecond, true);
  play.Until(600 * kSecond, false);
  EXPECT_EQ(play.begun, 2) << "the first map, and what came within a second of it";
  EXPECT_EQ(play.on_disk(), 10);
  EXPECT_EQ(play.schedule().deadline_ns(), INT64_MAX);
}

TEST(CheckpointScheduleTest, ARecordingThatPlaysFasterIsWrittenMoreOften) {
  Play play(10);
  play.Until(30 * kSecond, true, 5);
  EXPECT_NEAR(play.begun, 15, 1);
}

TEST(CheckpointScheduleTest, WhereNoFrameIsKnownOnlyTheHostsTimeCounts) {
  CheckpointSchedule schedule(10);
  schedule.OnMap(1, std::nullopt, kSecond);
  EXPECT_TRUE(schedule.Due()) << "there is none";
  schedule.OnBegun();
  schedule.OnEnded(true, kSecond);
  schedule.OnMap(2, std::nullopt, 2 * kSecond);
  schedule.OnMap(2, 1000 * kSecond, 3 * kSecond);
  EXPECT_FALSE(schedule.Due()) << "when the change was made in the frames' time is not known";
  schedule.OnMap(2, 1001 * kSecond, 12 * kSecond);
  EXPECT_TRUE(schedule.Due());
}

TEST(CheckpointScheduleTest, ZeroIsOff) {
  Play play(0);
  play.Until(100 * kSecond, true);
  EXPECT_EQ(play.begun, 0);
  EXPECT_EQ(play.schedule().deadline_ns(), INT64_MAX);
}

TEST(CheckpointScheduleTest, WhatCouldNotBeWrittenIsTriedAgainAfterATime) {
  Play play(10);
  play.FailFrom(5 * kSecond, 45 * kSecond);
  play.Until(45 * kSecond, true);
  EXPECT_EQ(play.begun, 5) << "at 0, and then at most every 10 s";
  const int64_t then = play.on_disk();
  play.Until(56 * kSecond, true);
  EXPECT_GT(play.on_disk(), then);
}

// ---- How

class CheckpointTest : public testing::Test {
 protected:
  CheckpointTest() : folder_(testing::TempDir() + "/dmslam_checkpoint_" + std::to_string(getpid())) {
    fs::create_directories(folder_);
    path_ = CheckpointPath(folder_);
  }
  ~CheckpointTest() override { fs::remove_all(folder_); }

  /// A map of so many keyframes.
  static Map MapOf(uint32_t keyframes) {
    MapEditor map(TestCamera(), Pyramid());
    Random random(1);
    for (uint32_t i = 1; i <= keyframes; ++i) {
      FeatureSet features;
      for (int k = 0; k < 500; ++k) {
        features.keypoints.push_back({static_cast<uint16_t>(random.Below(640 * 16)),
                                      static_cast<uint16_t>(random.Below(480 * 16)), 0, 0});
        features.descriptors.emplace_back();
      }
      Keyframe keyframe;
      keyframe.id = KeyframeId::Make(7, i);
      keyframe.map_id = 1;
      keyframe.stamp_ns = i * kSecond;
      keyframe.features = MakeFrameFeatures(features, TestCamera(), Pyramid());
      map.AddKeyframe(std::move(keyframe));
    }
    return map;
  }
  static SessionStart StartOf(uint32_t session) {
    SessionStart start;
    start.session = session;
    start.camera = TestCamera();
    return start;
  }
  void Write(uint32_t keyframes, uint32_t session = 7) {
    WriteCheckpoint(path_, Cut(path_, MapOf(keyframes)), StartOf(session));
  }
  size_t Found(uint32_t session = 7) {
    const FoundCheckpoint found = FindCheckpoint(path_, session);
    return found.map ? found.map->map.keyframes().size() : 0;
  }
  static void Damage(const std::string& path) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(fs::file_size(path) / 2));
    file << std::string(100, 'x');
  }

  std::string folder_, path_;
};

TEST_F(CheckpointTest, IsTheMapThatWasWrittenLast) {
  EXPECT_EQ(Found(), 0U);
  for (uint32_t keyframes : {2, 5, 3}) {
    Write(keyframes);
    EXPECT_EQ(Found(), keyframes);
  }
  EXPECT_EQ(FindCheckpoint(path_, 7).problem, "");
  RemoveCheckpoints(path_);
  EXPECT_TRUE(fs::is_empty(folder_)) << "nothing is left behind";
}

TEST_F(CheckpointTest, WhereTheNewestIsDamagedTheOneBeforeServes) {
  Write(2);
  Write(3);
  Damage(path_);
  const FoundCheckpoint found = FindCheckpoint(path_, 7);
  ASSERT_TRUE(found.map.has_value());
  EXPECT_EQ(found.map->map.keyframes().size(), 2U);
  EXPECT_EQ(found.path, FormerCheckpointPath(path_));
  EXPECT_NE(found.problem.find("checkpoint.lcmlog: "), std::string::npos) << found.problem;
  Damage(FormerCheckpointPath(path_));
  EXPECT_FALSE(FindCheckpoint(path_, 7).map.has_value());
  EXPECT_NE(FindCheckpoint(path_, 7).problem.find("checkpoint.lcmlog: "), std::string::npos);
}

TEST_F(CheckpointTest, OfAnotherSessionIsNone) {
  Write(2, 7);
  Write(3, 8);
  EXPECT_EQ(Found(8), 3U);
  EXPECT_EQ(Found(7), 2U) << "the former one is of session 7";
  EXPECT_EQ(Found(9), 0U);
  EXPECT_NE(FindCheckpoint(path_, 9).problem.find("no checkpoint of this run"), std::string::npos);
}

TEST_F(CheckpointTest, AnotherSessionsJournalAndCheckpointsAreSetAsideTogether) {
  const auto write = [this] {
    Write(2, 7);
    Write(3, 7);
    Journal journal(JournalPath(folder_));
    journal.Begin(7);
    journal.AppendNote("x");
  };
  write();
  EXPECT_EQ(SetFormerRunAside(folder_, 7, false), std::nullopt) << "this run goes on with them";
  for (const std::string name : {"/former-7", "/former-7-2"}) {
    ASSERT_EQ(SetFormerRunAside(folder_, 8, false), std::optional(folder_ + name));
    EXPECT_EQ(FindCheckpoint(CheckpointPath(folder_ + name), 7).map->map.keyframes().size(), 3U);
    EXPECT_TRUE(fs::exists(FormerCheckpointPath(CheckpointPath(folder_ + name))));
    EXPECT_EQ(Journal::SessionOf(JournalPath(folder_ + name)), 7);
    EXPECT_FALSE(fs::exists(path_) || fs::exists(JournalPath(folder_)));
    write();
  }
  EXPECT_EQ(SetFormerRunAside(folder_, 7, true), std::optional(folder_ + "/former-7-3"));
}

TEST_F(CheckpointTest, AFullDiskLeavesTheFormerOne) {
  Write(2);
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit before = limit;
  limit.rlim_cur = fs::file_size(path_) + 1000;
  setrlimit(RLIMIT_FSIZE, &limit);
  EXPECT_THROW(Write(9), InputError);
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(Found(), 2U);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1) << "no half file";
  Write(4);
  EXPECT_EQ(Found(), 4U);
}

/// What happens to the files of a folder: they are made, written, renamed, removed.
class FolderEvents {
 public:
  explicit FolderEvents(const std::string& folder) : fd_(inotify_init1(IN_CLOEXEC)) {
    inotify_add_watch(fd_, folder.c_str(), IN_CREATE | IN_MODIFY | IN_MOVE | IN_DELETE | IN_CLOSE_WRITE);
  }
  ~FolderEvents() { close(fd_); }
  FolderEvents(const FolderEvents&) = delete;
  FolderEvents& operator=(const FolderEvents&) = delete;

  /// Returns when so many things have happened.
  void WaitFor(int count) {
    alignas(inotify_event) char buffer[4096];
    while (count > 0) {
      const ssize_t size = read(fd_, buffer, sizeof(buffer));
      ASSERT_GT(size, 0);
      for (ssize_t at = 0; at < size; --count) {
        at += static_cast<ssize_t>(sizeof(inotify_event) +
                                   reinterpret_cast<const inotify_event*>(buffer + at)->len);
      }
    }
  }

 private:
  int fd_;
};

/// Somebody writes one after the other and is killed at some moment: whatever was said to be written, or what
/// came after it, is there.
TEST_F(CheckpointTest, IsWholeWheneverTheWriterIsKilled) {
  for (int round = 0; round < 20; ++round) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    int said[2];
    ASSERT_EQ(pipe(said), 0);
    FolderEvents events(folder_);
    const pid_t child = fork();
    if (child == 0) {
      for (uint32_t keyframes = 1;; ++keyframes) {
        Write(1 + keyframes % 50);
        const auto number = static_cast<uint8_t>(1 + keyframes % 50);
        if (write(said[1], &number, 1) != 1) _exit(1);
      }
    }
    close(said[1]);
    uint8_t number = 0;
    ASSERT_EQ(read(said[0], &number, 1), 1);
    events.WaitFor(10 + 7 * round);
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    for (uint8_t next = 0; read(said[0], &next, 1) == 1;) number = next;
    close(said[0]);
    const size_t found = Found();
    EXPECT_TRUE(found == number || found == number % 50 + 1U) << found << " after " << int{number};
  }
}

}  // namespace
}  // namespace dmslam
