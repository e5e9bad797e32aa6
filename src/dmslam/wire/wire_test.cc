#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "dmslam/end_of_sequence_t.hpp"
#include "dmslam/frame_pose_t.hpp"
#include "dmslam/frontend_status_t.hpp"
#include "dmslam/map_record_t.hpp"
#include "dmslam/messaging/camera_channels.h"
#include "dmslam/util/check.h"
#include "dmslam/util/version.h"
#include "dmslam/wire/check.h"
#include "dmslam/wire/codec.h"
#include "dmslam/wire/former_types.h"
#include "dmslam/wire/schema.h"
#include "dmslam/wire/streams.h"
#include "dmslam/wire/testing/random_message.h"

namespace dmslam::wire {
namespace {

using testing::Identical;
using testing::RandomMessage;

/// Whether all real numbers of a message are finite.
template <typename T>
bool AllFinite(const T& value) {
  if constexpr (std::is_floating_point_v<T>) {
    return std::isfinite(value);
  } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T> || std::is_same_v<T, std::string> ||
                       std::is_same_v<T, KeyframeId> || std::is_same_v<T, LandmarkId>) {
    return true;
  } else if constexpr (std::is_same_v<T, Eigen::Vector3d>) {
    return value.allFinite();
  } else if constexpr (std::is_same_v<T, Rigid3d>) {
    return value.AllFinite();
  } else if constexpr (std::is_same_v<T, Sim3d>) {
    return value.rotation.coeffs().allFinite() && value.translation.allFinite() && std::isfinite(value.scale);
  } else if constexpr (testing::kIsOptional<T>) {
    return !value.has_value() || AllFinite(*value);
  } else if constexpr (testing::kIsShared<T>) {
    return value == nullptr || AllFinite(*value);
  } else if constexpr (testing::kIsVector<T> || testing::kIsArray<T>) {
    return std::all_of(value.begin(), value.end(), [](const auto& item) { return AllFinite(item); });
  } else {
    return std::apply([](const auto&... members) { return (AllFinite(members) && ...); },
                      testing::TieMembers(value));
  }
}

template <typename Message>
class WireTest : public ::testing::Test {};

template <typename Tuple>
struct AsTypes;
template <typename... Message>
struct AsTypes<std::tuple<Message...>> {
  using type = ::testing::Types<Message...>;
};
struct TypeName {
  template <typename Message>
  static std::string GetName(int) {
    return Info<Message>().type;
  }
};
TYPED_TEST_SUITE(WireTest, AsTypes<Messages>::type, TypeName);

TYPED_TEST(WireTest, RoundTripIsExact) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    const auto message = RandomMessage<TypeParam>(seed);
    const std::vector<uint8_t> bytes = Encode(message);
    std::string reason;
    const std::optional<TypeParam> decoded = Decode<TypeParam>(bytes, &reason);
    ASSERT_TRUE(decoded.has_value()) << "seed " << seed << ": " << reason;
    EXPECT_TRUE(Identical(message, *decoded)) << "seed " << seed;
    EXPECT_EQ(Encode(*decoded), bytes);
  }
}

TYPED_TEST(WireTest, RefusesEveryTruncationAndExtension) {
  std::vector<uint8_t> bytes = Encode(RandomMessage<TypeParam>(3));
  for (size_t length = 0; length < bytes.size(); ++length) {
    // A copy of its own, so that a sanitizer sees a read behind its end.
    const std::vector<uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<ptrdiff_t>(length));
    std::string reason;
    EXPECT_FALSE(Decode<TypeParam>(cut, &reason).has_value()) << length << " of " << bytes.size();
    EXPECT_FALSE(reason.empty());
  }
  bytes.push_back(0);
  EXPECT_FALSE(Decode<TypeParam>(bytes).has_value());
}

TYPED_TEST(WireTest, MutatedBytesAreRefusedOrMakeSense) {
  Random random(DeriveSeed(1, 0, Info<TypeParam>().type));
  int accepted = 0;
  for (int i = 0; i < 5000; ++i) {
    std::vector<uint8_t> bytes = Encode(RandomMessage<TypeParam>(random.Next() % 16));
    const uint32_t changes = 1 + random.Below(4);
    for (uint32_t k = 0; k < changes; ++k) {
      bytes[random.Below(static_cast<uint32_t>(bytes.size()))] = static_cast<uint8_t>(random.Next());
    }
    const std::optional<TypeParam> decoded = Decode<TypeParam>(bytes);
    if (!decoded.has_value()) continue;
    ++accepted;
    EXPECT_TRUE(AllFinite(*decoded));
    const std::optional<TypeParam> again = Decode<TypeParam>(Encode(*decoded));
    ASSERT_TRUE(again.has_value());
    EXPECT_TRUE(Identical(*decoded, *again));
  }
  EXPECT_GT(accepted, 0) << "a mutation within a value that may be anything goes unseen";
}

TYPED_TEST(WireTest, CountsOfAnySizeStayWithinBounds) {
  constexpr std::array<int32_t, 6> kCounts = {
      -1,     std::numeric_limits<int32_t>::min(), std::numeric_limits<int32_t>::max(), 1 << 30, 0x10000000,
      1 << 16};
  const std::vector<uint8_t> bytes = Encode(RandomMessage<TypeParam>(5));
  for (size_t offset = 8; offset + 4 <= bytes.size(); ++offset) {
    for (const int32_t count : kCounts) {
      std::vector<uint8_t> changed = bytes;
      for (int i = 0; i < 4; ++i) {
        changed[offset + static_cast<size_t>(i)] =
            static_cast<uint8_t>(static_cast<uint32_t>(count) >> (24 - 8 * i));
      }
      const std::optional<TypeParam> decoded = Decode<TypeParam>(changed);
      if (decoded.has_value()) {
        EXPECT_TRUE(AllFinite(*decoded));
      }
    }
  }
}

TYPED_TEST(WireTest, NumbersThatAreNoneAreRefused) {
  const std::vector<uint8_t> bytes = Encode(RandomMessage<TypeParam>(7));
  for (size_t offset = 8; offset + 8 <= bytes.size(); ++offset) {
    for (const uint64_t bits : {0x7ff8000000000000ULL, 0x7ff0000000000000ULL, 0x7fc000007fc00000ULL}) {
      std::vector<uint8_t> changed = bytes;
      for (size_t i = 0; i < 8; ++i) changed[offset + i] = static_cast<uint8_t>(bits >> (56 - 8 * i));
      const std::optional<TypeParam> decoded = Decode<TypeParam>(changed);
      if (decoded.has_value()) {
        EXPECT_TRUE(AllFinite(*decoded)) << "at byte " << offset;
      }
    }
  }
}

/// Zero is a checksum like any other: a message that has none is refused.
TYPED_TEST(WireTest, AChecksumOfZeroIsRefused) {
  if (Info<TypeParam>().is_record) return;  // sealed by its stream: stream_test
  std::vector<uint8_t> bytes = Encode(RandomMessage<TypeParam>(3));
  std::fill(bytes.begin() + 16, bytes.begin() + 20, uint8_t{0});
  std::string reason;
  EXPECT_FALSE(Decode<TypeParam>(bytes, &reason).has_value());
  EXPECT_NE(reason.find("its checksum does not fit"), std::string::npos) << reason;
}

TYPED_TEST(WireTest, RefusesOtherTypes) {
  const std::vector<uint8_t> bytes = Encode(RandomMessage<TypeParam>(1));
  testing::ForEachMessage([&]<typename Other>() {
    std::string reason;
    EXPECT_EQ((Decode<Other>(bytes, &reason).has_value()), (std::is_same_v<Other, TypeParam>))
        << Info<Other>().type;
  });
}

TYPED_TEST(WireTest, HeaderIsSecondAndZero) {
  const StructType* type = Schema::OfProject().Find(Info<TypeParam>().type);
  ASSERT_NE(type, nullptr);
  EXPECT_EQ(type->fields[0].name, "utime");
  EXPECT_EQ(type->fields[1].type == "record_header_t", Info<TypeParam>().is_record);
  if (!Info<TypeParam>().is_record) return;
  const std::vector<uint8_t> bytes = Encode(RandomMessage<TypeParam>(1));
  for (size_t i = 16; i < 76; ++i) EXPECT_EQ(bytes[i], 0) << i;
}

TEST(WireTest, BytesOfAFrameDone) {
  const FrameDone done{
      .session = 3, .frame_index = 0x01020304, .stamp_ns = 1'305'031'102'175'304'001, .camera_id = 2};
  const std::vector<uint8_t> bytes = Encode(done);
  ASSERT_EQ(bytes.size(), 44U);
  const std::vector<uint8_t> expected = {
      0x00, 0x04, 0xa2, 0xeb, 0x3b, 0x44, 0x18, 0x48,   // 1305031102175304 us
      0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x03,   // session
      0x00, 0x00, 0x00, 0x02,                           // camera
      0x01, 0x02, 0x03, 0x04,                           // frame index
      0x12, 0x1c, 0x66, 0xdf, 0x81, 0xfe, 0xd9, 0x41};  // nanoseconds
  std::vector<uint8_t> content(bytes.begin() + 8, bytes.end());
  content.erase(content.begin() + 8, content.begin() + 12);  // the checksum
  EXPECT_EQ(content, expected);
}

TEST(WireTest, DamageOutsideTheStreamsIsFound) {
  const FrameDone done{.session = 3, .frame_index = 17, .stamp_ns = 1'305'031'102'175'304'001};
  const std::vector<uint8_t> sound = Encode(done);
  for (size_t at = 8; at < sound.size(); ++at) {
    std::vector<uint8_t> bytes = sound;
    bytes[at] ^= 0x04;
    EXPECT_FALSE(Decode<FrameDone>(bytes).has_value()) << at;
  }
  std::vector<uint8_t> unchecked = sound;
  std::fill(unchecked.begin() + 16, unchecked.begin() + 20, uint8_t{0});  // zero is a checksum like any other
  std::string reason;
  EXPECT_FALSE(Decode<FrameDone>(unchecked, &reason).has_value());
  EXPECT_EQ(reason, "frame_done_t: its checksum does not fit");
}

TEST(WireTest, ReasonNamesTheField) {
  std::vector<uint8_t> bytes = Encode(RandomMessage<Frame>(1));
  bytes[20] = 0xff;  // num_bytes
  std::string reason;
  EXPECT_FALSE(Decode<Frame>(bytes, &reason).has_value());
  EXPECT_EQ(reason, "frame_t: data: negative count");
  bytes = Encode(RandomMessage<KeyframeProposal>(1));
  bytes[76] = 0x70;  // keyframe.num_features
  EXPECT_FALSE(Decode<KeyframeProposal>(bytes, &reason).has_value());
  EXPECT_EQ(reason, "keyframe_t: keyframe.x_q4: too short");
}

TEST(WireTest, KeyframesOfAFirstMapBelongTogether) {
  InitialMap sound;
  for (uint32_t i = 0; sound.between.size() < 2; ++i) sound = testing::RandomMessage<InitialMap>(1 + i);
  ASSERT_NO_THROW(Encode(sound));
  const auto refused = [&](const std::function<void(InitialMap&)>& spoil) {
    InitialMap broken = sound;
    spoil(broken);
    EXPECT_THROW(Encode(broken), InvariantError);
  };
  refused([](InitialMap& m) { m.second.id = m.first.id; });
  refused([](InitialMap& m) { std::swap(m.between[0].keyframe.id, m.between[1].keyframe.id); });
  refused([](InitialMap& m) { m.between[0].keyframe.id = m.second.id; });
  refused([](InitialMap& m) { m.between[0].keyframe.map_id = m.map_id + 1; });
  refused([](InitialMap& m) { m.first.map_id = m.map_id + 1; });
  refused([](InitialMap& m) { m.second.camera_id = static_cast<CameraId>(m.first.camera_id ^ 1); });
}

TEST(WireTest, BrokenMessagesAreNotEncoded) {
  KeyframeProposal keyframe = RandomMessage<KeyframeProposal>(1);
  keyframe.T_cam_reference.translation.x() = std::nan("");
  EXPECT_THROW(Encode(keyframe), InvariantError);
  FrameEvidence evidence = RandomMessage<FrameEvidence>(2, 50);
  std::reverse(evidence.items.begin(), evidence.items.end());
  EXPECT_THROW(Encode(evidence), InvariantError);
  MapDelta delta;
  delta.landmarks.emplace_back();
  EXPECT_THROW(Encode(delta), InvariantError);
}

TEST(WireTest, AStatusIsSentWhateverItHolds) {
  FrontendStatus status;
  status.latency_p50_ms = std::nan("");
  status.head.reason = std::string("a\0b", 3) + "\xff\x1b[31m" + std::string(5000, 'x');
  const std::optional<FrontendStatus> decoded = Decode<FrontendStatus>(Encode(status));
  ASSERT_TRUE(decoded.has_value());
  EXPECT_EQ(decoded->latency_p50_ms, -1);
  EXPECT_EQ(decoded->head.reason.size(), kMaxTextBytes);
  EXPECT_EQ(decoded->head.reason.substr(0, 10), "a?b??[31mx");
}

TEST(WireTest, TheChecksumIsThatOfEveryLanguage) {
  const FrameDone done{.session = 3, .frame_index = 17, .stamp_ns = 1'305'031'102'175'304'001};
  const std::vector<uint8_t> bytes = Encode(done);
  std::vector<uint8_t> blank = bytes;
  std::fill(blank.begin() + 16, blank.begin() + 20, uint8_t{0});
  uint32_t crc = 0xffffffff;  // CRC-32 bit by bit
  for (const uint8_t byte : blank) {
    crc ^= byte;
    for (int i = 0; i < 8; ++i) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xedb88320 : 0);
  }
  crc = ~crc;
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(bytes[16 + i], static_cast<uint8_t>(crc >> (24 - 8 * i)));
}

TEST(WireTest, WhatIsAbsentStaysAbsent) {
  FramePose pose;
  const std::optional<FramePose> nowhere = Decode<FramePose>(Encode(pose));
  ASSERT_TRUE(nowhere.has_value());
  EXPECT_FALSE(nowhere->map_id || nowhere->step_from || nowhere->HasPose());
  EXPECT_TRUE(nowhere->covariance.empty() && nowhere->step_covariance.empty());
  pose.map_id = 1;
  pose.covariance.assign(kPoseCovarianceSize, 0.25);
  pose.step_covariance.assign(kPoseCovarianceSize, 0.5);
  pose.step_from = 0;  // the first frame is one
  const std::optional<FramePose> known = Decode<FramePose>(Encode(pose));
  ASSERT_TRUE(known.has_value());
  EXPECT_TRUE(Identical(pose, *known));
  pose.step_from.reset();
  EXPECT_THROW(Encode(pose), InvariantError) << "a step from nowhere";
  pose.step_covariance.clear();
  pose.covariance.pop_back();
  EXPECT_THROW(Encode(pose), InvariantError);
  pose.covariance.assign(kPoseCovarianceSize, 0.25);
  pose.covariance[6] = -1;  // of y
  EXPECT_THROW(Encode(pose), InvariantError);
}

template <typename Wire>
Wire OnTheWire(const auto& message) {
  const std::vector<uint8_t> bytes = Encode(message);
  Wire wire;
  EXPECT_EQ(wire.decode(bytes.data(), 0, static_cast<int>(bytes.size())), static_cast<int>(bytes.size()));
  return wire;
}

TEST(WireTest, EveryRecordIsOfOneStreamAndCarriesItsWritersName) {
  std::multiset<std::string> listed, records;
  for (const StreamId stream : {StreamId::kFrontend, StreamId::kMap, StreamId::kLoopCloser}) {
    const StreamPlan& plan = PlanOf(stream);
    for (const std::string& channel : plan.records) {
      EXPECT_TRUE(channel.starts_with("DMSLAM_" + OwnerName(plan.writer) + "_")) << channel;
      listed.insert(channel);
    }
  }
  for (const MessageInfo& info : AllInfos()) {
    if (info.is_record) records.insert(info.channel);
  }
  EXPECT_EQ(listed, records);
}

TEST(WireTest, ReadersAreOfEachCamera) {
  EXPECT_EQ(ReadersOf(StreamId::kMap, 2),
            (std::vector<std::string>{"frontend", "frontend1", "loopcloser", "collector"}));
  EXPECT_EQ(ReadersOf(StreamId::kFrontend, 2), (std::vector<std::string>{"mapper", "collector"}));
  EXPECT_THROW(PlanOf(StreamId::kTest), InvariantError);
}

TEST(WireTest, AStateHasOneMeaning) {
  FramePose pose;
  pose.state = TrackingState::kMissing;
  EXPECT_EQ(OnTheWire<frame_pose_t>(pose).state, frame_pose_t::STATE_MISSING);
  EXPECT_EQ(Decode<FramePose>(Encode(pose))->state, TrackingState::kMissing);
  FrontendStatus status;
  status.state = TrackingState::kMissing;
  EXPECT_EQ(OnTheWire<frontend_status_t>(status).state, frame_pose_t::STATE_MISSING);
  pose.reference = KeyframeId::Make(1, 7);
  EXPECT_THROW(Encode(pose), InvariantError) << "a pose, and none";
  pose.state = TrackingState::kUncertain;
  EXPECT_EQ(OnTheWire<frame_pose_t>(pose).state, frame_pose_t::STATE_UNCERTAIN);
  pose.reference.reset();
  EXPECT_TRUE(Decode<FramePose>(Encode(pose)).has_value()) << "as older logs have it";
}

TEST(WireTest, WhatIsAbsentTravelsAsZeroOrMinusOne) {
  MapDelta delta;
  delta.keyframes.resize(1);
  delta.keyframes[0].id = delta.observations.emplace_back().keyframe = KeyframeId::Make(1, 7);
  delta.keyframes[0].map_id = 1;
  delta.landmark_tombstones.resize(1);
  delta.landmark_tombstones[0].id = LandmarkId::Make(1, 9);
  delta.landmark_evidence.resize(1);
  delta.landmark_evidence[0].id = LandmarkId::Make(1, 8);
  const auto record = OnTheWire<map_record_t>(delta);
  EXPECT_EQ(record.kf_parent[0], 0);
  EXPECT_EQ(record.observation_landmark[0], 0);
  EXPECT_EQ(record.dead_lm_replaced_by[0], 0);
  EXPECT_EQ(record.evidence_last_moved_ns[0], 0);
  const std::optional<MapDelta> back = Decode<MapDelta>(Encode(delta));
  ASSERT_TRUE(back.has_value());
  EXPECT_TRUE(Identical(delta, *back));

  FrontendStatus status;
  EXPECT_EQ(OnTheWire<frontend_status_t>(status).frame_index, -1);
  EXPECT_EQ(OnTheWire<frontend_status_t>(status).first_map_s, -1);
  EXPECT_TRUE(Identical(status, *Decode<FrontendStatus>(Encode(status))));
  EndOfSequence end;
  end.session = 1;
  EXPECT_EQ(OnTheWire<end_of_sequence_t>(end).last_frame_index, -1);
  EXPECT_TRUE(Identical(end, *Decode<EndOfSequence>(Encode(end))));
}

TEST(WireTest, AbsentStampsAndCapturesAtZeroAreTwoThings) {
  MapReset reset{1, MapReset::Fate::kKeep, "lost", {}};
  EXPECT_FALSE(Decode<MapReset>(Encode(reset))->stamp_ns.has_value());
  reset.stamp_ns = 0;
  EXPECT_EQ(Decode<MapReset>(Encode(reset))->stamp_ns, 0);
  reset.map_id = 0;
  EXPECT_THROW(Encode(reset), InvariantError) << "a reset is of a map";
}

TEST(WireTest, AStampOfZeroAtWhichALandmarkMovedTravelsAsNone) {
  MapDelta delta;
  delta.landmark_evidence.resize(2);
  for (uint32_t i = 0; i < 2; ++i) {
    delta.landmark_evidence[i].id = LandmarkId::Make(1, 8 + i);
    delta.landmark_evidence[i].evidence.last_moved_ns = i;
  }
  EXPECT_EQ(OnTheWire<map_record_t>(delta).evidence_last_moved_ns, (std::vector<int64_t>{0, 1}));
  const std::optional<MapDelta> back = Decode<MapDelta>(Encode(delta));
  ASSERT_TRUE(back.has_value());
  EXPECT_FALSE(back->landmark_evidence[0].evidence.last_moved_ns.has_value());
  EXPECT_EQ(back->landmark_evidence[1].evidence.last_moved_ns, 1);
}

TEST(WireTest, DepthsAndSigmasAreOfAllKeypointsOrNone) {
  KeyframeProposal keyframe = RandomMessage<KeyframeProposal>(5, 30);
  FeatureSet& features = keyframe.features;
  ASSERT_GT(features.size(), 1U);
  features.sigmas_px.assign(features.size(), 0.5F);
  features.depths_m.assign(features.size(), 2.0F);
  features.depth_sigmas_m.assign(features.size(), 0.1F);
  features.depths_m[1] = features.depth_sigmas_m[1] = -1;  // not measured
  const std::optional<KeyframeProposal> decoded = Decode<KeyframeProposal>(Encode(keyframe));
  ASSERT_TRUE(decoded.has_value());
  EXPECT_TRUE(Identical(keyframe, *decoded));
  features.depths_m.pop_back();
  EXPECT_THROW(Encode(keyframe), InvariantError);
  features.depths_m.push_back(-2);
  EXPECT_THROW(Encode(keyframe), InvariantError);
}

TEST(WireTest, EventsNameWhatTheyAreAbout) {
  MapDelta delta;
  delta.event = MapEvent::kSettled;
  EXPECT_THROW(Encode(delta), InvariantError)
      << "settled about no keyframe was an answer to something else once";
  delta.about = KeyframeId::Make(1, 7);
  EXPECT_TRUE(Decode<MapDelta>(Encode(delta)).has_value());
  delta.request = 1;
  EXPECT_THROW(Encode(delta), InvariantError);
  delta.event = MapEvent::kRequestDone;
  delta.about.reset();
  EXPECT_EQ(Decode<MapDelta>(Encode(delta))->request, 1U);
  delta.request.reset();
  EXPECT_THROW(Encode(delta), InvariantError);
  for (int event = 1; event <= static_cast<int>(MapEvent::kTurn); ++event) {
    SCOPED_TRACE(event);
    const EventNeeds needs = NeededBy(static_cast<MapEvent>(event));
    MapDelta whole;
    whole.event = static_cast<MapEvent>(event);
    if (needs.about) whole.about = KeyframeId::Make(1, 7);
    if (needs.map_id) whole.map_id = 3;
    if (needs.correction_id) whole.correction_id = 5;
    if (needs.request) whole.request = 2;
    EXPECT_TRUE(Decode<MapDelta>(Encode(whole)).has_value());
    const auto refused_without = [&whole](auto field) {
      MapDelta part = whole;
      (part.*field).reset();
      EXPECT_THROW(Encode(part), InvariantError);
    };
    if (needs.about) refused_without(&MapDelta::about);
    if (needs.map_id) refused_without(&MapDelta::map_id);
    if (needs.correction_id) refused_without(&MapDelta::correction_id);
    if (needs.request) refused_without(&MapDelta::request);
  }
  LoopAnswer answer;
  answer.keyframe = KeyframeId::Make(1, 7);
  EXPECT_TRUE(Decode<LoopAnswer>(Encode(answer)).has_value());
  answer.kind = LoopAnswer::Kind::kLoop;
  answer.correction_id = 3;
  EXPECT_THROW(Encode(answer), InvariantError) << "a loop has two ends";
}

TEST(WireTest, TheFormerVersionIsNamed) {
  // frame_done_t of protocol 1: 40 bytes, of which the first eight are its fingerprint.
  std::vector<uint8_t> former = {0x88, 0x81, 0x50, 0x6d, 0x1c, 0x59, 0x00, 0xa5};
  former.resize(40);
  std::string reason;
  EXPECT_FALSE(Decode<FrameDone>(former, &reason).has_value());
  EXPECT_EQ(reason, std::string("frame_done_t: as version 0.1 sends it; this is version ") + kVersion);
  EXPECT_EQ(FormerProtocol(Info<FrameDone>().fingerprint), std::nullopt);
  testing::ForEachMessage([]<typename Message>() {
    EXPECT_EQ(FormerProtocol(Info<Message>().fingerprint), std::nullopt) << Info<Message>().type;
  });
  const std::string told = ToldOfFormer(1);
  EXPECT_TRUE(told.starts_with("recorded by version 0.1; this is version ")) << told;
}

TEST(WireTest, NoTwoTypesHaveTheSameFields) {
  std::set<int64_t> fingerprints;
  testing::ForEachMessage([&]<typename Message>() {
    EXPECT_TRUE(fingerprints.insert(Info<Message>().fingerprint).second) << Info<Message>().type;
  });
}

TEST(WireTest, TextIsCleanOrNot) {
  for (const char* text : {"", "plain", "zwei\nZeilen", "\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80"}) {
    EXPECT_TRUE(IsCleanText(text)) << text;
    EXPECT_EQ(CleanText(text), text);
  }
  for (const char* text :
       {"\x1b", "\x7f", "\x80", "\xc0\xaf", "\xc2\x85", "\xe2\x82", "\xed\xa0\x80", "\xf5\x80\x80\x80"}) {
    EXPECT_FALSE(IsCleanText(text)) << text;
    EXPECT_TRUE(IsCleanText(CleanText(text)));
  }
  EXPECT_FALSE(IsCleanText(std::string(kMaxTextBytes + 1, 'x')));
}

TEST(WireTest, AFeatureTakesAtMost45Bytes) {
  KeyframeProposal keyframe = RandomMessage<KeyframeProposal>(1, 0);
  const size_t empty = Encode(keyframe).size();
  keyframe.features.keypoints.resize(1000);
  keyframe.features.descriptors.resize(1000);
  for (uint16_t i = 0; i < 400; ++i) keyframe.matches.push_back({i, LandmarkId::Make(1, i)});
  EXPECT_LE(Encode(keyframe).size() - empty, 45 * 1000U);

  MapDelta delta;
  KeyframeState& state = delta.keyframes.emplace_back();
  state.id = keyframe.id;
  state.map_id = 1;
  state.features = std::make_shared<const FeatureSet>(keyframe.features);
  for (const auto& match : keyframe.matches)
    delta.observations.push_back({state.id, match.feature, match.landmark});
  EXPECT_LE(Encode(delta).size(), 45 * 1000U);
}

}  // namespace
}  // namespace dmslam::wire
