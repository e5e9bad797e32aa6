#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "dmslam/map/remembered_frame.h"
#include "dmslam/recording/frame_memory.h"
#include "dmslam/slam/frontend_core.h"

namespace dmslam {

/// A frontend's memory of its frames, where it was given a folder for it. It is an aid: where it cannot be
/// written that is logged once, and the frames die with the frontend. On the core.
class RememberedFrames {
 public:
  /// Of each of two files: as many features as FrameRefiner keeps, of 43 bytes each.
  static constexpr size_t kMostBytes = 128UL << 20;

  /// `folder`: empty, no frame is remembered.
  RememberedFrames(const std::string& folder, uint32_t session, CameraId camera,
                   size_t max_bytes = kMostBytes);

  /// What a frame saw, and again when more is known of it.
  void Add(const RememberedFrame& frame);
  /// Hands the core what frontends before this one have left of the frames before its own first. Once.
  void TakeOver(FrontendCore* core);
  /// All last poses are told.
  void Remove();

 private:
  void Open(uint32_t first);
  void GiveUp(const std::string& why);

  std::optional<FrameMemory> memory_;
  std::optional<uint32_t> first_;  ///< frame of this process; none: nothing was added yet
  bool taken_over_ = false;
};

}  // namespace dmslam
