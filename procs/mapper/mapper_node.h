#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "common/latency_window.h"
#include "common/stream_node.h"
#include "dmslam/recording/map_file.h"
#include "mapper/map_snapshots.h"
#include "mapper/mapper_core.h"

namespace dmslam {

/// The mapper on the bus: the frontend's stream and the loop closer's in, the map stream out. A record of the frontend is
/// accepted only when the map record that holds its effect was acknowledged by another process.
class MapperNode : public StreamNode {
 public:
  /// Maps as files; empty: none.
  struct Files {
    std::string load;  ///< a saved map, or a log: the map to begin with
    std::string save;  ///< where the map is written at the end
  };
  MapperNode(NodeContext context, NodeOptions options, Files files = {});

  /// Also saves the map where that is asked for.
  void Stop() override;

 protected:
  void Begin(const CameraInfo& info) override;
  bool WorkOnce() override;
  void PublishStatus() override;

 private:
  struct Pending {
    Version of_frontend;
    int64_t map_seq = 0;
  };

  uint16_t ContinueSavedMap(const CameraInfo& info);
  bool PublishSavedMap();
  void Save();
  void TakeLoopAnswers();
  void Handle(const Record& record);
  void HandleKeyframe(const KeyframeProposal& proposal);
  void HandleInitialMap(const InitialMap& proposal);
  void AfterKeyframe(KeyframeId id, MapId map_id, bool checked_by_loopcloser);
  void SettleAwaited();
  void AcceptWhatIsSafe();
  bool KeyframeWaits() const;
  void PublishDelta(const MapDelta& delta);
  bool EndIfDone();
  void FillCoreStatus(MapperStatus* status) const;

  Files files_;
  std::optional<RebuiltMap> saved_;      ///< loaded, not yet taken over
  std::deque<MapDelta> saved_parts_;     ///< of that map, not yet published
  SessionStart session_start_;           ///< as the frontend said it
  std::unique_ptr<MapperCore> core_;
  std::unique_ptr<MapSnapshots> snapshots_;
  std::unique_ptr<StreamReader> frontend_reader_, loop_reader_;
  bool lockstep_ = false;
  bool ended_ = false;
  bool end_announced_ = false;
  std::deque<Record> taken_;             ///< records of the frontend, taken and not yet handled
  std::deque<Pending> pending_;          ///< handled, not yet safe
  std::deque<LoopAnswer> answers_;
  KeyframeId awaited_;                   ///< lock-step: the loop closer's answer to this keyframe is due
  MapId awaited_map_ = 0;
  KeyframeId last_settled_;
  int64_t keyframe_begin_ns_ = 0;
  LatencyWindow to_landmarks_, to_adjusted_;
};

}  // namespace dmslam
