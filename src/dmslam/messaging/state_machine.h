#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "dmslam/messaging/types.h"

namespace dmslam {

/// One part of the protocol: bytes and time in, bytes out. No clock, no I/O, no threads. Time is monotonic
/// nanoseconds of the caller's choosing.
class StateMachine {
 public:
  virtual ~StateMachine() = default;
  /// Takes in any message of the bus; what is not meant for it is ignored.
  virtual void Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) = 0;
  /// Does what is due.
  virtual void Advance(int64_t now_ns) = 0;
  /// What is to be sent, in order. To be called after each of the others.
  virtual std::vector<Outgoing> TakeOutgoing() = 0;
  /// When Advance has something to do next; INT64_MAX for never.
  virtual int64_t deadline_ns() const = 0;
};

}  // namespace dmslam
