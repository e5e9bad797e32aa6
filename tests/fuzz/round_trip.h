#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/wire/testing/random_message.h"
#include "fuzz_target.h"

namespace dmslam::fuzz {

/// Decodes `data` as a message behind its fingerprint, which no mutation would guess: what Decode accepts can
/// be encoded again and means the same, and what it refuses it refuses with a reason.
template <typename Message>
void RoundTrip(std::span<const uint8_t> data) {
  std::vector<uint8_t> bytes;
  const auto fingerprint = static_cast<uint64_t>(wire::Info<Message>().fingerprint);
  for (int shift = 56; shift >= 0; shift -= 8) bytes.push_back(static_cast<uint8_t>(fingerprint >> shift));
  bytes.insert(bytes.end(), data.begin(), data.end());
  std::string reason;
  const std::optional<Message> message = wire::Decode<Message>(bytes, &reason);
  Require(message.has_value() == reason.empty(), "a refusal has a reason");
  if (!message.has_value()) return;
  const std::optional<Message> again = wire::Decode<Message>(wire::Encode(*message));
  Require(again.has_value(), "what was accepted can travel on");
  Require(wire::testing::Identical(*message, *again), "what travels on is the same");
}

/// A sound message without its fingerprint.
template <typename Message>
std::vector<uint8_t> MessageSeed(uint64_t seed) {
  std::vector<uint8_t> bytes = wire::Encode(wire::testing::RandomMessage<Message>(seed));
  bytes.erase(bytes.begin(), bytes.begin() + 8);
  return bytes;
}

}  // namespace dmslam::fuzz
