#include "frontend/remembered_frames.h"

#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/util/check.h"

namespace dmslam {

RememberedFrames::RememberedFrames(const std::string& folder, uint32_t session, CameraId camera,
                                   size_t max_bytes) {
  if (!folder.empty()) memory_.emplace(folder, session, camera, max_bytes);
}

void RememberedFrames::Open(uint32_t first) {
  first_ = first;
  memory_->Open(first);
}

void RememberedFrames::Add(const RememberedFrame& frame) {
  if (!memory_) return;
  try {
    if (!first_) Open(frame.seen.id.frame_index());
    memory_->Add(frame);
    if (!memory_->problem().empty()) GiveUp(memory_->problem());
  } catch (const InputError& error) {
    GiveUp(error.what());
  }
}

void RememberedFrames::TakeOver(FrontendCore* core) {
  if (std::exchange(taken_over_, true) || !memory_) return;
  size_t count = 0;
  try {
    if (!first_) Open(UINT32_MAX);
    memory_->ForEach(*first_, [&](RememberedFrame frame) {
      core->TakeOver(std::move(frame));
      ++count;
    });
  } catch (const InputError& error) {
    GiveUp(error.what());
  }
  if (count > 0) LogInfo("frontend: finds the last poses of {} frames of the one before it, too", count);
}

void RememberedFrames::Remove() {
  if (memory_) memory_->Remove();
  memory_.reset();
}

/// The room on the disk is for others, the log among them.
void RememberedFrames::GiveUp(const std::string& why) {
  memory_->Remove();
  LogWarning("frontend: {}; frames die with this process from now on", why);
  memory_.reset();
}

}  // namespace dmslam
