#include "player/log_output.h"

#include "dmslam/wire/channels.h"

namespace dmslam {

void LogOutput::Publish(const Outgoing& message) {
  const std::string& channel = message.channel;
  const bool of_camera = channel == channels::kCameraInfo || channel == channels::kFrame ||
                         channel == channels::kGroundTruthPose || channel == channels::kEndOfSequence;
  if (!of_camera || ended_) return;
  log_.Write(now_ns_ / 1000, prefix_ + channel, *message.bytes);
  ended_ = channel == channels::kEndOfSequence;
}

}  // namespace dmslam
