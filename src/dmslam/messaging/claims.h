#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>

namespace dmslam {

/// No network keeps a copy of a message for longer: what is heard again so much later was said again.
inline constexpr int64_t kNoCopyNs = 100'000'000;
/// Who insists on something is never silent for longer.
inline constexpr int64_t kInsistsEveryNs = 1'000'000'000;

/// Tells who keeps speaking from a message that was forged, or is a late echo of a sender that is gone: a
/// claim is believed once it has been made again, at a later moment of its sender's clock. A copy of a
/// message is not a second one. Keeps a few claims: the one that was heard longest ago makes room.
template <typename Key>
class Claims {
 public:
  /// Whether the claim was made before, at an earlier moment. `utime`: of the message, its sender's clock.
  bool SaidAgain(const Key& key, int64_t utime) {
    Claim& claim = claims_[key];
    claim.order = ++order_;
    claim.again = claim.again || (claim.first_utime && utime > *claim.first_utime);
    claim.first_utime =
        std::min(claim.first_utime.value_or(utime), utime);  // one from the future counts once
    const bool again = claim.again;
    if (claims_.size() > kMost) Forget();
    return again;
  }

  void Clear() { claims_.clear(); }
  /// Calls `visit(key, again)` for each claim, in the order of their keys.
  template <typename Visitor>
  void ForEach(const Visitor& visit) const {
    for (const auto& [key, claim] : claims_) visit(key, claim.again);
  }

 private:
  static constexpr size_t kMost = 16;
  struct Claim {
    std::optional<int64_t> first_utime;  // none: it was not made yet
    int64_t order = 0;
    bool again = false;
  };

  void Forget() {
    auto oldest = claims_.begin();
    for (auto it = claims_.begin(); it != claims_.end(); ++it) {
      if (it->second.order < oldest->second.order) oldest = it;
    }
    claims_.erase(oldest);
  }

  std::map<Key, Claim> claims_;
  int64_t order_ = 0;
};

/// Tells who goes on asking from who has asked a few times in a row, as somebody does who forges: a request
/// counts when its sender has made it for half a second, and was never silent for a second meanwhile. A copy
/// of a message is not a second one. Keeps a few senders: the one that was heard longest ago makes room.
class Insistence {
 public:
  /// Whether `who` has asked for long enough. `utime`: of the message, its sender's clock.
  bool Asks(int64_t who, int64_t utime, int64_t now_ns) {
    const auto [found, is_new] = asked_.try_emplace(who, Asked{now_ns, now_ns, utime});
    Asked& asked = found->second;
    if (!is_new && utime <= asked.utime) return false;
    if (now_ns - asked.last_ns > kInsistsEveryNs) asked.since_ns = now_ns;
    asked.last_ns = now_ns;
    asked.utime = utime;
    const bool insists = now_ns - asked.since_ns >= kLongEnoughNs;
    if (asked_.size() > kMost) Forget();
    return insists;
  }

 private:
  static constexpr size_t kMost = 16;
  static constexpr int64_t kLongEnoughNs = 500'000'000;
  struct Asked {
    int64_t since_ns = 0, last_ns = 0;
    int64_t utime = 0;  // of the newest one
  };

  void Forget() {
    asked_.erase(std::min_element(asked_.begin(), asked_.end(), [](const auto& a, const auto& b) {
      return a.second.last_ns < b.second.last_ns;
    }));
  }

  std::map<int64_t, Asked> asked_;  // by who asks
};

}  // namespace dmslam
