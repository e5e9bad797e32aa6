#include "dmslam/messaging/succession.h"

#include <gtest/gtest.h>

#include <set>

#include "dmslam/hand_over_t.hpp"
#include "dmslam/head_t.hpp"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"

namespace dmslam {
namespace {

ReplicaServer::Options ServerOptions() {
  ReplicaServer::Options options;
  options.holder.session = 7;
  options.holder.stream = StreamId::kMap;
  options.holder.owner = "MAPPER";
  options.holder.holder = "FRONTEND";
  options.holder.role = "frontend";
  options.holder.id = 5;
  return options;
}

class OnePiece : public SnapshotSource {
 public:
  void BeginSnapshot(int64_t) override {}
  Piece NextPiece() override { return {"TEST", Bytes(64), true}; }
};

/// A server whose replica is `held`, asked by one asker.
class ReplicaServerTest : public testing::Test {
 protected:
  ReplicaServerTest()
      : server_(
            ServerOptions(), [this] { return held_; }, &source_) {}
  void Choose(int64_t asker) {
    hand_over_t question{};
    question.utime = ++utime_;
    question.header.session = 7;
    question.header.stream = static_cast<int32_t>(StreamId::kMap);
    question.asker = asker;
    question.chosen = 5;
    const Outgoing message = SealedMessage(HandOverChannel("MAPPER"), question);
    server_.Receive(message.channel, *message.bytes, now_ns_);
  }
  /// Passes time; the epochs under which it was handed over meanwhile.
  std::set<int64_t> Pass(double seconds, bool grows) {
    std::set<int64_t> epochs;
    for (const int64_t end = now_ns_ + static_cast<int64_t>(seconds * 1e9); now_ns_ < end;
         now_ns_ += 10'000'000) {
      if (grows && now_ns_ % 100'000'000 == 0) ++held_.seq;
      server_.Advance(now_ns_);
      for (const Outgoing& message : server_.TakeOutgoing()) {
        const auto head = DecodeHead(message.channel, *message.bytes);
        if (head) epochs.insert(head->header.epoch);
      }
    }
    return epochs;
  }

  OnePiece source_;
  Version held_{3, 100};
  ReplicaServer server_;
  int64_t now_ns_ = 1'000'000'000, utime_ = 0;
};

TEST_F(ReplicaServerTest, AReplicaThatStandsIsHandedOverOnce) {
  Choose(21);
  EXPECT_EQ(Pass(5, false).size(), 1u);
  EXPECT_TRUE(server_.serving());
}

TEST_F(ReplicaServerTest, AReplicaThatGrewIsHandedOverAgain) {
  Choose(21);
  Pass(1, false);
  ++held_.seq;
  EXPECT_EQ(Pass(1, false).size(), 1u) << "it is begun again, once";
  EXPECT_TRUE(server_.serving());
}

/// Who took the replica is gone, or writes the stream now, so that the replica grows and grows.
TEST_F(ReplicaServerTest, BesideALiveWriterItDoesNotBeginAgainForEver) {
  Choose(21);
  Pass(30, true);
  EXPECT_FALSE(server_.serving()) << "nobody has taken anything for long";
  EXPECT_TRUE(Pass(5, true).empty()) << "and nothing is begun any more";
  Choose(22);
  EXPECT_EQ(Pass(1, false).size(), 1u) << "another one who asks gets it";
}

/// Pieces without end, as of a map that takes long to hand over.
class ManyPieces : public SnapshotSource {
 public:
  void BeginSnapshot(int64_t) override { left_ = 600; }
  Piece NextPiece() override {
    replica_t message{};
    message.role = std::string(200, 'x');
    return {"DMSLAM_TEST_X", Encode(message), --left_ == 0};
  }

 private:
  int left_ = 0;
};

/// An owner that starts fetches the replica of a holder, which grows every 50 ms for so long.
class ReplicaFetchTest : public testing::Test {
 protected:
  ReplicaFetchTest()
      : server_(
            ServerOptions(), [this] { return held_; }, &source_),
        fetch_(FetchOptions(), 0) {}
  static ReplicaFetch::Options FetchOptions() {
    ReplicaFetch::Options options;
    options.session = 7;
    options.id = 21;
    options.holders = {{"frontend", "FRONTEND"}};
    return options;
  }
  void Pass(double seconds, bool grows) {
    for (const int64_t end = now_ns_ + static_cast<int64_t>(seconds * 1e9); now_ns_ < end;
         now_ns_ += 2'000'000) {
      if (grows && now_ns_ % 50'000'000 == 0) ++held_.seq;
      fetch_.Advance(now_ns_);
      for (const Outgoing& message : fetch_.TakeOutgoing())
        server_.Receive(message.channel, *message.bytes, now_ns_);
      server_.Advance(now_ns_);
      for (const Outgoing& message : server_.TakeOutgoing())
        fetch_.Receive(message.channel, *message.bytes, now_ns_);
      while (fetch_.Take()) {
      }
    }
  }

  ManyPieces source_;
  Version held_{3, 100};
  ReplicaServer server_;
  ReplicaFetch fetch_;
  int64_t now_ns_ = 0;
};

TEST_F(ReplicaFetchTest, AReplicaThatGrowsForAWhileIsTakenInTheEnd) {
  Pass(5, true);
  EXPECT_EQ(fetch_.state(), ReplicaFetch::State::kReceiving);
  EXPECT_FALSE(fetch_.KeepsGrowing(now_ns_));
  Pass(20, false);
  EXPECT_EQ(fetch_.state(), ReplicaFetch::State::kDone);
  EXPECT_EQ(fetch_.version(), held_);
}

TEST_F(ReplicaFetchTest, AReplicaThatGrowsForEverIsNamed) {
  Pass(15, true);
  EXPECT_EQ(fetch_.state(), ReplicaFetch::State::kReceiving);
  EXPECT_TRUE(fetch_.KeepsGrowing(now_ns_));
}

}  // namespace
}  // namespace dmslam
