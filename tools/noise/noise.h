#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "dmslam/messaging/types.h"
#include "dmslam/util/random.h"

namespace dmslam {

/// All channels of a system: typed messages and protocol.
std::vector<std::string> AllChannels();

/// Makes hostile messages: noise of any length, and messages that were heard with 1 to 16 bytes changed.
class NoiseMaker {
 public:
  explicit NoiseMaker(uint64_t seed);

  /// A message of the bus; what was made here and comes back is recognised and left.
  void Hear(const std::string& channel, std::span<const uint8_t> bytes);
  /// The next hostile message, on any channel.
  Outgoing Make();

  int64_t changed() const { return changed_; }

 private:
  Bytes MakeNoise();
  Bytes Change(const Bytes& sound);
  bool IsOurs(std::span<const uint8_t> bytes) const;
  void Remember(std::span<const uint8_t> bytes);

  std::vector<std::string> channels_;
  std::map<std::string, std::deque<Bytes>> heard_;  ///< the newest ones, by channel
  std::set<uint32_t> made_;                         ///< checksums of the newest ones made
  std::deque<uint32_t> made_order_;
  Random random_;
  int64_t changed_ = 0;
};

}  // namespace dmslam
