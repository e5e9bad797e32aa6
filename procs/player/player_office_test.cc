#include "player/player_office.h"

#include <gtest/gtest.h>

#include <memory>

#include "dmslam/runtime/exit_codes.h"

namespace dmslam {
namespace {

/// Players on one bus; time goes on in steps of 20 ms.
class PlayerOfficeTest : public testing::Test {
 protected:
  struct Player {
    Player(MemoryBus& bus, int64_t id, const int64_t* now_ns, const PlayerOffice::Part& part, bool take_over)
        : endpoint(&bus.AddPort(), [now_ns] { return *now_ns; }),
          office(ContextOf(id, now_ns), part, take_over, &endpoint) {}
    static NodeContext ContextOf(int64_t id, const int64_t* now_ns) {
      NodeContext context;
      context.now_ns = [now_ns] { return *now_ns; };
      context.wall_us = [now_ns] { return *now_ns / 1000; };
      context.random_id = id;
      context.name = "player on host (pid " + std::to_string(id) + ")";
      return context;
    }
    Endpoint endpoint;
    PlayerOffice office;
  };
  Player& Add(uint32_t session = 7, bool take_over = false, CameraId camera_id = 0) {
    players_.push_back(std::make_unique<Player>(bus_, static_cast<int64_t>(players_.size()) + 17, &now_ns_,
                                                PlayerOffice::Part{session, camera_id}, take_over));
    return *players_.back();
  }
  void Pass(double seconds) {
    for (const int64_t end = now_ns_ + static_cast<int64_t>(seconds * 1e9); now_ns_ < end;
         now_ns_ += 20'000'000) {
      for (const auto& player : players_) {
        if (!player->office.exit_code()) player->office.Advance();
      }
      while (bus_.DeliverOne()) {
      }
    }
  }

  MemoryBus bus_;
  int64_t now_ns_ = 1'000'000'000;
  std::vector<std::unique_ptr<Player>> players_;
};

TEST_F(PlayerOfficeTest, ASecondPlayerIsRefusedByNameAndTheFirstGoesOn) {
  Player& first = Add();
  Pass(1.9);
  EXPECT_FALSE(first.office.held()) << "it listens first";
  Pass(0.5);
  ASSERT_TRUE(first.office.held());
  Player& second = Add();
  Pass(10);
  EXPECT_EQ(second.office.exit_code(), kExitPresent);
  EXPECT_FALSE(second.office.held());
  EXPECT_NE(second.office.problem().find("session 7"), std::string::npos);
  EXPECT_NE(second.office.problem().find("pid 17"), std::string::npos) << second.office.problem();
  EXPECT_TRUE(first.office.held());
  EXPECT_EQ(first.office.exit_code(), std::nullopt);
}

TEST_F(PlayerOfficeTest, ItsStatusTellsItsTermAndHowLongItHasRun) {
  Player& player = Add();
  Pass(1);
  EXPECT_EQ(player.office.Health().epoch, 0) << "it listens first";
  Pass(2);
  EXPECT_GT(player.office.Health().epoch, 0);
  EXPECT_NEAR(player.office.Health().uptime_s, 3, 0.1);
}

TEST_F(PlayerOfficeTest, AnotherSessionIsNotItsBusiness) {
  Player& first = Add(7);
  Player& second = Add(8);
  Pass(4);
  EXPECT_TRUE(first.office.held());
  EXPECT_TRUE(second.office.held());
}

TEST_F(PlayerOfficeTest, EachCameraHasAPlayerOfItsOwn) {
  Player& first = Add();
  Player& second = Add(7, false, 1);
  Pass(4);
  EXPECT_TRUE(first.office.held());
  EXPECT_TRUE(second.office.held());
  Player& third = Add(7, false, 1);
  Pass(4);
  EXPECT_EQ(third.office.exit_code(), kExitPresent);
}

TEST_F(PlayerOfficeTest, WhoIsAskedToLeaveLeaves) {
  Player& first = Add();
  Pass(3);
  Player& second = Add(7, true);
  Pass(6);
  EXPECT_EQ(first.office.exit_code(), kExitDone);
  EXPECT_EQ(first.office.problem(), "");
  EXPECT_TRUE(second.office.held());
}

/// Who asks for its place and is not there afterwards, as somebody who forges.
TEST_F(PlayerOfficeTest, WhereNobodyGoesOnItIsToBeStartedAgain) {
  Player& first = Add();
  Pass(3);
  Player& second = Add(7, true);
  for (int i = 0; i < 200 && first.office.held(); ++i) Pass(0.02);
  ASSERT_FALSE(first.office.held()) << "it was asked to leave";
  EXPECT_EQ(first.office.exit_code(), std::nullopt) << "it waits for who has asked";
  ASSERT_FALSE(second.office.held());
  const std::unique_ptr<Player> gone = std::move(players_.back());  // says nothing any more
  players_.pop_back();
  Pass(9);
  EXPECT_EQ(first.office.exit_code(), std::nullopt);
  Pass(2);
  EXPECT_EQ(first.office.exit_code(), kExitSuperseded);
  EXPECT_NE(first.office.problem().find("pid 18"), std::string::npos) << first.office.problem();
}

TEST_F(PlayerOfficeTest, OfTwoThatBeginTogetherOneStops) {
  Player& first = Add();
  Player& second = Add();
  Pass(6);
  EXPECT_NE(first.office.held() && !first.office.exit_code(),
            second.office.held() && !second.office.exit_code());
}

}  // namespace
}  // namespace dmslam
