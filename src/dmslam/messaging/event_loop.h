#pragma once

#include <csignal>
#include <cstdint>
#include <functional>
#include <vector>

namespace dmslam {

/// Waits for file descriptors, a deadline or a signal to stop: the one place where a process sleeps. One
/// thread. SIGTERM and SIGINT are taken from the whole process, so make it before anything that starts
/// threads (LcmBus).
class EventLoop {
 public:
  EventLoop();
  ~EventLoop();
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  /// Calls `on_readable` from PumpOnce whenever `fd` can be read. It must read.
  void Watch(int fd, std::function<void()> on_readable);

  /// Waits until something is readable, `deadline_ns` of now_ns() has come (in the past: does not wait), or a
  /// signal asks to stop; handles what there is. Returns whether to go on.
  bool PumpOnce(int64_t deadline_ns);

  /// Handles what there is and does not wait: keeps the protocol alive within long work.
  bool PumpOnce() { return PumpOnce(INT64_MIN); }

  /// The signal that asked to stop; 0 for none so far.
  int stop_signal() const { return stop_signal_; }

  /// Monotonic, nanoseconds. Measures and paces; drives no result.
  static int64_t now_ns();
  /// Wall time, microseconds since 1970: for terms of office and the utime of messages.
  static int64_t wall_us();

 private:
  struct Watched {
    int fd;
    std::function<void()> on_readable;
  };
  void TakeSignal();

  int signal_fd_ = -1;
  sigset_t former_mask_{};
  int stop_signal_ = 0;
  std::vector<Watched> watched_;
};

}  // namespace dmslam
