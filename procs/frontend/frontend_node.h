#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/dataset/image.h"
#include "dmslam/runtime/latency_window.h"
#include "dmslam/runtime/stream_node.h"
#include "dmslam/slam/frontend_core.h"
#include "frontend/online_error.h"

namespace dmslam {

/// The frontend on the bus: frames in; session, poses, keyframes and evidence out; its map comes from the map
/// stream.
class FrontendNode : public StreamNode {
 public:
  struct Extras {
    std::shared_ptr<const Vocabulary> vocabulary;
    std::string picture_dir;  ///< empty: no pictures
    int picture_every = 0;    ///< every so manieth frame
  };
  FrontendNode(NodeContext context, NodeOptions options, Extras extras);

 protected:
  void Begin(const CameraInfo& info) override;
  bool ReadyToWrite() override;
  void OnWriterOpen() override;
  bool WorkOnce() override;
  int64_t WorkDeadline() const override {
    if (core_ && core_->IsRefining()) return 0;
    if (grows_back_ && !core_->awaited().valid() && !stopping_ && !AwaitsSavedMap()) return 0;
    if (rest_begun_ && !last_events_ && !stopping_ && !AwaitsSavedMap()) return 0;
    return last_events_ && !finished_ ? next_portion_ns_ : INT64_MAX;
  }
  void OnMessage(const std::string& channel, std::span<const uint8_t> bytes) override;
  void PublishStatus() override;

 private:
  struct Waiting {
    Frame frame;
    int64_t receive_us = 0;
  };

  void OnFrame(std::span<const uint8_t> bytes);
  void OnEndOfSequence(std::span<const uint8_t> bytes);
  /// A map record that is here but not yet applied.
  struct HeldRecord {
    MapDelta delta;
    Version version;
    bool begins_anew = false;
    bool in_snapshot = false;
    bool ends_snapshot = false;
  };

  void TakeMapRecords(bool all);
  size_t NumReadyRecords(bool all) const;
  void ApplyHeldRecords(size_t count);
  Version HandOverVersion();
  bool HoldsBack() const;
  bool AwaitsSavedMap() const;
  bool ProcessWaiting();
  bool CatchUp();
  bool FallsBehind();
  bool DecodeImage(const Frame& frame);
  void PublishEvents(const std::vector<FrontendEvent>& events);
  void PublishViews(const Waiting& waiting, const FramePose& pose, FrameTrace trace);
  void FinishFrame();
  void DrawPicture();
  bool GrowBack();
  bool MapsAreAdjusted();
  static bool IsAnswerToAll(const MapDelta& delta);
  bool WorkAtEnd();
  bool Finish();
  int UnacceptedKeyframes();
  bool HoldsBackForStatus() const;
  void FillCoreStatus(FrontendStatus* status) const;

  Extras extras_;
  std::unique_ptr<FrontendCore> core_;
  std::unique_ptr<StreamReader> map_reader_;
  std::deque<HeldRecord>
      held_;         ///< lock-step: not yet followed by a settled record; or an unfinished snapshot
  Version applied_;  ///< of the replica
  std::optional<Waiting> waiting_;
  std::optional<EndOfSequence> end_;
  bool lockstep_ = false;
  bool grows_back_ = false;  ///< the map, to before its first keyframe
  bool asked_to_adjust_ = false;
  int64_t asked_ns_ = 0;   ///< a mapper that died before it answered is asked again
  bool adjusted_ = false;  ///< all maps, after the last keyframe
  std::optional<std::vector<FrontendEvent>> last_events_;  ///< what is told at the end, in portions
  size_t last_told_ = 0;                                   ///< of them, already
  int64_t next_portion_ns_ = 0;
  bool hurries_ = false;      ///< catches up before it takes another image
  bool within_work_ = false;  ///< of the core, which pumps
  bool work_begun_ = false;   ///< of the core at the end
  bool rest_begun_ = false;   ///< the last frames wait for their last poses
  bool finished_ = false;     ///< everything is said; stays until the mapper has ended
  bool frame_open_ =
      false;  ///< processed, but its keyframe has not settled: frame_done is due later (lock-step)
  int64_t last_index_ = -1;
  int64_t last_stamp_ns_ = 0;
  GrayDecoder decoder_;
  GrayImage image_;
  std::deque<int64_t> keyframe_seqs_;  ///< of records not yet accepted by the mapper
  FramePose last_pose_;
  OnlineError error_;
  int64_t frames_received_ = 0, frames_processed_ = 0, frames_skipped_ = 0, frames_bad_ = 0;
  int64_t status_frames_ = 0;
  int64_t first_stamp_ns_ = 0;
  double first_map_s_ = -1;
  LatencyWindow latency_, decode_, extract_, step_;
};

}  // namespace dmslam
