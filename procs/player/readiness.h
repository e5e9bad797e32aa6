#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/wire/codec.h"

namespace dmslam {

/// Who is to be ready before a recording is played in real time: a frontend that has no map stream yet, or a
/// mapper that still asks who holds a map, would miss its first frames. Who writes its stream is ready, as
/// its status says. Nobody is waited for without end: a process that is not there may never come.
class Readiness {
 public:
  static constexpr int64_t kAtMostNs = 10'000'000'000;

  /// `awaited`: roles, "frontend" for that of the player's own camera.
  explicit Readiness(std::vector<std::string> awaited) : awaited_(std::move(awaited)) {}

  /// A message on any channel, called as it is where there is one camera.
  void OnStatus(const std::string& channel, std::span<const uint8_t> bytes, uint32_t session) {
    if (awaited_.empty()) return;
    if (channel == channels::kMapperStatus) Note<MapperStatus>(roles::kMapper, bytes, session);
    if (channel == channels::kFrontendStatus) Note<FrontendStatus>(roles::kFrontend, bytes, session);
  }
  bool AllReady() const { return awaited_.empty(); }
  /// Who is not, as processes of that camera are called; with commas.
  std::string Missing(CameraId camera) const {
    std::string missing;
    for (const std::string& role : awaited_)
      missing += (missing.empty() ? "" : ", ") + (role == roles::kFrontend ? OfCamera(role, camera) : role);
    return missing;
  }
  /// They have had their time.
  void GiveUp() { awaited_.clear(); }

 private:
  template <typename Status>
  void Note(const char* role, std::span<const uint8_t> bytes, uint32_t session) {
    const auto status = wire::Decode<Status>(bytes);
    if (!status || status->head.session != session || status->head.health.epoch == 0) return;
    std::erase(awaited_, role);
  }

  std::vector<std::string> awaited_;
};

}  // namespace dmslam
