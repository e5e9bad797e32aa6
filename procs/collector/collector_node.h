#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "collector/checkpointer.h"
#include "collector/make_collector.h"
#include "collector/results.h"
#include "dmslam/recording/journal.h"
#include "dmslam/runtime/stream_node.h"
#include "dmslam/slam/trajectory_builder.h"

namespace dmslam {

/// Reads the frontend's and the mapper's streams and everybody's statuses, and writes the run's results when
/// the sequence has drained through all streams. A reader like any other.
class CollectorNode : public StreamNode {
 public:
  CollectorNode(NodeContext context, NodeOptions options, CollectorOptions collector);

  /// Writes what there is.
  void Stop() override;

 protected:
  void Begin(const CameraInfo& info) override;
  void OnCamera(const CameraInfo& info) override;
  bool WorkOnce() override;
  void OnMessage(const std::string& channel, std::span<const uint8_t> bytes) override;
  int64_t WorkDeadline() const override;
  void PublishStatus() override;

 private:
  struct FrameCount {
    int64_t total = 0;                   ///< of the sequence, as far as the player said; 0: it did not
    int64_t seen = 0;                    ///< whose poses were heard
    int64_t newest_stamp_ns = 0;         ///< time of the newest
    std::map<CameraId, int64_t> newest;  ///< of every camera, its index; -1: none has come
  };

  bool TakeFrontendRecord();
  bool TakeFrontendRecord(CameraId camera);
  void OnEnd(const EndOfSequence& end);
  void TakeEnds();
  bool TakeMapRecord();
  std::vector<KeyframeId> LoopsOf(std::optional<KeyframeId> id) const;
  void OnCorrection(const MapDelta& delta, const std::vector<KeyframeId>& loops_before);
  void OnGroundTruth(const GroundTruthPose& pose);
  void BeginCheckpoints();
  void OnProcess(const std::string& process, int32_t pid, const ProcessHealth& so_far);
  void ReadNote(const std::string& text);
  bool OnHealth(const std::string& process, const StatusHead& head);
  void OnFrontendStatus(FrontendStatus status);
  void CountOwn();
  void OnProposal(KeyframeId id, MapId map_id);
  void TimeKeyframe(const MapDelta& delta);
  void OnFramePose(const Record& record);
  void OnMapReset(const Record& record);
  void OnSessionStart(const Record& record);
  void CountReset(const MapReset& reset);
  void NoteCounters();
  void OnResume();
  bool MapMayBeKept() const;
  void KeepCheckpoint();
  void KeepOnDisk(const Record& record);
  void RetryDisk();
  void AcceptWhatIsSafe();
  void NotePositions();
  bool AllTaken() const;
  void AcceptMap();
  bool EndedMapIsSafe();
  void RecallEndedMap();
  void CountFrame(const FramePose& pose);
  void CountMissingKeyframes();
  void OpenJournal();
  std::string OfTotal() const;
  void SayProgress();
  int64_t SilentNs(const StreamReader& reader) const;
  bool FrontendsHaveEnded();
  bool EndIfDone();
  bool GiveUpOnDisk();
  void WriteAtEnd();
  void ExitAtEnd();
  void Gather(bool ended);
  std::string WriteResultFiles(bool ended);
  void Write();

  CollectorOptions collector_;
  RunRecord run_;
  std::unique_ptr<TrajectoryBuilder> builder_;
  std::vector<std::unique_ptr<StreamReader>> frontend_readers_;  ///< by camera
  std::map<CameraId, Version> safe_;  ///< how far each frontend's stream is in the journal
  std::unique_ptr<StreamReader> map_reader_;
  std::map<std::string, std::set<int32_t>> process_ids_;
  std::map<std::string, ProcessHealth>
      former_;  ///< counters of processes that another has followed, together
  std::map<CameraId, FrontendStatus> former_frontends_;
  std::map<KeyframeId, MapId> proposed_;        ///< keyframes that the frontend said should be
  std::map<KeyframeId, int64_t> heard_ns_;      ///< when each was said to be one
  std::set<KeyframeId> proposed_before_crash_;  ///< of them, those of before all processes died
  std::set<MapId> dropped_maps_;
  std::unique_ptr<Journal> journal_;  ///< of frame poses: they are in no replica, and needed at the end
  std::unique_ptr<Checkpointer> checkpointer_;  ///< ends before the journal
  std::optional<SessionStart> session_start_;   ///< as the frontend said it
  std::optional<Replica> ended_map_;            ///< found on the disk, not yet taken over
  bool disk_refuses_ = false;                   ///< frame poses wait for it
  std::optional<int64_t> refused_since_ns_;     ///< ... and nothing else is to come
  int64_t say_again_ns_ = 0;
  int64_t try_again_ns_ = 0;              ///< to write the last map, or the results
  int64_t ended_ns_ = 0;                  ///< when the last map was here
  std::optional<uint64_t> safe_version_;  ///< of the last map: need not be written again
  bool gathered_ = false;                 ///< the results are to be written
  bool results_wait_ = false;             ///< ... and the disk had no room for them
  int64_t begun_ns_ = 0;
  int64_t next_sync_ns_ = 0, next_counters_ns_ = 0;
  int64_t next_progress_ = 0;
  std::map<CameraId, EndOfSequence> ends_;
  std::set<CameraId> noted_ends_;
  FrameCount frames_;
  int64_t drained_ns_ = 0;
  bool map_is_fresh_ = false;  ///< a map stream has begun that continues none
  bool frontends_ended_ = false;
  bool written_ = false;
};

}  // namespace dmslam
