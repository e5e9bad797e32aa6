#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "dmslam/wire/codec.h"

namespace dmslam {

/// Whether two players mean the same: a camera of one model, and a recording of one name.
inline bool IsOfSame(const CameraInfo& a, const CameraInfo& b) {
  return a.camera.SeesAs(b.camera) && a.sequence == b.sequence;
}

/// Everything that a process does rests on the camera that it is told, and the telling may be forged. What is
/// said is believed when it has been said twice, or when a frame follows it and nothing else was said
/// meanwhile. Keeps a few claims of each camera: the one that was heard longest ago makes room.
class CameraClaims {
 public:
  /// Whether the same was said before, and not just now (which may be a copy on its way through a network).
  bool SaidAgain(const CameraInfo& info, int64_t now_ns) {
    std::vector<Claim>& claims = claims_[info.camera_id];
    const auto known = std::find_if(claims.begin(), claims.end(),
                                    [&](const Claim& claim) { return Same(claim.info, info); });
    if (known != claims.end()) return now_ns - known->since_ns >= kNotJustNowNs;
    if (claims.size() == kMost) claims.erase(claims.begin());
    claims.push_back({info, now_ns});
    return false;
  }
  /// A frame of this session came: what was said of its camera, where it is one thing.
  std::optional<CameraInfo> OfFrame(CameraId camera, uint32_t session) const {
    const auto known = claims_.find(camera);
    const bool one = known != claims_.end() && known->second.size() == 1;
    if (!one || known->second.front().info.session != session) return std::nullopt;
    return known->second.front().info;
  }
  void Forget(CameraId camera) { claims_.erase(camera); }

 private:
  static constexpr size_t kMost = 8;
  /// Less than kNoCopyNs, for a player that begins says it every tenth of a second: the second time counts.
  static constexpr int64_t kNotJustNowNs = 50'000'000;
  struct Claim {
    CameraInfo info;
    int64_t since_ns = 0;
  };
  /// But for the time at which it is said.
  static bool Same(const CameraInfo& a, CameraInfo b) {
    b.utime = a.utime;
    return wire::Encode(a) == wire::Encode(b);
  }

  std::map<CameraId, std::vector<Claim>> claims_;
};

}  // namespace dmslam
