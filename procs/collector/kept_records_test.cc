#include "collector/kept_records.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "dmslam/messaging/codec.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

constexpr uint32_t kSession = 4;

/// As where the disk is full: files grow no further.
void LimitFiles(rlim_t bytes) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  limit.rlim_cur = std::min(bytes, limit.rlim_max);
  setrlimit(RLIMIT_FSIZE, &limit);
}

class KeptRecordsTest : public testing::Test {
 protected:
  KeptRecordsTest() : folder_(testing::TempDir() + "/dmslam_kept_records_" + std::to_string(getpid())) {
    std::filesystem::create_directories(folder_);
    kept_ = std::make_unique<KeptRecords>(JournalPath(folder_));
    kept_->journal().Begin(kSession);
  }
  ~KeptRecordsTest() override {
    LimitFiles(RLIM_INFINITY);
    std::filesystem::remove_all(folder_);
  }
  static Record RecordAt(int64_t seq) {
    RecordHeader header{};
    header.session = kSession;
    header.stream = static_cast<int32_t>(StreamId::kFrontend);
    header.epoch = header.writer = 1;
    header.seq = seq;
    Bytes bytes = wire::Encode(FramePose());
    Seal(header, channels::kFramePose, bytes);
    return {channels::kFramePose, std::make_shared<const Bytes>(std::move(bytes)), header};
  }
  std::vector<int64_t> Numbers() {
    std::vector<int64_t> numbers;
    kept_->journal().ForEach(
        [&](std::span<const uint8_t> record) { numbers.push_back(ParseHeader(record)->seq); });
    return numbers;
  }

  std::string folder_;
  std::unique_ptr<KeptRecords> kept_;
};

TEST_F(KeptRecordsTest, WhatADiskRefusesWaitsAndIsNotSafe) {
  EXPECT_FALSE(kept_->Keep(RecordAt(1), 0));
  EXPECT_TRUE(kept_->complete());
  LimitFiles(std::filesystem::file_size(JournalPath(folder_)));
  const auto problem = kept_->Keep(RecordAt(2), 0);
  ASSERT_TRUE(problem);
  EXPECT_FALSE(problem->empty());
  EXPECT_FALSE(kept_->Keep(RecordAt(3), 0)) << "it was told already";
  EXPECT_FALSE(kept_->complete());
  kept_->Retry(0);
  EXPECT_FALSE(kept_->complete());

  LimitFiles(RLIM_INFINITY);
  kept_->Retry(0);
  EXPECT_TRUE(kept_->complete());
  EXPECT_EQ(Numbers(), (std::vector<int64_t>{1, 2, 3}));
  LimitFiles(std::filesystem::file_size(JournalPath(folder_)));
  EXPECT_TRUE(kept_->Keep(RecordAt(4), 0)) << "it refuses again";
}

TEST_F(KeptRecordsTest, HowFarStreamsAreThereIsNotedForTheNextOne) {
  EXPECT_EQ(kept_->PositionOf(0), Version());
  kept_->Keep(RecordAt(1), 0);
  kept_->SetPosition(0, {1, 1});
  kept_->NotePosition(0, {1, 1});
  kept_->NotePosition(0, {1, 5});
  kept_->NotePosition(1, {1, 2});
  EXPECT_EQ(kept_->PositionOf(0), (Version{1, 5}));
  std::vector<std::string> notes;
  Journal::Read(
      JournalPath(folder_), kSession, [](std::span<const uint8_t>) {},
      [&](const std::string& note) { notes.push_back(note); });
  EXPECT_EQ(notes, (std::vector<std::string>{"taken 0 1 5", "taken 1 1 2"})) << "what is kept needs no note";

  KeptRecords next(folder_ + "/another");
  for (const std::string& text : notes) {
    std::istringstream note(text.substr(std::string("taken").size()));
    next.ReadNote(note, 1);
  }
  EXPECT_EQ(next.PositionOf(0), (Version{1, 5}));
  EXPECT_EQ(next.PositionOf(1), Version()) << "none of its cameras";
  next.ForgetPositions();
  EXPECT_EQ(next.PositionOf(0), Version());
}

}  // namespace
}  // namespace dmslam
