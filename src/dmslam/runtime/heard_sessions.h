#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>

#include "dmslam/messaging/claims.h"
#include "dmslam/util/ids.h"
#include "dmslam/wire/codec.h"

namespace dmslam {

/// What frontends say of the sessions that they begin, heard beside their streams, for who does not read
/// the beginning of these: a loop closer, and a mapper that takes over in the middle. It counts once the map
/// is made of that stream and it has been said twice, so much later that it is no copy on its way through a
/// network; where two different things were said of one stream, neither counts. So a forged one ends nobody,
/// and is in no saved map.
class HeardSessions {
 public:
  /// `epoch`: of the frontend's stream.
  void Hear(CameraId camera, int64_t epoch, const SessionStart& start, int64_t now_ns) {
    OfCamera& known = cameras_[camera];
    if (epoch < known.mapped) return;
    const auto [found, is_new] = known.said.try_emplace(epoch, Said{start, now_ns});
    Said& said = found->second;
    if (!is_new && said.start && wire::Encode(*said.start) != wire::Encode(start)) said.start.reset();
    said.again = said.again || now_ns - said.since_ns >= kNoCopyNs;
    if (known.said.size() > kMost) known.said.erase(std::prev(known.said.end()));
  }
  /// The map is made of this stream's records now. What was said of it, the first time that it counts.
  std::optional<SessionStart> Mapped(CameraId camera, int64_t epoch) {
    OfCamera& known = cameras_[camera];
    if (epoch > known.mapped) {
      known.mapped = epoch;
      known.said.erase(known.said.begin(), known.said.lower_bound(epoch));
    }
    const auto said = known.said.find(epoch);
    const bool counts = said != known.said.end() && said->second.again && !said->second.told;
    if (!counts || !said->second.start) return std::nullopt;
    said->second.told = true;
    return said->second.start;
  }

 private:
  static constexpr size_t kMost = 8;
  struct Said {
    std::optional<SessionStart> start;  ///< none: it was contradicted
    int64_t since_ns = 0;
    bool again = false;
    bool told = false;
  };
  struct OfCamera {
    int64_t mapped = 0;            ///< epoch of the stream of which the map is made
    std::map<int64_t, Said> said;  ///< by epoch, of this one and later ones
  };
  std::map<CameraId, OfCamera> cameras_;
};

}  // namespace dmslam
