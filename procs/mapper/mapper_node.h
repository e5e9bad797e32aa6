#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/mapping/mapper_core.h"
#include "dmslam/runtime/core_thread.h"
#include "dmslam/runtime/heard_sessions.h"
#include "dmslam/runtime/map_snapshots.h"
#include "dmslam/runtime/stream_node.h"
#include "dmslam/settings/run_options.h"
#include "mapper/arrived_records.h"
#include "mapper/camera_requests.h"
#include "mapper/frontend_streams.h"
#include "mapper/keyframe_settling.h"
#include "mapper/left_map.h"
#include "mapper/loop_answers.h"
#include "mapper/make_mapper.h"
#include "mapper/map_parts.h"
#include "mapper/mapper_end.h"
#include "mapper/mapper_report.h"
#include "mapper/saved_map.h"
#include "mapper/unsafe_records.h"

namespace dmslam {

/// The mapper on the bus: the frontend's stream and the loop closer's in, the map stream out. A record of the
/// frontend is accepted only when the map record that holds its effect was acknowledged by another process.
/// The core works in jobs, one at a time, and in real time on a thread of its own: what touches the core is
/// done in a job, or while there is none.
class MapperNode : public StreamNode {
 public:
  using Files = MapperFiles;
  MapperNode(NodeContext context, NodeOptions options, Files files = {});
  ~MapperNode() override;

  /// Also saves the map where that is asked for.
  void Stop() override;

 protected:
  void Begin(const CameraInfo& info) override;
  bool ReadyToWrite() override;
  void OnWriterOpen() override;
  bool WorkOnce() override;
  int64_t WorkDeadline() const override;
  void PublishStatus() override;
  std::string WaitsFor() const override;
  std::string WhyMisfits(const SessionStart& start) const override;
  void OnMessage(const std::string& channel, std::span<const uint8_t> bytes) override;

 private:
  void ListenToFrontends();
  bool PublishPart();
  void JoinFrontend(CameraId camera, const SessionStart& start);
  void TellWhatWasNotDone() const;
  void Save();
  bool TakeCheckpoint();
  void BeginFetch();
  bool FetchReplica();
  void ContinueLeftMap();
  void TakeLoopAnswers();
  void RefuseBrokenCorrections();
  void SettleAgain();
  KeyframeId ApplyFirstAnswer();
  void Complete();
  void DrainAfterEnd();
  bool HandleFirstRecord();
  bool GiveTurn();
  bool AnswerRequests();
  CameraRequests::HasEnded HasEnded() const;
  using Job = std::function<void()>;
  void Run(Job job, std::function<void()> when_done = {});
  Job JobFor(CameraId camera, const Record& record);
  Job LocalizeOnlyJobFor(const Record& record);
  Job KeyframeJobFor(const Record& record);
  void AfterKeyframe(const Version& version, KeyframeId id, MapId map_id, bool checked_by_loopcloser,
                     std::string why_refused = {});
  void Settle(KeyframeId id, MapId map_id, const Version& of_frontend, std::string why_refused = {});
  void SettleAwaited();
  void MarkFrontend(CameraId camera, const Version& version);
  void AcceptWhatIsSafe();
  bool RecordsAreUrgent() const { return records_.AreUrgent(frontends_.LargestBacklog()); }
  void NoteArrivals();
  void PublishDelta(MapDelta delta);
  void InterruptCore();
  bool EndIfDone();
  std::pair<MapperStatus::State, std::string> StateAndReason() const;

  const RunOptions run_;
  Files files_;
  std::optional<SavedMap> saved_;              ///< the map to begin with
  MapParts parts_;                             ///< of a map with which it has begun
  std::optional<SessionStart> session_start_;  ///< of the first camera, from its frontend's stream
  HeardSessions heard_sessions_;               ///< ... and beside it
  std::unique_ptr<MapperCore> core_;
  std::unique_ptr<MapSnapshots> snapshots_;
  FrontendStreams frontends_;
  std::unique_ptr<StreamReader> loop_reader_;
  std::unique_ptr<LeftMap> left_;  ///< while it is looked for
  bool lockstep_ = false;
  MapperEnd end_;
  ArrivedRecords records_;                 ///< of the frontends
  UnsafeRecords unsafe_, unsafe_answers_;  ///< the frontends' and the loop closer's
  CameraRequests requests_;
  LoopAnswers loop_answers_;
  KeyframeSettling settling_;
  KeyframeTiming timing_;
  MapTally tally_;                    ///< the core's, as the map is
  MapperStatus status_;               ///< as the core said it last
  std::atomic<bool> hurries_{false};  ///< asked by the core: it finishes early
  std::atomic<bool> stops_{false};    ///< asked by the core while it adjusts whole maps
  std::unique_ptr<CoreThread> work_;  ///< ends before everything that jobs touch
};

}  // namespace dmslam
