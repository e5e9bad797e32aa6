#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/runtime/stream_node.h"
#include "dmslam/runtime/work_sign.h"
#include "dmslam/settings/run_options.h"
#include "dmslam/slam/sequence_end.h"
#include "frontend/camera_turns.h"
#include "frontend/frame_timing.h"
#include "frontend/frame_tracking.h"
#include "frontend/frontend_work.h"
#include "frontend/held_records.h"
#include "frontend/incoming_frames.h"
#include "frontend/last_words.h"
#include "frontend/left_keyframes.h"
#include "frontend/make_frontend.h"
#include "frontend/other_models.h"
#include "frontend/pose_report.h"
#include "frontend/refused_images.h"
#include "frontend/remembered_frames.h"
#include "frontend/unaccepted_keyframes.h"

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
  bool MayHandOver() override;
  bool WorkOnce() override;
  int64_t WorkDeadline() const override;
  void OnMessage(const std::string& channel, std::span<const uint8_t> bytes) override;
  void OnOtherCamera(const CameraInfo& info) override;
  void PublishStatus() override;
  std::string WaitsFor() const override;

 private:
  SessionStart MakeSessionStart() const;
  void SaySessionAgain();
  void LeaveEndedMap();
  bool GivesWay();
  void OnFrame(std::span<const uint8_t> bytes);
  FrameDone DoneWithNewest() const;
  void OnEndOfSequence(std::span<const uint8_t> bytes);
  bool ProposeWhatWasLeft();
  FrontendCore& core() const { return work_->core(); }
  bool InLockstep() const { return camera_info_ && camera_info_->mode == PlaybackMode::kLockstep; }
  bool HasTurn(uint32_t frame_index, const TurnTime& time);
  void TakeMapRecords();
  void ApplyHeldRecords(size_t count, bool at_once);
  void OnApplied(size_t count);
  Version HandOverVersion();
  bool HoldsBack() const;
  bool AwaitsSavedMap() const;
  bool AwaitsFirstReaders() const;
  bool MayTrackWaiting();
  bool TrackWaiting();
  void Track(const ReceivedFrame& received, bool withheld);
  void OnRefused(const ImageProblem& problem);
  bool FallsBehind();
  bool CatchUp();
  void Publish(const std::vector<FrontendEvent>& events);
  void PublishTracked(const Tracked& tracked);
  void FinishFrame();
  bool WorkAtEnd();
  bool WorkOn(SequenceEnd::Phase phase);
  void OnWorked(SequenceEnd::Phase phase, const SequenceEnd::Worked& worked);
  bool Refine();
  void AskForAdjustedMaps();
  void PublishSequenceDone();
  bool TellLastPoses();
  bool IsHeldUp() const;

  const RunOptions run_;
  FrontendExtras extras_;
  std::unique_ptr<StreamReader> map_reader_;
  HeldRecords held_;
  IncomingFrames frames_;
  CameraTurns turns_;
  std::optional<FrameTracking> tracking_;
  RefusedImages refused_;
  OtherModels other_models_;
  bool hurries_ = false;  ///< catches up before it takes another image
  SequenceEnd end_;
  LastWords last_words_;
  std::optional<SessionStart> session_start_;  ///< as it was said
  std::optional<LeftKeyframes> left_;          ///< by a frontend before this one
  UnacceptedKeyframes unaccepted_;
  PoseReport pose_;
  FrameTiming timing_;
  std::shared_ptr<WorkSign> search_sign_ = std::make_shared<WorkSign>();  ///< of the search for a first map
  std::optional<RememberedFrames> remembered_;  ///< on the core, or while there is no job
  std::unique_ptr<FrontendWork> work_;          ///< ends before everything that jobs touch
};

}  // namespace dmslam
