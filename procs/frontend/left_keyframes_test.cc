#include "frontend/left_keyframes.h"

#include <gtest/gtest.h>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/wire/channels.h"
#include "dmslam/wire/codec.h"
#include "dmslam/wire/testing/random_message.h"

namespace dmslam {
namespace {

constexpr uint32_t kSession = 4;
constexpr Term kOurs{100, 1};
constexpr int64_t kUntilNs = 1000;

Bytes Said(uint32_t frame, const Term& term, uint32_t session = kSession) {
  auto proposal = wire::testing::RandomMessage<KeyframeProposal>(frame);
  proposal.camera_id = 0;
  proposal.id = KeyframeId::Make(session, frame);
  proposal.reference = KeyframeId::Make(session, frame - 1);
  Bytes bytes = wire::Encode(proposal);
  RecordHeader header{};
  header.session = session;
  header.stream = static_cast<int32_t>(StreamId::kFrontend);
  header.epoch = term.epoch;
  header.writer = term.writer;
  header.seq = frame;
  Seal(header, channels::kKeyframe, bytes);
  return bytes;
}

class LeftKeyframesTest : public testing::Test {
 protected:
  std::optional<uint32_t> Next() {
    left_.BeginTerm(kOurs, kUntilNs);
    const auto proposal = left_.Next(map_);
    return proposal ? std::optional(proposal->id.frame_index()) : std::nullopt;
  }
  void Hear(const Bytes& bytes, int64_t now_ns = 0) { left_.Hear(bytes, now_ns); }

  LeftKeyframes left_{kSession, 0};
  MapEditor map_{TestCamera(), Pyramid()};
};

TEST_F(LeftKeyframesTest, WhatWasSaidBeforeOurTermIsGivenOnce) {
  EXPECT_EQ(Next(), std::nullopt);
  Hear(Said(7, {99, 8}));
  Hear(Said(7, {99, 8}));
  Hear(Said(9, {99, 8}));
  EXPECT_EQ(Next(), 7U);
  EXPECT_EQ(Next(), 9U);
  Hear(Said(7, {99, 8}));
  EXPECT_EQ(Next(), std::nullopt) << "it is repeated until the map has it";
}

TEST_F(LeftKeyframesTest, WhatTheMapKnowsIsNotLeft) {
  Keyframe keyframe;
  keyframe.id = KeyframeId::Make(kSession, 7);
  keyframe.map_id = 1;
  keyframe.features = MakeFrameFeatures({}, TestCamera(), Pyramid());
  map_.AddKeyframe(keyframe);
  Hear(Said(7, {99, 8}));
  EXPECT_EQ(Next(), std::nullopt);
}

TEST_F(LeftKeyframesTest, OurOwnAndForeignOnesAreNoneAndDamagedOnesNeither) {
  Hear(Said(7, kOurs));
  Hear(Said(8, {101, 3}));
  Hear(Said(9, {99, 8}, kSession + 1));
  Bytes damaged = Said(10, {99, 8});
  damaged[damaged.size() / 2] ^= 1;
  Hear(damaged);
  Hear(Bytes(3));
  EXPECT_EQ(Next(), std::nullopt);
}

TEST_F(LeftKeyframesTest, WhatIsSaidWhenAllOfItHasBeenHeardIsNotLeft) {
  Hear(Said(7, {99, 8}), kUntilNs);
  left_.BeginTerm(kOurs, kUntilNs);
  Hear(Said(8, {99, 8}), kUntilNs - 1);
  Hear(Said(9, {99, 8}), kUntilNs);
  EXPECT_EQ(Next(), 7U) << "before our term begins nobody knows how long it takes";
  EXPECT_EQ(Next(), 8U);
  EXPECT_EQ(Next(), std::nullopt);
}

/// They would take the room of what was left.
TEST_F(LeftKeyframesTest, OurOwnTakeNoRoom) {
  Hear(Said(7, {99, 8}));
  left_.BeginTerm(kOurs, kUntilNs);
  for (uint32_t frame = 20; frame < 60; ++frame) Hear(Said(frame, kOurs));
  EXPECT_EQ(Next(), 7U);
}

}  // namespace
}  // namespace dmslam
