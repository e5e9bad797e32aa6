#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "collector/checkpointer.h"
#include "collector/make_collector.h"
#include "collector/process_ledger.h"
#include "collector/proposed_keyframes.h"
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
    /// Of a sequence, by its player: how many, and the index of the first. A live camera announces none.
    std::map<CameraId, std::pair<int64_t, uint32_t>> announced;
    int64_t seen = 0;             ///< whose poses were heard
    int64_t newest_stamp_ns = 0;  ///< time of the newest
    /// Of every camera, its index; none: none has come.
    std::map<CameraId, std::optional<uint32_t>> newest;
  };
  /// What waits for room on the disk.
  struct Disk {
    bool refuses = false;                     ///< frame poses wait
    std::optional<int64_t> refused_since_ns;  ///< ... and nothing else is to come
    int64_t say_again_ns = 0;
    int64_t try_again_ns = 0;  ///< to write the last map, or the results
  };
  /// The map with which the run has ended.
  struct EndedMap {
    std::optional<Replica> found;          ///< on the disk, not yet taken over
    std::optional<uint64_t> safe_version;  ///< need not be written again
    std::optional<int64_t> here_ns;        ///< since when it is here
  };
  /// How the run ends.
  struct Ends {
    std::map<CameraId, EndOfSequence> heard;
    std::set<CameraId> noted;  ///< of those heard, in the journal
    bool of_frontends = false;
    std::optional<int64_t> drained_ns;  ///< since when all streams have been read to their end
  };
  enum class Results : uint8_t {
    kNone,
    kGathered,  ///< to be written
    kDelayed,   ///< the disk had no room for them
    kWritten,
  };
  struct Due {
    int64_t sync_ns = 0, counters_ns = 0;
    int64_t progress_frames = 0;
  };

  bool TakeFrontendRecord();
  bool TakeFrontendRecord(CameraId camera);
  void OnEnd(const EndOfSequence& end);
  void Announce(CameraId camera, std::optional<int64_t> num_frames, uint32_t first_frame);
  int64_t PublishedAsFarAsKnown(CameraId camera, bool ended) const;
  void TakeEnds(bool ended);
  bool TakeMapRecord();
  std::vector<KeyframeId> LoopsOf(std::optional<KeyframeId> id) const;
  void OnCorrection(const MapDelta& delta, const std::vector<KeyframeId>& loops_before);
  void OnGroundTruth(const GroundTruthPose& pose);
  void BeginCheckpoints();
  void ReadNote(const std::string& text);
  bool IsOfThisRun(const std::string& process, const StatusHead& head);
  bool OnHealth(const std::string& process, const StatusHead& head);
  size_t NumKeyframes() const;
  void OnFrontendStatus(FrontendStatus status);
  void CountOwn();
  void RepeatWhatIsLeft();
  bool IsKnown(KeyframeId id, MapId map_id) const;
  void TimeKeyframe(const MapDelta& delta);
  void OnFramePose(const Record& record);
  void OnMapReset(const Record& record);
  void OnSessionStart(const Record& record);
  void CountReset(const MapReset& reset);
  void OnFreshMap(int64_t epoch, bool is_saved);
  void OnAllDied();
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
  void RecallSession();
  void KnowSession(const SessionStart& start);
  void CountFrame(const FramePose& pose);
  void OpenJournal();
  std::string OfTotal() const;
  void SayProgress();
  int64_t SilentNs(const StreamReader& reader) const;
  bool FrontendsHaveEnded();
  bool EndIfDone();
  bool GiveUpOnDisk();
  void WriteAtEnd();
  void ExitAtEnd();
  bool IsWritten() const { return results_ == Results::kWritten; }
  void Gather(bool ended);
  std::string WriteResultFiles(bool ended);
  void Write();

  CollectorOptions collector_;
  RunRecord run_;
  std::unique_ptr<TrajectoryBuilder> builder_;
  std::vector<std::unique_ptr<StreamReader>> frontend_readers_;  ///< by camera
  std::map<CameraId, Version> safe_;  ///< how far each frontend's stream is in the journal
  std::unique_ptr<StreamReader> map_reader_;
  ProcessLedger processes_{&run_};
  ProposedKeyframes proposals_;
  std::set<MapId> dropped_maps_;
  std::unique_ptr<Journal> journal_;  ///< of frame poses: they are in no replica, and needed at the end
  std::unique_ptr<Checkpointer> checkpointer_;  ///< ends before the journal
  std::optional<SessionStart> session_start_;   ///< as the frontend said it
  EndedMap ended_map_;
  Disk disk_;
  Ends ends_;
  Results results_ = Results::kNone;
  Due due_;
  int64_t begun_ns_ = 0;
  FrameCount frames_;
  std::optional<int64_t> map_begun_in_;  ///< the mapper's newest term that continues none
  bool map_is_fresh_ = false;            ///< ... is being read from its beginning
};

}  // namespace dmslam
