#include "viewer/playback_control.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include "dmslam/util/check.h"

namespace dmslam {

PlaybackControl::PlaybackControl() : fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  DMSLAM_CHECK(fd_ >= 0, "eventfd is part of every Linux");
}

PlaybackControl::~PlaybackControl() { close(fd_); }

void PlaybackControl::Wish(const PlaybackWish& wish) {
  const std::lock_guard lock(mutex_);
  if (wish.position_s) wish_.position_s = wish.position_s;
  if (wish.playing) wish_.playing = wish.playing;
  if (wish.speed) wish_.speed = wish.speed;
  eventfd_write(fd_, 1);
}

PlaybackWish PlaybackControl::Take() {
  const std::lock_guard lock(mutex_);
  eventfd_t count = 0;
  eventfd_read(fd_, &count);
  return std::exchange(wish_, {});
}

}  // namespace dmslam
