#include "collector/process_ledger.h"

#include <gtest/gtest.h>

#include <sstream>
#include <vector>

namespace dmslam {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

class ProcessLedgerTest : public testing::Test {
 protected:
  ProcessLedgerTest() {
    run_.cameras.resize(1);
    ledger_.Begin([this](const std::string& note) { notes_.push_back(note); }, Health(100, 0), 0);
  }
  static ProcessHealth Health(int32_t pid, double uptime_s, int64_t lost = 0, double rss_mb = 0) {
    ProcessHealth health;
    health.pid = pid;
    health.uptime_s = uptime_s;
    health.records_lost = lost;
    health.rss_mb = rss_mb;
    return health;
  }
  static FrontendStatus Frontend(int32_t pid, double uptime_s, int64_t processed) {
    FrontendStatus status;
    status.head.health = Health(pid, uptime_s);
    status.frames_processed = processed;
    return status;
  }
  /// What a ledger knows that reads these notes.
  static RunRecord Read(const std::vector<std::string>& notes) {
    RunRecord run;
    run.cameras.resize(1);
    ProcessLedger next(&run);
    for (const std::string& text : notes) {
      std::istringstream note(text);
      std::string kind;
      note >> kind;
      next.ReadNote(kind, note, 0);
    }
    return run;
  }

  RunRecord run_;
  ProcessLedger ledger_{&run_};
  std::vector<std::string> notes_;
};

TEST_F(ProcessLedgerTest, CountersOfTheOneBeforeAreAdded) {
  ledger_.Hear("mapper", Health(1, 10, 3, 50), 0, 10 * kSecond);
  ledger_.Hear("mapper", Health(2, 0.5, 1, 20), 0, 11 * kSecond);
  EXPECT_EQ(run_.restarts, 1);
  EXPECT_EQ(run_.health["mapper"].records_lost, 4);
  EXPECT_EQ(run_.health["mapper"].rss_mb, 50) << "the largest of them all";
  ledger_.Hear("mapper", Health(2, 1.5, 2, 20), 0, 12 * kSecond);
  EXPECT_EQ(run_.health["mapper"].records_lost, 5);
}

TEST_F(ProcessLedgerTest, OneWithTheSameIdIsCountedToo) {
  ledger_.HearFrontend("frontend", Frontend(1, 10, 40), 0, 10 * kSecond);
  ledger_.HearFrontend("frontend", Frontend(1, 0.5, 2), 0, 12 * kSecond);
  EXPECT_EQ(run_.restarts, 1);
  EXPECT_EQ(run_.cameras[0].frontend.frames_processed, 42);
}

TEST_F(ProcessLedgerTest, ItsNotesTellTheNextOne) {
  ledger_.HearFrontend("frontend", Frontend(7, 10, 40), 0, 10 * kSecond);
  ledger_.HearFrontend("frontend", Frontend(8, 0.5, 2), 0, 11 * kSecond);
  ledger_.NoteCounters();
  const RunRecord run = Read(notes_);
  EXPECT_EQ(run.restarts, 1);
  EXPECT_EQ(run.cameras[0].frontend.frames_processed, 42);
}

TEST_F(ProcessLedgerTest, ACollectorThatWasStartedAgainIsOneMore) {
  RunRecord run;
  run.cameras.resize(1);
  ProcessLedger next(&run);
  std::istringstream note("collector 100");
  next.ReadNote("process", note, 0);
  next.Begin([](const std::string&) {}, Health(100, 0), 0);
  EXPECT_EQ(run.restarts, 1) << "whatever its id";
}

TEST(ProcessLedger, WhoIsHeardBeforeThereIsAJournalIsNotedWhenThereIs) {
  RunRecord run;
  run.cameras.resize(1);
  ProcessLedger ledger(&run);
  ProcessHealth mapper;
  mapper.pid = 5;
  ledger.Hear("mapper", mapper, 0, 0);
  std::vector<std::string> notes;
  ledger.Begin([&](const std::string& note) { notes.push_back(note); }, {}, 0);
  EXPECT_EQ(notes.back(), "process mapper 5");
}

}  // namespace
}  // namespace dmslam
