#pragma once

#include <algorithm>
#include <cstdint>
#include <map>

namespace dmslam {

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
    const bool first = claim.first_utime == kNever;
    claim.again = claim.again || (!first && utime > claim.first_utime);
    claim.first_utime =
        first ? utime : std::min(claim.first_utime, utime);  // one from the future counts once
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
  static constexpr int64_t kNever = INT64_MIN;
  struct Claim {
    int64_t first_utime = kNever;
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

}  // namespace dmslam
