#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dmslam/map/feature_store.h"
#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/endpoint.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/core_thread.h"
#include "dmslam/runtime/known_cameras.h"
#include "dmslam/runtime/map_records.h"
#include "dmslam/runtime/map_snapshots.h"
#include "dmslam/runtime/node.h"
#include "dmslam/runtime/node_options.h"
#include "dmslam/runtime/node_traffic.h"
#include "dmslam/runtime/publish.h"
#include "dmslam/runtime/session_choice.h"
#include "dmslam/runtime/status_rounds.h"
#include "dmslam/runtime/wait_notice.h"
#include "dmslam/runtime/writer_candidacy.h"
#include "dmslam/wire/codec.h"
#include "dmslam/wire/record_groups.h"

namespace dmslam {

/// Hash over the fingerprints of all message types: processes with another one are refused by name.
int64_t SchemaHash();

/// Who asked for a stream has gone on with it so long after that, or does not mean it.
inline constexpr int64_t kGoesOnWithinNs = 10'000'000'000;
std::string NobodyWentOn(const std::string& who_asked);

/// Why a process without a key understands nothing of those that have one.
inline constexpr char kHasTag[] = "its sender has a key; give every process the same --key";

/// What the processes have in common: they learn camera and session from the player, decide by election who
/// writes (those that write a stream), keep their streams going, and say how they fare once a second.
class StreamNode : public Node {
 public:
  void Advance() final;
  int64_t deadline_ns() const override;
  void Stop() override;
  std::optional<int> exit_code() const override {
    return ending_ ? std::optional(ending_->code) : std::nullopt;
  }
  std::string problem() const override { return ending_ ? ending_->problem : ""; }
  bool Hangs(int64_t now_ns, int64_t longest_ns) const override;

 protected:
  /// `role` in lower case: "frontend". It names channels in upper case.
  StreamNode(NodeContext context, NodeOptions options, std::string role);

  /// The camera is known: whether this process may begin. Asked again and again.
  virtual bool MayBegin() { return true; }
  /// The camera is known: makes readers, and asks for a writer with WantWriter.
  virtual void Begin(const CameraInfo& info) = 0;
  /// The election is won: whether the writer may be opened now. A mapper first fetches the newest replica, a
  /// frontend the map. Asked again and again.
  virtual bool ReadyToWrite() { return true; }
  /// The writer is open: the node may work.
  virtual void OnWriterOpen() {}
  /// Another process asks for the stream: whether this one has told what only it knows. Asked again and
  /// again.
  virtual bool MayHandOver() { return true; }
  /// Some work, if there is any; called as long as it returns true.
  virtual bool WorkOnce() = 0;
  /// A message outside the streams; `channel` as it is called where there is one camera.
  virtual void OnMessage(const std::string& channel, std::span<const uint8_t> bytes);
  /// A camera is known: of a frontend its own, of the others every one.
  virtual void OnCamera(const CameraInfo&) {}
  /// What is said of another camera of the session, again and again; only a frontend that knows its own hears
  /// it.
  virtual void OnOtherCamera(const CameraInfo&) {}
  virtual void PublishStatus() {}
  /// Processes without which this one cannot go on now, with commas; empty: none. Told to people when it
  /// lasts.
  virtual std::string WaitsFor() const { return {}; }
  /// When WorkOnce has something to do without a message.
  virtual int64_t WorkDeadline() const { return INT64_MAX; }

  /// By the names that channels have where there is one camera; of this process's camera, or of another.
  void Listen(const std::vector<std::string>& channels);
  void Listen(const std::vector<std::string>& channels, CameraId camera);
  /// Of one of the streams that wire/streams.h lists.
  std::unique_ptr<StreamReader> MakeReader(StreamId stream, std::optional<Version> start = Version(),
                                           CameraId camera = 0, bool wants_all = false);
  struct WriterPlan {
    StreamId stream = StreamId::kTest;
    std::vector<std::string> readers;  ///< roles of the lossless readers
    Version parent;
    SnapshotSource* snapshots = nullptr;
  };
  /// Offers the replica of the map that this process holds to a mapper that starts. `held`: its version,
  /// empty while it is not whole. `map` must stay where it is.
  /// `may_read`: whether it may be read now; empty: always.
  void ServeReplica(const Map* map, std::function<Version()> held, std::function<bool()> may_read = {});
  /// Begins the snapshot of the replica for which somebody waits, now that the map may be read.
  void LetSnapshotBegin();
  /// Where a core's jobs run: on a thread of its own in real time, at once in lock-step and wherever nothing
  /// can wake this node.
  std::unique_ptr<CoreThread> MakeCoreThread(PlaybackMode mode, const CoreThread::Options& options = {});
  /// The same for work whose hanging is no reason to end the process, as a disk's.
  std::unique_ptr<CoreThread> MakeUnwatchedThread(PlaybackMode mode, const CoreThread::Options& options = {});
  /// Whether the mapper has said its last word, or has fallen silent after the end of the sequence, for so
  /// long.
  bool MapIsOver(const Map& map, const StreamReader& map_reader, int64_t silent_ns) const;
  /// The same for who holds the map, and stays as long as a mapper or a collector that has died may come back
  /// for it.
  bool NobodyNeedsTheMap(const Map& map, const StreamReader& map_reader) const {
    return MapIsOver(map, map_reader, kBackAfterDeathNs);
  }
  /// Who has died is there again within this time, as far as others wait for it at the end.
  static constexpr int64_t kBackAfterDeathNs = 30'000'000'000;
  /// A frame of this process's camera came before its camera was believed: it confirms the one that was said.
  void ConfirmCamera(uint32_t session);
  /// What a run rests on is known from the disk, where nobody may be left who says it.
  void KnowCamera(const CameraInfo& info);

  void WantWriter(WriterPlan plan) { plan_ = std::move(plan); }
  WriterPlan& writer_plan() { return *plan_; }

  /// Those who are to read this node's stream without loss, are expected on the bus, and do not follow it
  /// yet; with commas.
  std::string AwaitedReaders() const;

  /// Publishes a record of this node's stream; returns its sequence number.
  template <typename Message>
  int64_t PublishRecord(const Message& message) {
    return PublishBytes(wire::Info<Message>().channel, wire::Encode(message));
  }
  /// Publishes a change that may be too large for one record; returns the number of the last one.
  template <typename Message>
  int64_t PublishChange(Message change) {
    int64_t last = 0;
    for (const Message& record : wire::Split(std::move(change))) last = PublishRecord(record);
    return last;
  }
  /// Publishes a message that may be lost. `local`: large, and of use on this host only.
  template <typename Message>
  void PublishLoose(const Message& message, bool local = false) {
    dmslam::PublishLoose(context_.bus, message, local, options_.camera_id);
  }
  /// Decodes one of ours; bad and foreign ones are counted, the first of each kind is logged.
  template <typename Message>
  std::optional<Message> Read(std::span<const uint8_t> bytes) {
    std::string reason;
    std::optional<Message> message = wire::Decode<Message>(bytes, &reason);
    if (!message) CountMalformed(wire::Info<Message>().channel, HasTag(bytes) ? kHasTag : reason);
    return message;
  }
  /// The change that is complete with a record of the map stream; none while its group is not whole. None,
  /// too, where the record cannot be read or breaks its group: that is counted and named, and the reader asks
  /// for a snapshot, so that nothing is applied to a replica that lacks it, and nothing acknowledged. None
  /// where the record tells of no later change than the one before: it is asked for again.
  std::optional<MapDelta> ReadMapRecord(const Record& record, StreamReader* reader);
  /// The version that a replica made of what ReadMapRecord returned holds.
  Version MapHeld(const StreamReader& reader) const { return MapComesInParts() ? Version() : reader.held(); }
  /// Whether a saved map is being published, and more of it is to come: what is here of it is no whole map.
  bool MapComesInParts() const { return map_records_.InParts(); }
  /// A message was dropped; the first one of a channel is logged.
  void CountMalformed(const std::string& channel, const std::string& reason);
  /// Counts messages of other sessions; the first is logged.
  bool IsForeign(uint32_t session);
  /// The same for what the player says: a recorded session that was accepted is ours.
  bool IsForeignFrame(uint32_t session);
  /// On what the session of a frontend rests: the first record of its stream says so, and no other. None
  /// where it does not, which is counted.
  std::optional<SessionStart> ReadSessionStart(const RecordHeader& header, std::span<const uint8_t> bytes);
  /// Why this process does not fit that; empty: it fits.
  virtual std::string WhyMisfits(const SessionStart& start) const;
  /// Where this process does not fit that it ends, and says why.
  void JoinSession(const SessionStart& start);
  /// Whether a record of a frontend, the last one taken, would end this process or drop the map, and has not
  /// been said twice: it may be forged, and is asked for again.
  bool IsDoubtful(const Record& record, StreamReader* reader);

  void Exit(int code, std::string problem = {});
  StatusHead MakeStatusHead(const std::string& reason, const std::vector<const StreamReader*>& readers) const;

  NodeContext context_;
  NodeOptions options_;
  std::shared_ptr<FeatureStore> feature_store_;  ///< of whatever maps this process holds
  std::string role_;
  Endpoint endpoint_;
  uint32_t session_ = 0;
  std::optional<uint32_t> recorded_session_;  ///< whose camera and frames are played to us
  std::optional<CameraInfo> camera_info_;
  std::unique_ptr<StreamWriter> writer_;
  bool stopping_ = false;

 private:
  int64_t PublishBytes(const std::string& channel, Bytes bytes);
  void Receive(const std::string& channel, std::span<const uint8_t> bytes);
  void OnCameraInfo(CameraId camera, std::span<const uint8_t> bytes);
  bool MayBeOurs(uint32_t session);
  bool MayChooseSession();
  void BelieveCamera(CameraInfo info);
  void OnSurplusCamera(const CameraInfo& info);
  bool IsOfCamera() const;
  void KeepCameraKnown();
  void RunElection();
  void StartElection();
  void BeginWritingWhenSettled();
  StreamWriter::Options MakeWriterOptions() const;
  std::vector<std::string> ReaderNames() const;
  void WatchWriter();
  void WatchHandOver();
  void WatchReaders();
  /// Keeps the protocol alive while one step of work follows the other.
  void PumpBetweenSteps();
  void NoteQueue();
  void PublishStatusIfDue();
  struct Watched;
  void RefuseOtherTypes(Watched* watched);
  void WarnOnce(const std::string& matter, const std::string& text);

  struct Ending {
    int code = 0;
    std::string problem;
  };
  struct Watched {
    const StreamReader* reader;
    std::string owner;                       ///< of the stream
    std::string problem;                     ///< last one logged
    std::optional<int64_t> misfit_since_ns;  ///< its writer has other message types
  };
  /// The map as it is here, for a mapper that begins.
  struct ServedReplica {
    std::unique_ptr<MapSnapshots> snapshots;
    std::unique_ptr<ReplicaServer> server;
  };

  bool begun_ = false;
  std::optional<int64_t> hands_over_until_ns_;  ///< then who asked for the stream must have gone on with it
  std::optional<SessionChoice> choice_;         ///< of who was not told its session
  KnownCameras cameras_;
  std::optional<WriterPlan> plan_;
  std::unique_ptr<WriterCandidacy> candidacy_;  ///< until the writer is open
  std::optional<Ending> ending_;
  StatusRounds rounds_;
  int64_t started_ns_ = 0;
  NodeTraffic traffic_;
  MapRecords map_records_;
  WaitNotice wait_notice_;
  std::vector<Watched> readers_;
  std::vector<const CoreThread*> core_threads_;  ///< that are watched; owned by the node that asked for them
  ServedReplica replica_;
};

}  // namespace dmslam
