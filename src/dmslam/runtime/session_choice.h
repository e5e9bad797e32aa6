#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "dmslam/messaging/claims.h"

namespace dmslam {

/// Which sessions are on a bus, for a process that was not told which one is its own: for a second it hears
/// what their writers say ten times a second, and their players. Where there is one, that is it; where there
/// are several, people are to choose. What was said once is not believed: it may be forged, or the echo of
/// one that is gone.
class SessionChoice {
 public:
  static constexpr int64_t kListenNs = 1'000'000'000;

  /// `until_ns`: nothing is chosen before.
  explicit SessionChoice(int64_t until_ns) : until_ns_(until_ns) {}

  /// The channels of the beacons that it hears, for so many cameras.
  static std::vector<std::string> Channels(uint32_t num_cameras);
  /// Whether the channel is one of those.
  static bool IsOne(std::string_view channel) { return channel.ends_with("_HEAD"); }
  void HearBeacon(std::string_view channel, std::span<const uint8_t> bytes);
  /// A camera is said: by a player that is no writer, as one of somebody's own.
  void HearCamera(uint32_t session, const std::string& sequence, int64_t utime);

  bool MayChoose(int64_t now_ns) const { return now_ns >= until_ns_; }
  /// Why none can be chosen, with the cure; empty: there is at most one.
  std::string Problem() const;
  /// By whom each session is known: "player on host (pid 17)".
  const std::map<int64_t, std::string>& sessions() const { return names_; }

 private:
  void Know(int64_t session, int rank, const std::string& name);

  int64_t until_ns_;
  Claims<std::pair<int64_t, int64_t>> said_;  ///< of a session, by a writer (0: who says a camera)
  std::map<int64_t, std::string> names_;      ///< by session
  std::map<int64_t, int> ranks_;              ///< of the names: a player's is the best known
};

}  // namespace dmslam
