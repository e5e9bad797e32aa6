#include "collector/process_ledger.h"

#include <gtest/gtest.h>

#include <sstream>
#include <utility>
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
    run.cameras.resize(2);
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

TEST_F(ProcessLedgerTest, ARivalThatIsRefusedDoesNotCount) {
  const auto writing = [](double uptime_s) {
    FrontendStatus status = Frontend(1, uptime_s, 100);
    status.head.health.epoch = 9;
    return status;
  };
  ledger_.HearFrontend("frontend", writing(10), 0, 10 * kSecond);
  for (int64_t s = 11; s < 14; ++s) {
    ledger_.HearFrontend("frontend", Frontend(2, 0.5, 0), 0, s * kSecond - kSecond / 2);
    ledger_.HearFrontend("frontend", writing(static_cast<double>(s)), 0, s * kSecond);
  }
  EXPECT_EQ(run_.restarts, 0);
  EXPECT_EQ(run_.cameras[0].frontend.frames_processed, 100);
  EXPECT_EQ(run_.cameras[0].frontend.head.health.pid, 1);
}

TEST_F(ProcessLedgerTest, WhoFollowsOneThatIsSilentCountsBeforeItWrites) {
  ProcessHealth writing = Health(1, 10, 3);
  writing.epoch = 9;
  EXPECT_TRUE(ledger_.Hear("mapper", writing, 0, 10 * kSecond));
  EXPECT_FALSE(ledger_.Hear("mapper", Health(2, 0), 0, 10 * kSecond + kSecond / 2));
  EXPECT_EQ(run_.restarts, 0) << "it may be a rival";
  EXPECT_FALSE(ledger_.Hear("mapper", Health(3, 0), 0, 11 * kSecond));
  EXPECT_TRUE(ledger_.Hear("mapper", Health(3, 1, 1), 0, 12 * kSecond));
  EXPECT_EQ(run_.restarts, 2) << "the second one died before the third";
  EXPECT_EQ(run_.health["mapper"].records_lost, 4);
}

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

TEST_F(ProcessLedgerTest, OfEachCameraTheFrontendsBeforeAreAdded) {
  run_.cameras.resize(2);
  for (const auto& [pid, skipped] : {std::pair(7, 40), std::pair(8, 2)}) {
    FrontendStatus status = Frontend(pid, 0.5, 10);
    status.camera_id = 1;
    status.frames_skipped = skipped;
    ledger_.HearFrontend("frontend1", status, 0, pid * kSecond);
  }
  EXPECT_EQ(run_.cameras[1].frontend.frames_skipped, 42);
  EXPECT_EQ(run_.cameras[0].frontend.frames_skipped, 0);
  ledger_.NoteCounters();
  EXPECT_EQ(Read(notes_).cameras[1].frontend.frames_skipped, 42) << "and whoever comes next knows it";
}

/// In containers each process has the same id.
TEST_F(ProcessLedgerTest, OneWithTheSameIdThatCameWhileNobodyListenedIsCounted) {
  const auto restarts = [](const std::vector<std::string>& notes, const ProcessHealth& heard) {
    RunRecord run;
    run.cameras.resize(1);
    ProcessLedger next(&run);
    for (const std::string& text : notes) {
      std::istringstream note(text);
      std::string kind;
      note >> kind;
      next.ReadNote(kind, note, 0);
    }
    next.Begin([](const std::string&) {}, Health(100, 0), 0);
    next.Hear("mapper", heard, 0, kSecond);
    return run.restarts - 1;  // the collector itself
  };
  const auto of_term = [](int64_t epoch, double uptime_s) {
    ProcessHealth health = Health(1, uptime_s);
    health.epoch = epoch;
    return health;
  };
  ledger_.Hear("mapper", of_term(0, 0.5), 0, kSecond);
  ledger_.Hear("mapper", of_term(17, 1.5), 0, 2 * kSecond);
  EXPECT_EQ(restarts(notes_, of_term(17, 9)), 0);
  EXPECT_EQ(restarts(notes_, of_term(18, 9)), 1) << "its term was noted as soon as there was one";
  ledger_.Hear("mapper", of_term(17, 30.1234567), 0, 31 * kSecond);
  ledger_.NoteCounters();
  EXPECT_EQ(restarts(notes_, of_term(0, 20)), 1) << "it has run for less than what was noted last";
  EXPECT_EQ(restarts(notes_, of_term(17, 30.1234567)), 0);
  std::vector<std::string> old = notes_;
  std::erase_if(old, [](const std::string& note) { return note.starts_with("heard"); });
  EXPECT_EQ(restarts(old, of_term(18, 20)), 0) << "notes of former versions tell the id alone";
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
  EXPECT_EQ(notes[notes.size() - 2], "process mapper 5");
}

}  // namespace
}  // namespace dmslam
