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
    const auto proposal = left_.Next(map_, kOurs);
    return proposal ? std::optional(proposal->id.frame_index()) : std::nullopt;
  }
  LeftKeyframes left_{kSession, 0};
  MapEditor map_{TestCamera(), Pyramid()};
};

TEST_F(LeftKeyframesTest, WhatWasSaidBeforeOurTermIsGivenOnce) {
  EXPECT_EQ(Next(), std::nullopt);
  left_.Hear(Said(7, {99, 8}));
  left_.Hear(Said(7, {99, 8}));
  left_.Hear(Said(9, {99, 8}));
  EXPECT_EQ(Next(), 7U);
  EXPECT_EQ(Next(), 9U);
  left_.Hear(Said(7, {99, 8}));
  EXPECT_EQ(Next(), std::nullopt) << "it is repeated until the map has it";
}

TEST_F(LeftKeyframesTest, WhatTheMapKnowsIsNotLeft) {
  Keyframe keyframe;
  keyframe.id = KeyframeId::Make(kSession, 7);
  keyframe.map_id = 1;
  keyframe.features = MakeFrameFeatures({}, TestCamera(), Pyramid());
  map_.AddKeyframe(keyframe);
  left_.Hear(Said(7, {99, 8}));
  EXPECT_EQ(Next(), std::nullopt);
}

TEST_F(LeftKeyframesTest, OurOwnAndForeignOnesAreNoneAndDamagedOnesNeither) {
  left_.Hear(Said(7, kOurs));
  left_.Hear(Said(8, {101, 3}));
  left_.Hear(Said(9, {99, 8}, kSession + 1));
  Bytes damaged = Said(10, {99, 8});
  damaged[damaged.size() / 2] ^= 1;
  left_.Hear(damaged);
  left_.Hear(Bytes(3));
  EXPECT_EQ(Next(), std::nullopt);
}

}  // namespace
}  // namespace dmslam
