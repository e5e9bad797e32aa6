#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/runtime/camera_claims.h"

namespace dmslam {

/// What the players say of their cameras: believed as CameraClaims has it, and said by others in their place
/// when they have fallen silent, so that a process which starts after a player has left still learns of it.
class KnownCameras {
 public:
  /// `jitter_ns`: how much longer than others this process waits before it speaks for a silent player.
  explicit KnownCameras(int64_t jitter_ns) : jitter_ns_(jitter_ns) {}

  bool Knows(CameraId camera) const { return known_.contains(camera); }
  /// Of a camera that is not known: whether the same was said before, and not just now.
  bool SaidAgain(const CameraInfo& info, int64_t now_ns) { return claims_.SaidAgain(info, now_ns); }
  /// What was said of a camera that is not known, of which a frame of this session came.
  std::optional<CameraInfo> ClaimOfFrame(CameraId camera, uint32_t session) const {
    return Knows(camera) ? std::nullopt : claims_.OfFrame(camera, session);
  }
  /// From now on the camera is known. `repeat`: whether it is one to be said again.
  void Believe(const CameraInfo& info, bool repeat, int64_t now_ns) {
    claims_.Forget(info.camera_id);
    known_[info.camera_id] = {info, repeat, now_ns + kSilentNs + jitter_ns_, 0};
  }
  /// Somebody spoke of a camera that is known. Where it is another one that he means, or another recording,
  /// what is known is said again soon: he may not have heard it.
  void Heard(const CameraInfo& info, int64_t now_ns) {
    Known& known = known_.at(info.camera_id);
    known.due_ns = IsOfSame(info, known.info) ? now_ns + kSilentNs + jitter_ns_
                                              : std::min(known.due_ns, known.said_ns + kContradictNs);
  }
  /// The cameras of which nobody has said anything for a while. They are to be said now.
  std::vector<CameraInfo> TakeSilent(int64_t now_ns) {
    std::vector<CameraInfo> silent;
    for (auto& [id, known] : known_) {
      if (!known.repeat || now_ns < known.due_ns) continue;
      known.due_ns = now_ns + kSilentNs;
      known.said_ns = now_ns;
      silent.push_back(known.info);
    }
    return silent;
  }
  /// Why nothing is heard of a camera that plays; empty: there is none such, or it was not noted.
  const std::string& not_heard() const { return not_heard_; }
  void NoteNotHeard(std::string why) { not_heard_ = std::move(why); }

 private:
  static constexpr int64_t kSilentNs = 1'500'000'000;  ///< a player says it at least twice a second
  static constexpr int64_t kContradictNs = 100'000'000;
  struct Known {
    CameraInfo info;
    bool repeat = false;
    int64_t due_ns = 0;   ///< when it is repeated, unless somebody else says it before
    int64_t said_ns = 0;  ///< when that was done last
  };

  int64_t jitter_ns_;
  CameraClaims claims_;
  std::map<CameraId, Known> known_;
  std::string not_heard_;
};

}  // namespace dmslam
