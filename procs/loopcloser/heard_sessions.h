#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>

#include "dmslam/util/ids.h"
#include "dmslam/wire/codec.h"

namespace dmslam {

/// On what frontends say that their sessions rest, heard beside their streams, which the loop closer does not
/// read. It counts once the map is made of that stream, and was not made of it before it was said; where two
/// different things were said of one stream, neither counts. So what nobody but a forger has said ends
/// nobody.
class HeardSessions {
 public:
  /// `epoch`: of the frontend's stream.
  void Hear(CameraId camera, int64_t epoch, const SessionStart& start) {
    OfCamera& known = cameras_[camera];
    if (epoch <= known.mapped) return;
    const auto [said, is_new] = known.said.try_emplace(epoch, start);
    if (!is_new && said->second && wire::Encode(*said->second) != wire::Encode(start)) said->second.reset();
    if (known.said.size() > kMost) known.said.erase(std::prev(known.said.end()));
  }
  /// The map is made of this stream's records now. What was said of it, the first time that it is so.
  std::optional<SessionStart> Mapped(CameraId camera, int64_t epoch) {
    OfCamera& known = cameras_[camera];
    if (epoch <= known.mapped) return std::nullopt;
    known.mapped = epoch;
    const auto said = known.said.find(epoch);
    const std::optional<SessionStart> start = said == known.said.end() ? std::nullopt : said->second;
    known.said.erase(known.said.begin(), known.said.upper_bound(epoch));
    return start;
  }

 private:
  static constexpr size_t kMost = 8;
  struct OfCamera {
    int64_t mapped = 0;                                   ///< epoch of the stream of which the map is made
    std::map<int64_t, std::optional<SessionStart>> said;  ///< by epoch, of later ones
  };
  std::map<CameraId, OfCamera> cameras_;
};

}  // namespace dmslam
