#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "dmslam/wire/testing/random_message.h"

// One message of each type as bytes in tests/golden: what is on the wire, and in recorded logs, must not
// change by accident. After an intended change of a type: DMSLAM_UPDATE_GOLDEN=1 bin/golden_test writes them
// anew.
namespace dmslam::wire {
namespace {

std::string GoldenPath(const std::string& type) {
  const char* source = std::getenv("DMSLAM_SOURCE_DIR");
  return std::string(source == nullptr ? "." : source) + "/tests/golden/" + type + ".hex";
}

std::string ToHex(const std::vector<uint8_t>& bytes) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  for (size_t i = 0; i < bytes.size(); ++i) {
    hex += {kDigits[bytes[i] >> 4], kDigits[bytes[i] & 15]};
    hex += i % 32 == 31 || i + 1 == bytes.size() ? '\n' : ' ';
  }
  return hex;
}

TEST(GoldenTest, BytesOfEveryTypeAreThoseOfOld) {
  testing::ForEachMessage([]<typename Message>() {
    const auto message = testing::RandomMessage<Message>(2);
    const std::string hex = ToHex(Encode(message));
    const std::string path = GoldenPath(Info<Message>().type);
    if (std::getenv("DMSLAM_UPDATE_GOLDEN") != nullptr) std::ofstream(path) << hex;
    std::ifstream file(path);
    ASSERT_TRUE(file.good()) << path << " is missing: run this test once with DMSLAM_UPDATE_GOLDEN=1";
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), hex) << path;
  });
}

}  // namespace
}  // namespace dmslam::wire
