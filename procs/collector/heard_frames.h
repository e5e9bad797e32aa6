#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "dmslam/map/map.h"
#include "dmslam/map/proposals.h"

namespace dmslam {

/// Of which frames the frontends have told poses, as they came.
class HeardFrames {
 public:
  explicit HeardFrames(CameraId num_cameras) {
    for (CameraId camera = 0; camera < num_cameras; ++camera) newest_[camera].reset();
  }

  void Hear(const FramePose& pose);
  /// How many frames.
  int64_t count() const { return count_; }
  /// Of the frame that was heard last, over all cameras; none: none was.
  std::optional<int64_t> newest_stamp_ns() const { return newest_stamp_ns_; }
  /// Whether the map is no newer than what was heard: has no keyframe of this session behind the newest frame
  /// of its camera.
  bool ReachAsFarAs(const Map& map, uint32_t session) const;

 private:
  int64_t count_ = 0;
  std::optional<int64_t> newest_stamp_ns_;
  std::map<CameraId, std::optional<uint32_t>> newest_;  ///< its index; none: none has come
};

}  // namespace dmslam
