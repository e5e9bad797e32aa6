#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dmslam/util/check.h"
#include "dmslam/wire/check.h"
#include "dmslam/wire/codec.h"
#include "dmslam/wire/schema.h"
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
  const FrameDone done{.session = 3, .frame_index = 0x01020304, .stamp_ns = 1'305'031'102'175'304'001};
  const std::vector<uint8_t> bytes = Encode(done);
  ASSERT_EQ(bytes.size(), 40U);
  const std::vector<uint8_t> expected = {
      0x00, 0x04, 0xa2, 0xeb, 0x3b, 0x44, 0x18, 0x48,   // 1305031102175304 us
      0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x03,   // session
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
  std::fill(unchecked.begin() + 16, unchecked.begin() + 20, uint8_t{0});  // of a program that computes none
  EXPECT_TRUE(Decode<FrameDone>(unchecked).has_value());
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
  state.has_features = true;
  state.features = keyframe.features;
  for (const auto& match : keyframe.matches)
    delta.observations.push_back({state.id, match.feature, match.landmark});
  EXPECT_LE(Encode(delta).size(), 45 * 1000U);
}

}  // namespace
}  // namespace dmslam::wire
