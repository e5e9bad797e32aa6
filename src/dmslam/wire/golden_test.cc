#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "dmslam/wire/testing/random_message.h"

// One message of each type as bytes in tests/golden: what is on the wire, and in recorded logs, must not
// change by accident. After an intended change of a type, in the project's root:
// DMSLAM_UPDATE_GOLDEN=1 build/release/bin/golden_test writes them anew.
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

std::string Golden(const std::string& type) {
  std::ifstream file(GoldenPath(type));
  return std::string(std::istreambuf_iterator<char>(file), {});
}

std::vector<uint8_t> FromHex(const std::string& hex) {
  std::vector<uint8_t> bytes;
  std::istringstream words(hex);
  for (std::string word; words >> word;) bytes.push_back(static_cast<uint8_t>(std::stoi(word, nullptr, 16)));
  return bytes;
}

/// However messages are laid out in memory.
TEST(GoldenTest, BytesThatAreDecodedAreEncodedAsTheyWere) {
  testing::ForEachMessage([]<typename Message>() {
    const std::string golden = Golden(Info<Message>().type);
    std::string reason;
    const std::optional<Message> message = Decode<Message>(FromHex(golden), &reason);
    ASSERT_TRUE(message.has_value()) << reason;
    EXPECT_EQ(ToHex(Encode(*message)), golden) << Info<Message>().type;
  });
}

TEST(GoldenTest, BytesOfEveryTypeAreThoseOfOld) {
  testing::ForEachMessage([]<typename Message>() {
    const auto message = testing::RandomMessage<Message>(2);
    const std::string hex = ToHex(Encode(message));
    const std::string path = GoldenPath(Info<Message>().type);
    if (std::getenv("DMSLAM_UPDATE_GOLDEN") != nullptr) std::ofstream(path) << hex;
    const std::string golden = Golden(Info<Message>().type);
    ASSERT_FALSE(golden.empty()) << path << " is missing: run this test once with DMSLAM_UPDATE_GOLDEN=1";
    EXPECT_EQ(golden, hex) << path;
  });
}

}  // namespace
}  // namespace dmslam::wire
