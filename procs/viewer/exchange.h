#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/messaging/event_loop.h"
#include "dmslam/wire/player_messages.h"
#include "viewer/event_hub.h"
#include "viewer/frame_series.h"
#include "viewer/health_text.h"
#include "viewer/scene.h"

namespace dmslam {

/// An image of the sequence, as it came; encoded as JPEG for the first who asks.
class ServedImage {
 public:
  explicit ServedImage(Frame frame) : frame_(std::move(frame)) {}
  uint32_t frame_index() const { return frame_.frame_index; }
  CameraId camera() const { return frame_.camera_id; }
  /// Empty where the bytes are no image.
  const std::vector<uint8_t>& Jpeg();

 private:
  Frame frame_;
  std::once_flag encoded_;
  std::vector<uint8_t> jpeg_;
};

/// What the viewer's replica and the threads that serve browsers have in common. Nobody holds the lock longer
/// than it takes to copy what has changed; nothing is sent or encoded under it.
class Exchange {
 public:
  /// `now_ns`: monotonic; tells how old is what was said of the system's health.
  explicit Exchange(std::function<int64_t()> now_ns = &EventLoop::now_ns) : now_ns_(std::move(now_ns)) {}

  /// For the replica: changes scene or series.
  template <typename Edit>
  void Change(const Edit& edit) {
    const std::lock_guard lock(mutex_);
    edit(&scene_, &series_);
  }
  void AddImage(Frame frame);

  std::vector<uint8_t> EncodeScene(uint32_t generation, uint64_t since) const;
  std::string SeriesJson(int64_t since, int64_t most, CameraId camera = 0) const;
  /// The image of that frame; the camera's newest one where it is not (or no longer) there. Null: none yet.
  std::shared_ptr<ServedImage> FindImage(std::optional<uint32_t> frame_index, CameraId camera = 0) const;

  /// How the system fares, for machines.
  void SetHealth(HealthText health);
  /// Nothing where the replica has said nothing for 5 s: it says so four times a second.
  std::optional<HealthText> Health() const;

  EventHub& hub() { return hub_; }

 private:
  std::function<int64_t()> now_ns_;
  mutable std::mutex mutex_;
  ViewerScene scene_;
  CameraSeries series_;
  HealthText health_;
  std::optional<int64_t> health_ns_;  ///< when it was said
  std::map<CameraId, std::deque<std::shared_ptr<ServedImage>>> images_;
  EventHub hub_;
};

}  // namespace dmslam
