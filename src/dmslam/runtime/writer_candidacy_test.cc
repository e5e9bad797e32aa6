#include "dmslam/runtime/writer_candidacy.h"

#include <gtest/gtest.h>

#include "dmslam/messaging/bus.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;

/// Processes that want to write the same stream, on one bus.
class WriterCandidacyTest : public testing::Test {
 protected:
  struct Process {
    std::unique_ptr<Endpoint> endpoint;
    std::unique_ptr<WriterCandidacy> candidacy;
  };

  Process Stand(int64_t id, bool may_be_contested, bool take_over = true) {
    Process process;
    process.endpoint = std::make_unique<Endpoint>(&bus_.AddPort(), [this] { return now_ns_; });
    WriterElection::Options options;
    options.owner = "MAPPER";
    options.name = "mapper " + std::to_string(id);
    options.writer = id;
    options.take_over = take_over;
    options.listen_ns = 10 * kMs;
    process.candidacy = std::make_unique<WriterCandidacy>(options, may_be_contested, Readers(),
                                                          process.endpoint.get(), now_ns_);
    return process;
  }
  void Open(Process* process, int64_t wall_us) {
    ASSERT_TRUE(process->candidacy->IsWon());
    process->candidacy->Open(writer_options_, Version{}, nullptr, wall_us, now_ns_);
  }
  void Run(int64_t ns, std::initializer_list<Process*> processes) {
    for (const int64_t until_ns = now_ns_ + ns; now_ns_ < until_ns; now_ns_ += kMs) {
      for (Process* process : processes) process->endpoint->Advance();
      while (bus_.DeliverOne()) {
      }
    }
  }
  static std::vector<std::string> Readers() { return {"COLLECTOR"}; }

  MemoryBus bus_;
  int64_t now_ns_ = 1'000'000 * kMs;
  StreamWriter::Options writer_options_ = [] {
    StreamWriter::Options options;
    options.owner = "MAPPER";
    options.name = "mapper";
    return options;
  }();
};

TEST_F(WriterCandidacyTest, WhoCannotBeContestedWritesAtOnce) {
  Process one = Stand(1, false);
  EXPECT_FALSE(one.candidacy->IsWon()) << "it listens first";
  Run(20 * kMs, {&one});
  Open(&one, 1'000'000'000);
  EXPECT_NE(one.candidacy->TakeSettled(now_ns_), nullptr);
}

TEST_F(WriterCandidacyTest, WhoTakesOverWritesWhenNobodyElseHasSaidSo) {
  Process one = Stand(1, true);
  Run(20 * kMs, {&one});
  Open(&one, 1'000'000'000);
  EXPECT_NE(one.candidacy->writer(), nullptr);
  EXPECT_EQ(one.candidacy->deadline_ns(), now_ns_ + 300 * kMs);
  Run(299 * kMs, {&one});
  EXPECT_EQ(one.candidacy->TakeSettled(now_ns_), nullptr);
  Run(1 * kMs, {&one});
  EXPECT_NE(one.candidacy->TakeSettled(now_ns_), nullptr);
}

TEST_F(WriterCandidacyTest, OfTwoThatTakeOverAtOnceTheHigherTermWrites) {
  Process lower = Stand(1, true), higher = Stand(2, true);
  Run(20 * kMs, {&lower, &higher});
  Open(&lower, 1'000'000'000);
  Open(&higher, 1'000'000'001);
  Run(400 * kMs, {&lower, &higher});
  EXPECT_EQ(lower.candidacy->TakeSettled(now_ns_), nullptr);
  EXPECT_TRUE(lower.candidacy->writer()->superseded_by());
  EXPECT_NE(higher.candidacy->TakeSettled(now_ns_), nullptr);
}

TEST_F(WriterCandidacyTest, WhoMayNotTakeOverIsRefusedByName) {
  Process present = Stand(1, false);
  Run(20 * kMs, {&present});
  Open(&present, 1'000'000'000);
  const auto writer = present.candidacy->TakeSettled(now_ns_);
  Process late = Stand(2, false, false);
  Run(2'000 * kMs, {&present, &late});
  ASSERT_TRUE(late.candidacy->Refusal());
  EXPECT_NE(late.candidacy->Refusal()->find("mapper"), std::string::npos);
  EXPECT_FALSE(late.candidacy->IsWon());
}

}  // namespace
}  // namespace dmslam
