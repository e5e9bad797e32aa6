#include "dmslam/recording/journal.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "dmslam/messaging/codec.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

void LimitFiles(rlim_t bytes) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  limit.rlim_cur = std::min(bytes, limit.rlim_max);
  setrlimit(RLIMIT_FSIZE, &limit);
}

class JournalTest : public testing::Test {
 protected:
  JournalTest()
      : folder_(testing::TempDir() + "/dmslam_journal_" + std::to_string(getpid())),
        path_(folder_ + "/journal") {
    fs::create_directories(folder_);
  }
  ~JournalTest() override {
    LimitFiles(RLIM_INFINITY);
    fs::remove_all(folder_);
  }
  /// Where the journal of a session is set aside.
  std::string Former(int64_t session) const {
    return folder_ + "/former-" + std::to_string(session) + "/journal";
  }
  static Bytes RecordOf(int64_t session, int64_t seq) {
    FramePose pose;
    pose.frame_index = static_cast<uint32_t>(seq);
    RecordHeader header{};
    header.session = session;
    header.stream = static_cast<int32_t>(StreamId::kFrontend);
    header.epoch = 1;
    header.writer = 1;
    header.seq = seq;
    Bytes bytes = wire::Encode(pose);
    Seal(header, channels::kFramePose, bytes);
    return bytes;
  }
  static std::vector<int64_t> Numbers(Journal& journal) {
    std::vector<int64_t> numbers;
    journal.ForEach([&](std::span<const uint8_t> record) { numbers.push_back(ParseHeader(record)->seq); });
    return numbers;
  }
  static std::vector<int64_t> UpTo(int64_t last) {
    std::vector<int64_t> numbers;
    for (int64_t i = 1; i <= last; ++i) numbers.push_back(i);
    return numbers;
  }
  std::vector<int64_t> Resumed(int64_t session) {
    std::vector<int64_t> numbers;
    Journal journal(path_);
    journal.Resume(session,
                   [&](std::span<const uint8_t> record) { numbers.push_back(ParseHeader(record)->seq); });
    return numbers;
  }
  std::string folder_, path_;
};

TEST_F(JournalTest, AFullDiskLosesNothingAndLeavesNoHalfRecord) {
  {
    Journal journal(path_);
    journal.Resume(7, [](std::span<const uint8_t>) {});
    for (int64_t i = 1; i <= 3; ++i) journal.Append(RecordOf(7, i));
    EXPECT_EQ(journal.problem(), "");
    LimitFiles(fs::file_size(path_) + 10);
    for (int64_t i = 4; i <= 20; ++i) journal.Append(RecordOf(7, i));
    EXPECT_NE(journal.problem().find("cannot be written"), std::string::npos);
    EXPECT_EQ(journal.pending(), 17) << "who dies now loses them";
    EXPECT_FALSE(journal.Flush());
    EXPECT_EQ(Numbers(journal), UpTo(20)) << "what the disk did not take is in memory";
    EXPECT_EQ(Resumed(7), UpTo(3)) << "what is on the disk is whole";
    LimitFiles(RLIM_INFINITY);
    EXPECT_TRUE(journal.Flush());
    EXPECT_EQ(journal.pending(), 0);
    journal.Append(RecordOf(7, 21));
    EXPECT_EQ(Numbers(journal), UpTo(21));
    EXPECT_EQ(journal.lost(), 0);
  }
  EXPECT_EQ(Resumed(7), UpTo(21)) << "it is written once there is room";
}

TEST_F(JournalTest, AnotherSessionsJournalIsSetAsideAndNotTruncated) {
  {
    Journal journal(path_);
    journal.Resume(7, [](std::span<const uint8_t>) {});
    for (int64_t i = 1; i <= 5; ++i) journal.Append(RecordOf(7, i));
  }
  EXPECT_TRUE(Resumed(8).empty());
  fs::rename(Former(7), path_);
  EXPECT_EQ(Resumed(7), UpTo(5));
}

TEST_F(JournalTest, OneThatBeginsSetsAsideWhatIsThere) {
  for (int i = 0; i < 2; ++i) {
    Journal journal(path_);
    journal.Begin(7);
    EXPECT_TRUE(Numbers(journal).empty());
    journal.Append(RecordOf(7, 1));
    journal.AppendNote("x");
  }
  EXPECT_EQ(Resumed(7), UpTo(1));
  EXPECT_TRUE(fs::exists(Former(7)));
  Journal(path_).Begin(7);
  EXPECT_TRUE(fs::exists(folder_ + "/former-7-2/journal")) << "an older one is not overwritten";
}

TEST_F(JournalTest, ItsSessionIsThatOfItsFirstRecord) {
  EXPECT_EQ(Journal::SessionOf(path_), std::nullopt);
  {
    Journal journal(path_);
    journal.Begin(7);
    EXPECT_EQ(Journal::SessionOf(path_), std::nullopt) << "it is empty";
    journal.AppendNote("x");
  }
  EXPECT_EQ(Journal::SessionOf(path_), 7);
}

TEST_F(JournalTest, NotesAreReadAgainAndAreNoRecords) {
  const auto nothing = [](std::span<const uint8_t>) {};
  {
    Journal journal(path_);
    journal.Resume(7, nothing);
    journal.AppendNote("keyframe 3 1");
    journal.Append(RecordOf(7, 1));
    journal.AppendNote("dropped 1");
    EXPECT_EQ(Numbers(journal), UpTo(1));
  }
  std::vector<std::string> notes;
  Journal journal(path_);
  journal.Resume(7, nothing, [&](const std::string& note) { notes.push_back(note); });
  EXPECT_EQ(notes, (std::vector<std::string>{"keyframe 3 1", "dropped 1"}));
  EXPECT_EQ(Numbers(journal), UpTo(1));
  Journal other(path_);
  other.Resume(8, nothing, [&](const std::string&) { FAIL() << "of another session"; });
}

TEST_F(JournalTest, HalfARecordIsNotThere) {
  {
    Journal journal(path_);
    journal.Resume(7, [](std::span<const uint8_t>) {});
    for (int64_t i = 1; i <= 5; ++i) journal.Append(RecordOf(7, i));
  }
  fs::resize_file(path_, fs::file_size(path_) - 3);
  EXPECT_EQ(Resumed(7), UpTo(4));
}

/// After a power cut a file may end in zeros, or in what another file once held there.
TEST_F(JournalTest, WhatIsDamagedIsCutOffAndWhatComesBeforeStays) {
  {
    Journal journal(path_);
    journal.Resume(7, [](std::span<const uint8_t>) {});
    for (int64_t i = 1; i <= 5; ++i) journal.Append(RecordOf(7, i));
    journal.AppendNote("counters 1");
  }
  const auto whole = static_cast<std::streamoff>(fs::file_size(path_));
  std::fstream(path_, std::ios::in | std::ios::out | std::ios::binary).seekp(whole - 6).write("\0\0", 2);
  EXPECT_EQ(Resumed(7), UpTo(5)) << "the note's text does not fit its checksum";
  const auto records = static_cast<std::streamoff>(fs::file_size(path_));
  ASSERT_LT(records, whole);
  std::ofstream(path_, std::ios::app | std::ios::binary) << std::string(4096, '\0');
  EXPECT_EQ(Resumed(7), UpTo(5));
  std::fstream(path_, std::ios::in | std::ios::out | std::ios::binary).seekp(records - 60).write("x", 1);
  EXPECT_EQ(Resumed(7), UpTo(4));
  EXPECT_FALSE(fs::exists(Former(0))) << "damage is no other session";
}

TEST_F(JournalTest, IsReadWhileSomebodyWritesIt) {
  std::vector<int64_t> numbers;
  std::vector<std::string> notes;
  const auto take = [&](std::span<const uint8_t> record) { numbers.push_back(ParseHeader(record)->seq); };
  const auto read = [&](const std::string& note) { notes.push_back(note); };
  EXPECT_FALSE(Journal::Read(path_, 7, take, read)) << "there is none";
  EXPECT_FALSE(fs::exists(path_)) << "and none is made";
  Journal journal(path_);
  journal.Begin(7);
  journal.Append(RecordOf(7, 1));
  journal.AppendNote("x");
  const auto whole = fs::file_size(path_);
  journal.Append(RecordOf(7, 2));
  fs::resize_file(path_, fs::file_size(path_) - 1);
  EXPECT_TRUE(Journal::Read(path_, 7, take, read));
  EXPECT_EQ(numbers, UpTo(1));
  EXPECT_EQ(notes, std::vector<std::string>{"x"});
  EXPECT_GT(fs::file_size(path_), whole) << "nothing is cut off";
  EXPECT_FALSE(Journal::Read(path_, 8, take, read));
}

}  // namespace
}  // namespace dmslam
