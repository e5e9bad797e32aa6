// One message type, DMSLAM_FUZZ_MESSAGE: what Decode accepts can be encoded again and means the same.
#include <optional>

#include "dmslam/wire/testing/random_message.h"
#include "fuzz_target.h"

using Message = dmslam::DMSLAM_FUZZ_MESSAGE;

// The input is the message behind its fingerprint, which no mutation would guess.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  namespace wire = dmslam::wire;
  std::vector<uint8_t> bytes;
  const auto fingerprint = static_cast<uint64_t>(wire::Info<Message>().fingerprint);
  for (int shift = 56; shift >= 0; shift -= 8) bytes.push_back(static_cast<uint8_t>(fingerprint >> shift));
  bytes.insert(bytes.end(), data, data + size);
  std::string reason;
  const std::optional<Message> message = wire::Decode<Message>(bytes, &reason);
  dmslam::fuzz::Require(message.has_value() == reason.empty(), "a refusal has a reason");
  if (!message.has_value()) return 0;
  const std::optional<Message> again = wire::Decode<Message>(wire::Encode(*message));
  dmslam::fuzz::Require(again.has_value(), "what was accepted can travel on");
  dmslam::fuzz::Require(wire::testing::Identical(*message, *again), "what travels on is the same");
  return 0;
}

namespace dmslam::fuzz {

std::vector<std::vector<uint8_t>> Seeds() {
  std::vector<std::vector<uint8_t>> seeds;
  for (uint64_t i = 0; i < 16; ++i) {
    std::vector<uint8_t> bytes = wire::Encode(wire::testing::RandomMessage<Message>(i));
    bytes.erase(bytes.begin(), bytes.begin() + 8);
    seeds.push_back(std::move(bytes));
  }
  return seeds;
}

}  // namespace dmslam::fuzz
