#include "dmslam/messaging/succession.h"

#include <gtest/gtest.h>

#include <set>

#include "dmslam/hand_over_t.hpp"
#include "dmslam/head_t.hpp"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"

namespace dmslam {
namespace {

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
            OptionsOf(), [this] { return held_; }, &source_) {}
  static ReplicaServer::Options OptionsOf() {
    ReplicaServer::Options options;
    options.holder.session = 7;
    options.holder.stream = StreamId::kMap;
    options.holder.owner = "MAPPER";
    options.holder.holder = "FRONTEND";
    options.holder.role = "frontend";
    options.holder.id = 5;
    return options;
  }
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

}  // namespace
}  // namespace dmslam
