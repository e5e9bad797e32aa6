#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "dmslam/loops/loopcloser_core.h"
#include "dmslam/runtime/core_thread.h"
#include "dmslam/runtime/heard_sessions.h"
#include "dmslam/runtime/latency_window.h"
#include "dmslam/runtime/stream_node.h"

namespace dmslam {

/// The loop closer on the bus: keeps a replica of the map, and answers every keyframe with a correction or
/// none. The core works in jobs, one record at a time, and in real time on a thread of its own.
class LoopcloserNode : public StreamNode {
 public:
  LoopcloserNode(NodeContext context, NodeOptions options, std::shared_ptr<const Vocabulary> vocabulary);
  ~LoopcloserNode() override;

  void Stop() override;

 protected:
  void Begin(const CameraInfo& info) override;
  bool WorkOnce() override;
  void OnMessage(const std::string& channel, std::span<const uint8_t> bytes) override;
  void PublishStatus() override;
  std::string WaitsFor() const override;
  std::string WhyMisfits(const SessionStart& start) const override;

 private:
  void WorkOn(const Record& record);
  void OnStep(LoopcloserCore::Step step);
  void Answer(KeyframeId keyframe);
  void JoinMappedSessions();
  bool EndIfDone();
  LoopcloserStatus CoreStatus() const;
  std::pair<LoopcloserStatus::State, std::string> StateAndReason() const;

  std::shared_ptr<const Vocabulary> vocabulary_;
  std::unique_ptr<LoopcloserCore> core_;
  std::unique_ptr<StreamReader> map_reader_;
  HeardSessions sessions_;
  bool ended_ = false;
  LatencyWindow query_, check_;
  int64_t query_began_ns_ = 0;        ///< the core's
  LoopcloserStatus core_status_;      ///< what the core had to say of itself last
  std::atomic<bool> stop_{false};     ///< asked by the core: it finishes early
  std::unique_ptr<CoreThread> work_;  ///< ends before everything that jobs touch
};

}  // namespace dmslam
