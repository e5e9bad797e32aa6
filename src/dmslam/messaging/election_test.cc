#include "dmslam/messaging/election.h"

#include <gtest/gtest.h>

#include <optional>

#include "dmslam/messaging/hand_over.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/messaging/stream_writer.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;

WriterElection::Options Newcomer(bool take_over = false) {
  WriterElection::Options options;
  options.owner = "TEST";
  options.name = "newcomer";
  options.writer = 9;
  options.take_over = take_over;
  return options;
}

StreamWriter OldWriter(int64_t epoch = 1000, int64_t session = 1, int64_t schema = 0) {
  StreamWriter::Options options;
  options.session = session;
  options.owner = "TEST";
  options.name = "mapper on alpha, pid 17";
  options.schema_hash = schema;
  return StreamWriter(options, Term{epoch, 4}, Version{});
}

// Runs both for a while; what each says the other hears.
void Pump(WriterElection* election, StreamWriter* writer, int64_t from_ns, int64_t to_ns) {
  for (int64_t now = from_ns; now < to_ns; now += kMs) {
    if (writer != nullptr) {
      writer->Advance(now);
      for (const Outgoing& out : writer->TakeOutgoing()) election->Receive(out.channel, *out.bytes, now);
      if (writer->close_requested_by()) writer->Close(now);
    }
    election->Advance(now);
    for (const Outgoing& out : election->TakeOutgoing()) {
      if (writer != nullptr) writer->Receive(out.channel, *out.bytes, now);
    }
  }
}

TEST(Election, NobodyHeardMeansWonAfterListening) {
  WriterElection election(Newcomer(), 0);
  Pump(&election, nullptr, 0, 1999 * kMs);
  EXPECT_EQ(election.state(), WriterElection::State::kListening);
  Pump(&election, nullptr, 1999 * kMs, 2001 * kMs);
  EXPECT_EQ(election.state(), WriterElection::State::kWon);
  EXPECT_EQ(election.Win(5000), (Term{5000, 9}));
  EXPECT_FALSE(election.predecessor());
}

TEST(Election, APrivateSystemNeedNotListen) {
  WriterElection::Options options = Newcomer();
  options.listen_ns = 0;
  WriterElection election(options, 0);
  election.Advance(0);
  EXPECT_EQ(election.state(), WriterElection::State::kWon);
}

TEST(Election, ALiveWriterMeansRefusalThatNamesIt) {
  WriterElection election(Newcomer(), 0);
  StreamWriter writer = OldWriter();
  Pump(&election, &writer, 0, 2500 * kMs);
  EXPECT_EQ(election.state(), WriterElection::State::kRefused);
  EXPECT_NE(election.refusal().find("mapper on alpha, pid 17"), std::string::npos);
  EXPECT_NE(election.refusal().find("--take-over"), std::string::npos);
  EXPECT_FALSE(writer.superseded_by());
}

TEST(Election, AForgedBeaconFromTheFutureLetsNoSecondWriterIn) {
  WriterElection election(Newcomer(), 0);
  StreamWriter writer = OldWriter();
  writer.Advance(0);
  for (const Outgoing& out : writer.TakeOutgoing()) {
    std::optional<head_t> head = DecodeHead(out.channel, *out.bytes);
    ASSERT_TRUE(head);
    head->utime += 3'600'000'000;
    election.Receive(out.channel, *SealedMessage(out.channel, *head).bytes, 0);
  }
  Pump(&election, &writer, kMs, 2500 * kMs);
  EXPECT_EQ(election.state(), WriterElection::State::kRefused);
}

TEST(Election, ALateEchoOfADeadWriterIsNoRefusalButCountsForTheTerm) {
  WriterElection election(Newcomer(), 0);
  StreamWriter writer = OldWriter(7000);
  writer.Advance(0);
  const std::vector<Outgoing> last_words = writer.TakeOutgoing();
  for (int i = 0; i < 3; ++i) election.Receive(last_words.at(0).channel, *last_words.at(0).bytes, 0);
  Pump(&election, nullptr, 0, 2500 * kMs);
  ASSERT_EQ(election.state(), WriterElection::State::kWon);
  EXPECT_EQ(election.Win(5000), (Term{7001, 9}));
}

TEST(Election, ToldToTakeOverItAsksAndWaitsUntilTheOldOneHasClosed) {
  WriterElection election(Newcomer(true), 0);
  StreamWriter writer = OldWriter();
  Pump(&election, &writer, 0, 1000 * kMs);
  EXPECT_EQ(writer.close_requested_by(), "newcomer");
  EXPECT_TRUE(writer.closed());
  EXPECT_EQ(election.state(), WriterElection::State::kWon);
  EXPECT_EQ(election.predecessor(), (Version{1000, 0}));
}

TEST(Election, AWriterThatDoesNotCloseIsOverruledInTheEnd) {
  WriterElection election(Newcomer(true), 0);
  StreamWriter stubborn = OldWriter();
  for (int64_t now = 0; now < 11000 * kMs; now += 10 * kMs) {
    stubborn.Advance(now);
    for (const Outgoing& out : stubborn.TakeOutgoing()) election.Receive(out.channel, *out.bytes, now);
    election.Advance(now);
    EXPECT_TRUE(now > 9000 * kMs || election.state() != WriterElection::State::kWon);
  }
  EXPECT_EQ(election.state(), WriterElection::State::kWon);
  EXPECT_GT(election.Win(1), stubborn.term());
}

TEST(Election, AWriterWithOtherTypesIsNotTakenOver) {
  WriterElection election(Newcomer(true), 0);
  StreamWriter writer = OldWriter(1000, 1, 77);
  Pump(&election, &writer, 0, 1000 * kMs);
  EXPECT_EQ(election.state(), WriterElection::State::kRefused);
  EXPECT_NE(election.refusal().find("message types"), std::string::npos);
}

TEST(Election, OtherSessionsAreNotHeard) {
  WriterElection election(Newcomer(), 0);
  StreamWriter writer = OldWriter(1000, 2);
  Pump(&election, &writer, 0, 2500 * kMs);
  EXPECT_EQ(election.state(), WriterElection::State::kWon);
}

TEST(Election, AWriterHeardOnlyAfterTheVictoryTurnsItIntoARefusal) {
  WriterElection election(Newcomer(), 0);
  Pump(&election, nullptr, 0, 2500 * kMs);
  ASSERT_EQ(election.state(), WriterElection::State::kWon);
  StreamWriter writer = OldWriter();
  Pump(&election, &writer, 2500 * kMs, 3000 * kMs);
  EXPECT_EQ(election.state(), WriterElection::State::kRefused);
}

// A search and some holders on one wire.
struct Holders {
  ReplicaSearch search;
  std::vector<ReplicaHolder> holders;
  explicit Holders(std::vector<std::string> roles) : search(Options(std::move(roles)), 0) {}
  static ReplicaSearch::Options Options(std::vector<std::string> roles) {
    ReplicaSearch::Options options;
    options.asker = 9;
    options.roles = std::move(roles);
    return options;
  }
  void Add(const std::string& role, int64_t id, Version held) {
    holders.emplace_back(ReplicaHolder::Options{1, StreamId::kMap, "MAPPER", role, role, id},
                         [held] { return held; });
  }
  void Pump(int64_t from_ns, int64_t to_ns) {
    for (int64_t now = from_ns; now < to_ns; now += 10 * kMs) {
      search.Advance(now);
      for (const Outgoing& out : search.TakeOutgoing()) {
        for (ReplicaHolder& holder : holders) holder.Receive(out.channel, *out.bytes, now);
      }
      for (ReplicaHolder& holder : holders) {
        for (const Outgoing& out : holder.TakeOutgoing()) search.Receive(out.channel, *out.bytes, now);
      }
    }
  }
};

TEST(ReplicaSearch, ChoosesTheNewestWhenAllHaveAnswered) {
  Holders world({"frontend", "loopcloser"});
  world.Add("frontend", 21, {1000, 7});
  world.Add("loopcloser", 22, {1000, 8});
  world.Pump(0, 300 * kMs);
  ASSERT_EQ(world.search.state(), ReplicaSearch::State::kFound);
  EXPECT_EQ(world.search.replica().holder, 22);
  EXPECT_EQ(world.search.replica().version, (Version{1000, 8}));
  EXPECT_FALSE(world.holders[0].chosen_by());
  EXPECT_EQ(world.holders[1].chosen_by(), 9);
}

TEST(ReplicaSearch, WaitsForARoleUntilItIsKnownToBeAbsent) {
  Holders world({"frontend", "loopcloser"});
  world.Add("frontend", 21, {1000, 7});
  world.Pump(0, 4900 * kMs);
  EXPECT_EQ(world.search.state(), ReplicaSearch::State::kAsking);
  world.Pump(4900 * kMs, 5100 * kMs);
  EXPECT_EQ(world.search.state(), ReplicaSearch::State::kFound);
}

TEST(ReplicaSearch, HoldersOfNothingMeanNoReplica) {
  Holders world({"frontend"});
  world.Add("frontend", 21, {});
  world.Pump(0, 100 * kMs);
  EXPECT_EQ(world.search.state(), ReplicaSearch::State::kNone);
}

}  // namespace
}  // namespace dmslam
