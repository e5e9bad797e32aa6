#include <gtest/gtest.h>

#include <sstream>
#include <string_view>

#include "dmslam/util/check.h"
#include "dmslam/util/crc32c.h"
#include "dmslam/util/ids.h"
#include "dmslam/util/machine.h"
#include "dmslam/util/random.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

std::span<const uint8_t> Bytes(std::string_view text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

TEST(Ids, KeyframeIdHoldsSessionAndFrame) {
  const KeyframeId id = KeyframeId::Make(7, 123456);
  EXPECT_EQ(id.session(), 7u);
  EXPECT_EQ(id.frame_index(), 123456u);
  EXPECT_FALSE(KeyframeId{}.valid());
}

TEST(Ids, KeyframesOfSeveralCamerasDifferAndAreOrderedByFrameWithinOne) {
  const KeyframeId id = KeyframeId::Make(7, kMaxFrames - 1, kMaxCameras - 1);
  EXPECT_EQ(id.session(), 7u);
  EXPECT_EQ(id.camera(), kMaxCameras - 1);
  EXPECT_EQ(id.frame_index(), kMaxFrames - 1);
  EXPECT_EQ(KeyframeId::Make(7, 5, 0), KeyframeId::Make(7, 5)) << "one camera is camera 0";
  EXPECT_LT(KeyframeId::Make(7, 5, 1), KeyframeId::Make(7, 6, 1));
  EXPECT_LT(KeyframeId::Make(7, kMaxFrames - 1, 0), KeyframeId::Make(7, 0, 1));
}

TEST(Time, ParsesDecimalExactly) {
  EXPECT_EQ(ParseStampNs("1305031102.175304"), 1305031102175304000);
  EXPECT_EQ(ParseStampNs("1305031102.1753040001"), std::nullopt);
  EXPECT_EQ(ParseStampNs("0.000000001"), 1);
  EXPECT_EQ(ParseStampNs("-1.5"), -1500000000);
  for (const char* bad : {"", ".", "1e9", "1.2.3", " 1", "nan", "--1", "1.-5", "99999999999"}) {
    EXPECT_EQ(ParseStampNs(bad), std::nullopt) << bad;
  }
}

TEST(Time, FormatIsInverseOfParse) {
  for (const int64_t stamp : {0L, 1L, 1700000000033333000L, 1305031102175304001L, -1500000000L}) {
    EXPECT_EQ(ParseStampNs(FormatStampNs(stamp)), stamp);
  }
  EXPECT_EQ(FormatStampNs(1305031102175304000), "1305031102.175304");
}

TEST(Time, SecondsBecomeWholeNanosecondsTowardsZero) {
  EXPECT_EQ(ToNs(1.5), 1'500'000'000);
  EXPECT_EQ(ToNs(-0.25), -250'000'000);
  EXPECT_EQ(ToNs(1.9e-9), 1);
  EXPECT_EQ(ToNs(-1.9e-9), -1);
}

TEST(Crc32c, KnownVectors) {
  EXPECT_EQ(Crc32c(Bytes("123456789")), 0xe3069283u);
  EXPECT_EQ(Crc32c(Bytes("56789"), Crc32c(Bytes("1234"))), 0xe3069283u);
}

TEST(Random, SeedsDifferByFrameAndPurpose) {
  EXPECT_NE(DeriveSeed(1, 2, "a"), DeriveSeed(1, 2, "b"));
  EXPECT_NE(DeriveSeed(1, 2, "a"), DeriveSeed(1, 3, "a"));
  Random a(5), b(5);
  for (int i = 0; i < 100; ++i) {
    const uint32_t value = a.Below(7);
    EXPECT_EQ(value, b.Below(7));
    EXPECT_LT(value, 7u);
  }
}

TEST(Check, NamesTheInvariant) {
  try {
    DMSLAM_CHECK(1 == 2, "numbers differ");
    FAIL() << "no exception";
  } catch (const InvariantError& error) {
    EXPECT_NE(std::string_view(error.what()).find("1 == 2"), std::string_view::npos);
  }
}

TEST(Machine, ProcessorIsTheModelNameOrTheArchitectureWithItsNumbers) {
  std::istringstream intel("processor\t: 0\nmodel\t\t: 85\nmodel name\t: Z80 @ 4 MHz\nmodel name\t: other\n");
  EXPECT_EQ(ProcessorName(intel, "x86_64"), "Z80 @ 4 MHz");
  std::istringstream arm("processor\t: 0\nCPU implementer\t: 0x41\nCPU variant\t: 0x3\nCPU part\t: 0xd0c\n");
  EXPECT_EQ(ProcessorName(arm, "aarch64"), "aarch64, implementer 0x41, part 0xd0c");
  std::istringstream nothing;
  EXPECT_EQ(ProcessorName(nothing, "riscv64"), "riscv64");
}

TEST(Machine, HasAProcessorAndCores) {
  EXPECT_FALSE(ThisMachine().processor.empty());
  EXPECT_GE(ThisMachine().cores, 1);
  EXPECT_EQ(ThisMachine(), ThisMachine());
}

}  // namespace
}  // namespace dmslam
