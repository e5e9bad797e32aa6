#include "player/asking_player.h"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/testing/node_on_bus.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;

/// Stands for the player itself.
class Played : public Node {
 public:
  void Advance() override {}
  int64_t deadline_ns() const override { return 77; }
  void Stop() override { code_ = 5; }
  std::optional<int> exit_code() const override { return code_; }

 private:
  std::optional<int> code_;
};

/// A player without a session, on a bus where others may write theirs.
class AskingPlayerTest : public testing::Test {
 protected:
  void Start(CameraId camera_id = 0, bool fresh_system = false) {
    NodeContext context = ContextOnBus(&port_, &now_ns_, "player");
    context.random_id = 2 * 123'456 + 1;
    context.fresh_system = fresh_system;
    player_ = std::make_unique<AskingPlayer>(std::move(context), camera_id, camera_id + 1,
                                             [this](uint32_t session) {
                                               played_.push_back(session);
                                               return std::make_unique<Played>();
                                             });
  }
  /// Of a writer, as it stands in its beacon.
  void Write(const std::string& owner, int64_t session) { writers_[owner] = session; }
  void Pass(int64_t ms) {
    for (int64_t i = 0; i < ms; i += 50, now_ns_ += 50 * kMs) {
      for (const auto& [owner, session] : writers_) SayBeacon(owner, session);
      DeliverAll(bus_);
      player_->Advance();
    }
  }
  void SayBeacon(const std::string& owner, int64_t session) {
    head_t head{};
    head.utime = now_ns_ / 1000;
    head.header.session = session;
    head.header.epoch = 10;
    head.header.writer = session * 100;
    head.state = head_t::STATE_LIVE;
    head.name = owner + " on host (pid " + std::to_string(session) + ")";
    const Outgoing message = SealedMessage(HeadChannel(owner), head);
    SayBytes(others_, message.channel, *message.bytes);
  }

  MemoryBus bus_;
  MemoryBus::Port& port_ = bus_.AddPort();
  MemoryBus::Port& others_ = bus_.AddPort();
  int64_t now_ns_ = 1'000'000'000;
  std::map<std::string, int64_t> writers_;
  std::unique_ptr<AskingPlayer> player_;
  std::vector<uint32_t> played_;  ///< the session in which it plays
};

using Sessions = std::vector<uint32_t>;

TEST_F(AskingPlayerTest, WhereThereIsNoSessionTheFirstCamerasPlayerDrawsOne) {
  Start();
  Pass(950);
  EXPECT_EQ(played_, Sessions()) << "it listens first";
  Pass(200);
  EXPECT_EQ(played_, Sessions{123'457});
  EXPECT_EQ(player_->deadline_ns(), 77) << "from now on it is the player itself";
  player_->Stop();
  EXPECT_EQ(player_->exit_code(), 5);
}

TEST_F(AskingPlayerTest, WhereNobodyElseCanWriteItDoesNotListen) {
  Start(0, true);
  player_->Advance();
  EXPECT_EQ(played_, Sessions{123'457});
}

TEST_F(AskingPlayerTest, TheOnlySessionOfTheBusIsTaken) {
  for (const CameraId camera : {0, 1}) {
    Write("MAPPER", 7);
    Start(camera);
    Pass(1200);
  }
  EXPECT_EQ(played_, (Sessions{7, 7}));
}

TEST_F(AskingPlayerTest, OfTwoSessionsNoneIsGuessed) {
  Write("MAPPER", 7);
  Write("PLAYER", 8);
  for (const CameraId camera : {0, 1}) {
    Start(camera);
    Pass(1200);
    EXPECT_EQ(player_->exit_code(), kExitMisfit);
    EXPECT_EQ(player_->problem(),
              "two sessions are on this bus (7: MAPPER on host pid 7; 8: PLAYER on host pid 8): choose one "
              "with --session");
  }
  EXPECT_EQ(played_, Sessions());
}

TEST_F(AskingPlayerTest, AFurtherCamerasPlayerWaitsForASession) {
  Start(1);
  Pass(5000);
  EXPECT_EQ(played_, Sessions());
  EXPECT_EQ(player_->deadline_ns(), INT64_MAX) << "nothing is to be done until somebody says something";
  Write("PLAYER", 9);
  Pass(200);
  EXPECT_EQ(played_, Sessions{9});
}

TEST_F(AskingPlayerTest, APlayerOfSomebodysOwnIsKnownByItsCamera) {
  CameraInfo info;
  info.session = 11;
  info.camera = TestCamera();
  Start();
  for (int i = 0; i < 4; ++i) {
    info.utime = now_ns_ / 1000;
    Say(others_, info);
    Pass(500);
  }
  EXPECT_EQ(played_, Sessions{11});
}

TEST_F(AskingPlayerTest, WhoIsStoppedWhileItAsksEndsWell) {
  Start(1);
  Pass(100);
  player_->Stop();
  EXPECT_EQ(player_->exit_code(), kExitDone);
}

}  // namespace
}  // namespace dmslam
