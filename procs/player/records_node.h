#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "dmslam/map/replica.h"
#include "dmslam/recording/log_index.h"
#include "dmslam/runtime/stream_node.h"

namespace dmslam {

/// Takes the frontend's part from a log: enters its recorded keyframes as the writer of a new session, in
/// lock-step with the mapper, which so rebuilds the map without any image.
///
/// The mapper numbers its landmarks anew, so what the records say of landmarks is translated: a recorded
/// landmark is the one that the same feature of the same keyframe sees now.
class RecordsNode : public StreamNode {
 public:
  /// `session`: of the log; 0: the only one. Throws InputError when the log holds no keyframes.
  RecordsNode(NodeContext context, NodeOptions options, std::shared_ptr<const LogIndex> log,
              uint32_t session);

 protected:
  void Begin(const CameraInfo& info) override;
  bool WorkOnce() override;
  int64_t WorkDeadline() const override { return next_info_ns_; }

 private:
  void PublishCameraInfo();
  void TakeMapRecords();
  void AdvanceRecordedMap(int64_t until_order);
  void Enter(const RecordedMessage& message);
  std::optional<LandmarkId> Translate(LandmarkId recorded) const;
  void Translate(KeyframeProposal* proposal);
  void Translate(FrameEvidence* evidence);
  bool Finish();

  std::shared_ptr<const LogIndex> log_;
  Replay records_, map_records_;
  size_t next_record_ = 0, next_map_record_ = 0;
  Replica recorded_;  ///< the map as it was when the next record was made
  wire::RecordGroups<MapDelta> recorded_groups_;
  Replica live_;               ///< the map that is being made
  std::deque<MapDelta> held_;  ///< not yet followed by a settled record
  std::unique_ptr<StreamReader> map_reader_;
  std::optional<KeyframeId> awaited_;  ///< proposed, not yet settled
  bool finished_ = false;
  int64_t next_info_ns_ = 0;
  int64_t infos_said_ = 0;
  int64_t keyframes_ = 0, dropped_ = 0;
};

}  // namespace dmslam
