#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "dmslam/map/remembered_frame.h"
#include "dmslam/recording/journal.h"

namespace dmslam {

/// The folder of a run's frontends, in that of its results, while it goes on.
std::string FrameMemoryPath(const std::string& folder);

/// The newest frames of a camera, in files that outlive the frontend that saw them: one that is started again
/// on this host finds their last poses as if it had never died.
///
/// The folder belongs to one system: what another session of the camera has left there is removed. Where the
/// disk takes no more, problem() says so.
class FrameMemory {
 public:
  /// Remembers the newest `max_bytes` of frames at least, and at most twice as many.
  FrameMemory(std::string folder, uint32_t session, CameraId camera, size_t max_bytes);

  /// Goes on behind what a frontend before this one has left, whose own frames begin with number `first`.
  /// Where that is no frame before `first`, it is of no use and removed. Throws InputError where the folder
  /// cannot be written.
  void Open(uint32_t first);
  /// A frame; another one of the same number takes its place.
  void Add(const RememberedFrame& frame);
  /// Those before number `end`, the newest first.
  void ForEach(uint32_t end, const std::function<void(RememberedFrame)>& take) const;
  /// Nobody needs it any more.
  void Remove();
  /// Why a frame could not be written; empty: each was.
  const std::string& problem() const { return journals_[current_].problem(); }

 private:
  void RemoveOtherSessions() const;
  void RemoveFrames();

  std::string folder_;
  uint32_t session_;
  CameraId camera_;
  size_t max_bytes_;
  std::array<std::string, 2> paths_;
  std::array<Journal, 2> journals_;  ///< one is written to; when it is full, the other one is emptied
  size_t current_ = 0;
  size_t written_ = 0;  ///< bytes of frames, to the current one
};

}  // namespace dmslam
