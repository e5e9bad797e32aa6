#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

#include "dmslam/wire/status.h"

namespace dmslam {

/// Tells a process that was started again from the one before it, by what their statuses say: it has another
/// process id, or, where ids are alike (each container has its own), it has run for no longer than nobody was
/// heard. One watch for each role.
class InstanceWatch {
 public:
  /// A status came: whether its process was not heard before.
  bool IsNew(const ProcessHealth& health, int64_t now_ns) {
    const auto [known, is_new] = heard_.try_emplace(health.pid, Heard{health.uptime_s, now_ns});
    Heard& before = known->second;
    const double silent_s = static_cast<double>(now_ns - before.at_ns) * 1e-9;
    const bool began_since =
        health.uptime_s < before.uptime_s && health.uptime_s <= silent_s + kSlackS;  // no late status
    before = {health.uptime_s, now_ns};
    if (heard_.size() > kMost) Forget(health.pid);
    return is_new || began_since;
  }
  /// A process with this id was heard by who watched before; how long it had run is not known.
  void Know(int32_t pid, int64_t now_ns) { heard_.try_emplace(pid, Heard{-1, now_ns}); }

 private:
  static constexpr size_t kMost = 64;
  static constexpr double kSlackS = 1;
  struct Heard {
    double uptime_s = 0;
    int64_t at_ns = 0;
  };
  void Forget(int32_t but) {
    auto oldest = heard_.end();
    for (auto it = heard_.begin(); it != heard_.end(); ++it) {
      const bool older = oldest == heard_.end() || it->second.at_ns < oldest->second.at_ns;
      if (it->first != but && older) oldest = it;
    }
    heard_.erase(oldest);
  }

  std::map<int32_t, Heard> heard_;  ///< by process id
};

}  // namespace dmslam
