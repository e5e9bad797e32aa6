#pragma once

#include <memory>

#include "dmslam/loops/loopcloser_core.h"
#include "dmslam/runtime/latency_window.h"
#include "dmslam/runtime/stream_node.h"

namespace dmslam {

/// The loop closer on the bus: keeps a replica of the map, and answers every keyframe with a correction or
/// none.
class LoopcloserNode : public StreamNode {
 public:
  LoopcloserNode(NodeContext context, NodeOptions options, std::shared_ptr<const Vocabulary> vocabulary);

 protected:
  void Begin(const CameraInfo& info) override;
  bool WorkOnce() override;
  void OnMessage(const std::string& channel, std::span<const uint8_t> bytes) override;
  void PublishStatus() override;

 private:
  void Apply(const MapDelta& delta);
  void Answer(KeyframeId keyframe);
  bool EndIfDone();

  std::shared_ptr<const Vocabulary> vocabulary_;
  std::unique_ptr<LoopcloserCore> core_;
  std::unique_ptr<StreamReader> map_reader_;
  bool ended_ = false;
  LatencyWindow check_;
};

}  // namespace dmslam
