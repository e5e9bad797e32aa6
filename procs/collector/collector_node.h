#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "collector/checkpointer.h"
#include "collector/collector_place.h"
#include "collector/ended_map.h"
#include "collector/heard_frames.h"
#include "collector/kept_records.h"
#include "collector/make_collector.h"
#include "collector/played_sequences.h"
#include "collector/process_ledger.h"
#include "collector/proposed_keyframes.h"
#include "collector/run_record.h"
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
  bool MayBegin() override;
  void Begin(const CameraInfo& info) override;
  void OnCamera(const CameraInfo& info) override;
  bool WorkOnce() override;
  void OnMessage(const std::string& channel, std::span<const uint8_t> bytes) override;
  int64_t WorkDeadline() const override;
  void PublishStatus() override;
  std::string WaitsFor() const override;

 private:
  /// How the run ends.
  struct Ends {
    bool of_frontends = false;
    std::optional<int64_t> drained_ns;             ///< since when all streams have been read to their end
    std::optional<int64_t> disk_refuses_since_ns;  ///< frame poses wait, and nothing else is to come
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

  void HearReader(std::span<const uint8_t> bytes);
  void YieldToOther();
  bool TakeFrontendRecord();
  bool TakeFrontendRecord(CameraId camera);
  bool TakeMapRecord();
  void OnGroundTruth(const GroundTruthPose& pose);
  void BeginCheckpoints();
  void ReadNote(const std::string& text);
  bool IsOfThisRun(const std::string& process, const StatusHead& head);
  bool OnHealth(const std::string& process, const StatusHead& head);
  size_t NumKeyframes() const;
  void OnPlayerStatus(const PlayerStatus& status);
  void OnFrontendStatus(FrontendStatus status);
  void CountOwn();
  void RepeatWhatIsLeft();
  void TimeKeyframe(const MapDelta& delta);
  void OnFramePose(const Record& record);
  void OnMapReset(const Record& record);
  void OnSessionStart(const Record& record);
  void CountReset(const MapReset& reset);
  bool WasCarriedOut(const MapReset& reset) const;
  bool MapMayBeKept() const;
  void KeepCheckpoint();
  void KeepOnDisk(const Record& record);
  void AcceptWhatIsSafe();
  void NotePositions();
  bool AllTaken() const;
  void AcceptMap();
  bool EndedMapIsSafe();
  void RecallEndedMap();
  void RecallSession();
  void KnowSession(const SessionStart& start);
  void OpenJournal();
  void TakeJournaled(std::span<const uint8_t> record);
  std::string OfTotal() const;
  void SayProgress();
  static constexpr int64_t kGoneNs = 2'000'000'000;  ///< whoever was not heard for so long is not there
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
  std::unique_ptr<StreamReader> map_reader_;
  ProcessLedger processes_{&run_};
  ProposedKeyframes proposals_;
  PlayedSequences sequences_;
  HeardFrames frames_;
  std::optional<KeptRecords> kept_;
  std::unique_ptr<Checkpointer> checkpointer_;  ///< ends before the journal
  std::optional<SessionStart> session_start_;   ///< as the frontend said it
  EndedMap ended_map_;
  int64_t try_again_ns_ = 0;  ///< to write the last map, or the results, where there was no room on the disk
  Ends ends_;
  Results results_ = Results::kNone;
  Due due_;
  CollectorPlace place_;
  bool map_is_fresh_ = false;  ///< a map that continues none is read from its beginning
};

}  // namespace dmslam
