#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "dmslam/util/ids.h"

namespace dmslam {

/// Kinds of events that browsers are told of.
enum class EventKind : uint8_t { kStatus = 0, kPose = 1, kFeatures = 2, kMap = 3, kPlayback = 4 };
inline constexpr size_t kNumEventKinds = 5;

/// Hands events to any number of listeners, each of which may be slow: a listener holds at most one event of
/// each kind and camera, and a newer one takes the place of one that was not yet fetched. Who sends never
/// waits.
class EventHub {
  /// By camera, then by kind.
  using Slots = std::array<std::shared_ptr<const std::string>, kNumEventKinds * kMaxCameras>;

 public:
  class Listener {
   public:
    /// What is new, in the format of server-sent events; a comment line when nothing came within `wait`;
    /// empty when the hub is closed.
    std::string Next(std::chrono::milliseconds wait);
    /// Events that were replaced before they were fetched.
    int64_t skipped() const;

   private:
    friend class EventHub;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    Slots waiting_;
    int64_t skipped_ = 0;
    bool closed_ = false;
  };

  EventHub();
  ~EventHub();
  EventHub(const EventHub&) = delete;
  EventHub& operator=(const EventHub&) = delete;

  /// Can be read when something was sent since ClearFd.
  int fd() const { return fd_; }
  void ClearFd();

  /// A new listener, who first gets the newest event of each kind and camera. None when closed or when there
  /// are `kMostListeners`.
  std::shared_ptr<Listener> Join();
  void Leave(const std::shared_ptr<Listener>& listener);
  /// `json` in one line.
  void Send(EventKind kind, const std::string& json, CameraId camera = 0);
  void Close();
  size_t num_listeners() const;
  /// Whether there are so many listeners, or will be within `patience`.
  bool WaitForListeners(size_t count, std::chrono::milliseconds patience) const;
  int64_t skipped() const;  ///< by all listeners, those that have left too

  static constexpr size_t kMostListeners = 64;

 private:
  static void Put(Listener* listener, size_t slot, const std::shared_ptr<const std::string>& text);

  mutable std::mutex mutex_;
  mutable std::condition_variable joined_or_left_;
  std::vector<std::shared_ptr<Listener>> listeners_;
  Slots newest_;
  int fd_;
  int64_t skipped_by_former_ = 0;
  bool closed_ = false;
};

}  // namespace dmslam
