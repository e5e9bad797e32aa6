#pragma once

#include <map>
#include <optional>
#include <string>

#include "dmslam/ack_t.hpp"
#include "dmslam/head_t.hpp"
#include "dmslam/messaging/types.h"
#include "dmslam/util/random.h"

namespace dmslam {

/// For simulations: changes the beacons and acknowledgements that it has heard, one message at a time, and
/// seals them again: what would end, hang or deafen somebody who believed it.
class Forger {
 public:
  void Hear(const Outgoing& message);
  /// None before it has heard both a beacon and an acknowledgement.
  std::optional<Outgoing> Make(Random* random) const;

 private:
  std::map<std::string, head_t> heads_;  // the newest of each channel
  std::map<std::string, ack_t> acks_;
};

}  // namespace dmslam
