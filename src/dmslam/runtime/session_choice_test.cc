#include "dmslam/runtime/session_choice.h"

#include <gtest/gtest.h>

#include "dmslam/messaging/protocol_messages.h"

namespace dmslam {
namespace {

class SessionChoiceTest : public testing::Test {
 protected:
  void Say(const std::string& owner, int64_t session, const std::string& name, int64_t utime,
           int32_t state = head_t::STATE_LIVE) {
    head_t head{};
    head.utime = utime;
    head.header.session = session;
    head.header.epoch = 10;
    head.header.writer = session * 100;
    head.state = state;
    head.name = name;
    const Outgoing message = SealedMessage(HeadChannel(owner), head);
    choice_.HearBeacon(message.channel, *message.bytes);
  }
  SessionChoice choice_{1000};
};

TEST_F(SessionChoiceTest, OneSessionIsNoProblem) {
  for (int64_t utime = 1; utime < 10; ++utime) {
    Say("MAPPER", 5, "mapper on A (pid 1)", utime);
    Say("PLAYER", 5, "player on A (pid 2)", utime);
  }
  EXPECT_FALSE(choice_.MayChoose(999));
  EXPECT_TRUE(choice_.MayChoose(1000));
  EXPECT_EQ(choice_.Problem(), "");
  ASSERT_EQ(choice_.sessions().size(), 1U);
  EXPECT_EQ(choice_.sessions().at(5), "player on A (pid 2)") << "by who plays";
}

TEST_F(SessionChoiceTest, TwoAreNamed) {
  for (int64_t utime = 1; utime < 10; ++utime) {
    Say("PLAYER", 6, "player on B (pid 3)", utime);
    Say("PLAYER", 5, "player on A (pid 2)", utime);
  }
  EXPECT_EQ(choice_.Problem(),
            "two sessions are on this bus (5: player on A pid 2; 6: player on B pid 3): choose one with "
            "--session");
}

TEST_F(SessionChoiceTest, WhatWasSaidOnceOrIsClosedIsNoSession) {
  for (int64_t utime = 1; utime < 10; ++utime) {
    Say("PLAYER", 5, "player on A (pid 2)", utime);
    Say("PLAYER", 6, "an echo", 4);
    Say("MAPPER", 7, "mapper on B (pid 3)", utime, head_t::STATE_CLOSED);
  }
  choice_.HearCamera(8, "room", 1);
  EXPECT_EQ(choice_.Problem(), "");
}

TEST_F(SessionChoiceTest, APlayerOfSomebodysOwnCountsByItsCamera) {
  for (int64_t utime = 1; utime < 10; ++utime) Say("PLAYER", 5, "player on A (pid 2)", utime);
  for (int64_t utime = 1; utime < 3; ++utime) choice_.HearCamera(8, "room", utime);
  EXPECT_NE(choice_.Problem().find("8: player of room"), std::string::npos) << choice_.Problem();
}

}  // namespace
}  // namespace dmslam
