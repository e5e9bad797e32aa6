#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/dataset/image.h"
#include "dmslam/runtime/core_thread.h"
#include "dmslam/runtime/latency_window.h"
#include "dmslam/runtime/stream_node.h"
#include "dmslam/settings/run_options.h"
#include "dmslam/slam/frontend_core.h"
#include "dmslam/slam/sequence_end.h"
#include "frontend/held_records.h"
#include "frontend/last_words.h"
#include "frontend/left_keyframes.h"
#include "frontend/make_frontend.h"
#include "frontend/online_error.h"
#include "frontend/play_order.h"

namespace dmslam {

/// The frontend on the bus: frames in; session, poses, keyframes and evidence out; its map comes from the map
/// stream. The core works in jobs, one at a time, and in real time on a thread of its own: what touches the
/// core is done in a job, or while there is none.
class FrontendNode : public StreamNode {
 public:
  FrontendNode(NodeContext context, const NodeOptions& options, FrontendExtras extras);

  void Stop() override;
  bool Hangs(int64_t now_ns, int64_t longest_ns) const override;

 protected:
  void Begin(const CameraInfo& info) override;
  bool ReadyToWrite() override;
  void OnWriterOpen() override;
  bool WorkOnce() override;
  int64_t WorkDeadline() const override;
  void OnMessage(const std::string& channel, std::span<const uint8_t> bytes) override;
  void PublishStatus() override;

 private:
  struct Waiting {
    Frame frame;
    int64_t receive_us = 0;
  };

  struct FrameCounts {
    int64_t received = 0, processed = 0, skipped = 0, bad = 0, of_other_size = 0;
    int64_t processed_at_status = 0;  ///< when the last status was published
  };
  struct NewestTaken {
    uint32_t index = 0;
    std::optional<int64_t> stamp_ns;  ///< none: it is known from the map alone, which knows no stamp
  };
  struct FirstMap {
    std::optional<int64_t> since_ns;  ///< stamp of the first frame
    std::optional<double> after_s;    ///< from then to the first pose; none: there is none yet
  };
  struct FrameTimes {
    LatencyWindow latency, decode, extract, step;
  };

  /// What the core makes of a frame.
  struct Tracked {
    FrameTrace trace;
    FrontendOutput output;
    OdometryState odometry;
    FeatureView features;
    double extract_ms = 0;
  };

  SessionStart MakeSessionStart() const;
  void SaySessionAgain();
  void LeaveEndedMap();
  void OnFrame(std::span<const uint8_t> bytes);
  std::optional<PlayOrder::Place> NewestFrame() const;
  FrameDone DoneWithNewest() const;
  void OnEndOfSequence(std::span<const uint8_t> bytes);
  void OnKeyframe(std::span<const uint8_t> bytes);
  bool ProposeWhatWasLeft();
  /// Several cameras in lock-step: the frame that waits for its turn.
  struct Turn {
    std::optional<uint32_t> asked, given;
    Term asked_of;  ///< the mapper
  };

  /// When the next frame may come.
  struct Pace {
    bool lockstep = false;
    bool takes_turns = false;  ///< with other cameras
    Turn turn;
    bool frame_open = false;  ///< processed, but its keyframe has not settled: frame_done is due later
  };

  using Job = std::function<void()>;
  bool Run(Job job);
  bool HasTurn(uint32_t frame_index, std::optional<int64_t> stamp_ns);
  void TakeMapRecords();
  void ApplyHeldRecords(size_t count, bool at_once);
  void OnApplied(size_t count);
  Version HandOverVersion();
  bool HoldsBack() const;
  bool AwaitsSavedMap() const;
  bool AwaitsFirstReaders() const;
  bool TrackWaiting();
  void Track(const Waiting& waiting, bool withheld);
  bool DecodeImage(const Frame& frame);
  void OnBadImage(const std::string& problem);
  void OnImageOfOtherSize(const std::string& problem);
  FeatureView ViewOfFeatures() const;
  void DrawPicture(const FrontendOutput& output);
  bool FallsBehind();
  bool CatchUp();
  void Publish(const std::vector<FrontendEvent>& events);
  void PublishTracked(const Tracked& tracked);
  void PublishOdometry(const OdometryState& odometry, const FrameTrace& trace);
  void PublishView(const FrameTrace& trace);
  void FinishFrame();
  bool WorkAtEnd();
  bool WorkOn(SequenceEnd::Phase phase);
  void OnWorked(SequenceEnd::Phase phase, const SequenceEnd::Worked& worked);
  bool Refine();
  void AskForAdjustedMaps();
  void PublishSequenceDone();
  bool TellLastPoses();
  int UnacceptedKeyframes();
  bool IsHeldUp() const;
  void FillPoseStatus(FrontendStatus* status) const;
  FrontendStatus CoreStatus() const;

  const RunOptions run_;
  FrontendExtras extras_;
  std::unique_ptr<FrontendCore> core_;
  std::unique_ptr<StreamReader> map_reader_;
  HeldRecords held_;
  std::optional<Waiting> waiting_;
  PlayOrder order_;
  SequenceEnd end_;
  LastWords last_words_;
  Pace pace_;
  bool hurries_ = false;               ///< catches up before it takes another image
  std::optional<NewestTaken> newest_;  ///< frame; none: none was taken
  GrayDecoder decoder_;
  GrayImage image_;
  struct LeftBehind {
    LeftKeyframes keyframes;
    std::optional<int64_t> until_ns;  ///< then all of it was heard; none: not yet known
  };
  std::optional<SessionStart> session_start_;  ///< as it was said
  std::optional<LeftBehind> left_;             ///< by a frontend before this one
  std::deque<int64_t> keyframe_seqs_;          ///< of records not yet accepted by the mapper
  FramePose last_pose_;
  OnlineError error_;
  FrameCounts counts_;
  FirstMap first_map_;
  FrameTimes times_;
  std::shared_ptr<WorkSign> search_sign_ = std::make_shared<WorkSign>();  ///< of the search for a first map
  FrontendStatus core_status_;        ///< what the core had to say of itself last
  std::unique_ptr<CoreThread> work_;  ///< ends before everything that jobs touch
};

}  // namespace dmslam
