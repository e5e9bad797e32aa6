#include "dmslam/messaging/event_log.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <lcm/lcm-cpp.hpp>

#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

class EventLog : public testing::Test {
 protected:
  void SetUp() override {
    path_ =
        std::filesystem::temp_directory_path() / ("event_log_test_" + std::to_string(getpid()) + ".lcmlog");
    EventLogWriter writer(path_);
    for (int i = 0; i < kEvents; ++i) {
      Bytes bytes(static_cast<size_t>(100 * i + 1), static_cast<uint8_t>(i));
      writer.Write(1'000'000 + 1000 * i, "DMSLAM_TEST_" + std::to_string(i % 3), bytes);
    }
    writer.Close();
    std::ifstream file(path_, std::ios::binary);
    whole_.assign(std::istreambuf_iterator<char>(file), {});
  }
  void TearDown() override { std::filesystem::remove(path_); }

  static int64_t OffsetOf(int event) {
    int64_t offset = 0;
    for (int i = 0; i < event; ++i) offset += 28 + 13 + 100 * i + 1;
    return offset;
  }
  void Damage(const std::string& content) {
    std::ofstream file(path_, std::ios::binary | std::ios::trunc);
    file << content;
  }
  /// The numbers of the events that are read; each must be as it was written.
  std::vector<int64_t> ReadAll(EventLogReader* reader) {
    std::vector<int64_t> numbers;
    while (const auto event = reader->Next()) {
      numbers.push_back(event->number);
      EXPECT_EQ(event->channel, "DMSLAM_TEST_" + std::to_string(event->number % 3));
      EXPECT_EQ(event->utime_us, 1'000'000 + 1000 * event->number);
      EXPECT_EQ(event->bytes,
                Bytes(static_cast<size_t>(100 * event->number + 1), static_cast<uint8_t>(event->number)));
    }
    return numbers;
  }
  static std::vector<int64_t> AllBut(const std::vector<int64_t>& lost) {
    std::vector<int64_t> numbers;
    for (int64_t i = 0; i < kEvents; ++i) {
      if (std::find(lost.begin(), lost.end(), i) == lost.end()) numbers.push_back(i);
    }
    return numbers;
  }

  static constexpr int kEvents = 10;
  std::string path_, whole_;
};

TEST_F(EventLog, ReadsWhatWasWritten) {
  EventLogReader reader(path_);
  EXPECT_EQ(ReadAll(&reader), AllBut({}));
  EXPECT_TRUE(reader.gaps().empty());
  EXPECT_EQ(reader.DescribeGaps(), "");
}

TEST_F(EventLog, IsTheLogOfLcm) {
  lcm::LogFile ours(path_, "r");
  ASSERT_TRUE(ours.good());
  int read = 0;
  while (const lcm::LogEvent* event = ours.readNextEvent()) {
    EXPECT_EQ(event->eventnum, read);
    EXPECT_EQ(event->datalen, 100 * read + 1);
    ++read;
  }
  EXPECT_EQ(read, kEvents);

  const std::string theirs_path = path_ + ".theirs";
  {
    lcm::LogFile theirs(theirs_path, "w");
    uint8_t data[] = {1, 2, 3};
    lcm::LogEvent event{};
    event.timestamp = 77;
    event.channel = "CHANNEL";
    event.datalen = 3;
    event.data = data;
    ASSERT_EQ(theirs.writeEvent(&event), 0);
  }
  EventLogReader reader(theirs_path);
  const auto event = reader.Next();
  std::filesystem::remove(theirs_path);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->channel, "CHANNEL");
  EXPECT_EQ(event->utime_us, 77);
  EXPECT_EQ(event->bytes, (Bytes{1, 2, 3}));
}

TEST_F(EventLog, ATruncatedOneIsReadUpToItsLastWholeEvent) {
  for (const int64_t cut : {OffsetOf(9) + 5, OffsetOf(9) + 30, OffsetOf(10) - 1}) {
    Damage(whole_.substr(0, static_cast<size_t>(cut)));
    EventLogReader reader(path_);
    EXPECT_EQ(ReadAll(&reader), AllBut({9}));
    ASSERT_EQ(reader.gaps().size(), 1u);
    EXPECT_EQ(reader.gaps()[0].offset, OffsetOf(9));
    EXPECT_EQ(reader.gaps()[0].num_bytes, cut - OffsetOf(9));
    EXPECT_NE(reader.DescribeGaps().find("its end"), std::string::npos);
  }
}

TEST_F(EventLog, GoesOnAfterOverwrittenBytes) {
  std::string content = whole_;
  for (int64_t i = OffsetOf(4) - 10; i < OffsetOf(4) + 40; ++i) content[static_cast<size_t>(i)] = '\x55';
  Damage(content);
  EventLogReader reader(path_);
  EXPECT_EQ(ReadAll(&reader), AllBut({3, 4}));
  ASSERT_EQ(reader.gaps().size(), 1u);
  EXPECT_EQ(reader.gaps()[0].offset, OffsetOf(3));
  EXPECT_EQ(reader.gaps()[0].num_bytes, OffsetOf(5) - OffsetOf(3));
  EXPECT_EQ(reader.gaps()[0].lost_events, 2);
}

TEST_F(EventLog, BytesThatAreMissingCostTheirEventsOnly) {
  std::string content = whole_;
  content.erase(static_cast<size_t>(OffsetOf(5) + 60),
                static_cast<size_t>(OffsetOf(6) + 50 - OffsetOf(5) - 60));
  Damage(content);
  EventLogReader reader(path_);
  EXPECT_EQ(ReadAll(&reader), AllBut({5, 6}));
  EXPECT_EQ(reader.gaps().size(), 1u);
  EXPECT_EQ(reader.gaps()[0].lost_events, 2);
}

TEST_F(EventLog, AWrongLengthDoesNotSwallowWhatFollows) {
  for (const char length :
       {'\x00', '\x03', '\x7f'}) {  // of event 2: longer than it is, within the file or not
    std::string content = whole_;
    content[static_cast<size_t>(OffsetOf(2) + 26)] = length;
    content[static_cast<size_t>(OffsetOf(2) + 27)] = '\x10';
    Damage(content);
    EventLogReader reader(path_);
    EXPECT_EQ(ReadAll(&reader), AllBut({2}));
    EXPECT_EQ(reader.gaps().size(), 1u);
  }
}

TEST_F(EventLog, NoiseBeforeTheFirstEventIsSkipped) {
  Damage("noise" + whole_);
  EventLogReader reader(path_);
  EXPECT_EQ(ReadAll(&reader), AllBut({}));
  ASSERT_EQ(reader.gaps().size(), 1u);
  EXPECT_EQ(reader.gaps()[0].num_bytes, 5);
}

TEST_F(EventLog, SeekGoesToAnEvent) {
  EventLogReader reader(path_);
  reader.Seek(OffsetOf(7));
  EXPECT_EQ(reader.Next()->number, 7);
  reader.Seek(OffsetOf(1));
  EXPECT_EQ(reader.Next()->number, 1);
  EXPECT_TRUE(reader.gaps().empty());
}

TEST_F(EventLog, WhatIsNoLogIsRefusedByName) {
  Damage("not a log");
  EXPECT_THROW(EventLogReader{path_}, InputError);
  Damage("");
  EXPECT_THROW(EventLogReader{path_}, InputError);
  EXPECT_THROW(EventLogReader{path_ + ".none"}, InputError);
}

TEST_F(EventLog, AFolderIsCalledOne) {
  const std::string folder = std::filesystem::temp_directory_path().string();
  try {
    EventLogReader reader(folder);
    FAIL() << "a folder was read";
  } catch (const InputError& error) {
    EXPECT_EQ(error.what(), folder + ": is a folder; give the log or the saved map itself");
  }
}

TEST_F(EventLog, RandomDamageNeverStopsIt) {
  Random random(7);
  for (int round = 0; round < 300; ++round) {
    std::string content = whole_;
    for (int i = 0; i < 1 + round % 20; ++i) {
      content[random.Below(static_cast<uint32_t>(content.size()))] = static_cast<char>(random.Below(256));
    }
    content.resize(1 + random.Below(static_cast<uint32_t>(content.size())));
    content = whole_.substr(0, static_cast<size_t>(OffsetOf(1))) + content;  // one event is whole
    Damage(content);
    EventLogReader reader(path_);
    int64_t end = 0, events = 0;
    while (const auto event = reader.Next()) {
      EXPECT_GE(event->offset, end);
      end = event->offset + 28 + static_cast<int64_t>(event->channel.size() + event->bytes.size());
      EXPECT_LE(end, static_cast<int64_t>(content.size()));
      ++events;
    }
    EXPECT_GE(events, 1);
  }
}

TEST_F(EventLog, ALogThatWasRecordedUnderAKeyIsReadWithoutItsTags) {
  const BusKey key(Bytes(32, 1)), other(Bytes(32, 2));
  {
    EventLogWriter writer(path_);
    writer.Write(1, "LCM_SELF_TEST", Bytes{1});
    writer.Write(2, "DMSLAM_TEST_A", key.WithTag("DMSLAM_TEST_A", Bytes{2}, {1, 1, 1}));
    writer.Write(3, "DMSLAM_TEST_A", Bytes{3});
    writer.Write(4, "P_DMSLAM_TEST_A", other.WithTag("DMSLAM_TEST_A", Bytes{4}, {1, 1, 1}));
    writer.Write(5, "P_DMSLAM_TEST_B", key.WithTag("DMSLAM_TEST_B", Bytes{5}, {1, 2, 1}));
    writer.Close();
  }
  const auto read = [](EventLogReader* reader) {
    Bytes contents;
    while (const auto event = reader->Next()) {
      EXPECT_EQ(event->bytes.size(), 1u);
      contents.push_back(event->bytes[0]);
    }
    return contents;
  };
  EventLogReader open(path_), keyed(path_), foreign(path_);
  EXPECT_EQ(read(&open), (Bytes{1, 2, 3, 4, 5}));
  EXPECT_TRUE(keyed.UseKey(key));
  EXPECT_EQ(read(&keyed), (Bytes{2, 5})) << "what a logger recorded of others is left out";
  EXPECT_EQ(keyed.refused(), 2) << "what is not ours is not counted";
  EXPECT_FALSE(foreign.UseKey(BusKey(Bytes(32, 3))));
  EXPECT_EQ(read(&foreign), (Bytes{1, 2, 3, 4, 5})) << "recorded under no key, or another one: as it is";
}

}  // namespace
}  // namespace dmslam
