#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

#include "dmslam/wire/status.h"

namespace dmslam {

/// Tells a process that was started again from the one before it, by what their statuses say: it has another
/// process id, or, where ids are alike (each container has its own), it has run for no longer than nobody was
/// heard; who is known from notes alone may also have come while nobody listened: then it has run for less
/// than was noted, or writes in another term of office. One watch for each role.
class InstanceWatch {
 public:
  /// A status came: whether its process was not heard before.
  bool IsNew(const ProcessHealth& health, int64_t now_ns) {
    const auto [known, is_new] = heard_.try_emplace(health.pid, Heard{health.uptime_s, now_ns, {}});
    Heard& before = known->second;
    const double silent_s = static_cast<double>(now_ns - before.at_ns) * 1e-9;
    const bool began_since =
        health.uptime_s < before.uptime_s && health.uptime_s <= silent_s + kSlackS;  // no late status
    const bool is_other = before.noted ? IsOther(*before.noted, health) : began_since;
    before = {health.uptime_s, now_ns, {}};
    if (heard_.size() > kMost) Forget(health.pid);
    return is_new || is_other;
  }
  /// What who watched before has noted of a process.
  struct Noted {
    std::optional<double> uptime_s;  ///< how long it had run; none: not known
    std::optional<int64_t> epoch;    ///< as writer; none: not known
  };
  /// A process with this id was heard by who watched before.
  void Know(int32_t pid, int64_t now_ns, const Noted& noted) {
    heard_[pid] = {noted.uptime_s.value_or(0), now_ns, noted};
  }

 private:
  static constexpr size_t kMost = 64;
  static constexpr double kSlackS = 1;
  struct Heard {
    double uptime_s = 0;
    int64_t at_ns = 0;
    std::optional<Noted> noted;  ///< it was not heard here
  };
  static bool IsOther(const Noted& noted, const ProcessHealth& health) {
    if (noted.epoch && health.epoch != 0 && *noted.epoch != health.epoch) return true;
    return noted.uptime_s && health.uptime_s < *noted.uptime_s;
  }
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
