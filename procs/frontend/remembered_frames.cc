#include "frontend/remembered_frames.h"

#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

// Of each of two files: as many features as FrameRefiner keeps, of 43 bytes each.
constexpr size_t kMostBytes = 128UL << 20;

}  // namespace

RememberedFrames::RememberedFrames(const std::string& folder, uint32_t session, CameraId camera) {
  if (!folder.empty()) memory_.emplace(folder, session, camera, kMostBytes);
}

void RememberedFrames::Open(uint32_t first) {
  first_ = first;
  try {
    memory_->Open(first);
  } catch (const InputError& error) {
    GiveUp(error.what());
  }
}

void RememberedFrames::Add(const RememberedFrame& frame) {
  if (memory_ && !first_) Open(frame.seen.id.frame_index());
  if (!memory_) return;
  memory_->Add(frame);
  if (!memory_->problem().empty()) GiveUp(memory_->problem());
}

void RememberedFrames::TakeOver(FrontendCore* core) {
  if (std::exchange(taken_over_, true)) return;
  if (memory_ && !first_) Open(UINT32_MAX);
  if (!memory_) return;
  size_t count = 0;
  memory_->ForEach(*first_, [&](RememberedFrame frame) {
    core->TakeOver(std::move(frame));
    ++count;
  });
  if (count > 0) LogInfo("frontend: finds the last poses of {} frames of the one before it, too", count);
}

void RememberedFrames::Remove() {
  if (memory_) memory_->Remove();
  memory_.reset();
}

/// The room on the disk is for others, the log among them.
void RememberedFrames::GiveUp(std::string why) {
  Remove();
  LogWarning("frontend: {}; frames die with this process from now on", std::move(why));
}

}  // namespace dmslam
