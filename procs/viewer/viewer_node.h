#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/runtime/stream_node.h"
#include "viewer/exchange.h"
#include "viewer/process_board.h"
#include "viewer/seen_camera.h"
#include "viewer/viewer_core.h"

namespace dmslam {

struct ViewerOptions {
  std::string ground_truth;  ///< TUM trajectory; empty: what the player says
};

/// The viewer on the bus: a reader of all streams that holds nobody back, and hands what it sees to those who
/// serve it. It publishes nothing but the acknowledgements of a reader.
class ViewerNode : public StreamNode {
 public:
  /// `exchange` must outlive the node.
  ViewerNode(NodeContext context, NodeOptions options, ViewerOptions viewer, Exchange* exchange);

  /// In haste everything is taken in and nothing is shown, for logs: afterwards it is shown at once.
  void SetInHaste(bool in_haste);
  /// The next Advance shows all there is, whenever something was shown last.
  void ShowAtOnce() { next_draw_ns_ = next_report_ns_ = next_align_ns_ = 0; }

 protected:
  void Begin(const CameraInfo& info) override;
  void OnCamera(const CameraInfo& info) override;
  bool WorkOnce() override;
  void OnMessage(const std::string& channel, std::span<const uint8_t> bytes) override;
  void PublishStatus() override;
  int64_t WorkDeadline() const override;

 private:
  void OnLoose(const std::string& channel, std::span<const uint8_t> bytes);
  bool PassOver(const std::string& channel, std::span<const uint8_t> bytes);
  void OnCollector(const std::string& channel, std::span<const uint8_t> bytes);
  void OnEnd(const EndOfSequence& end);
  void OnStatusMessage(const std::string& channel, std::span<const uint8_t> bytes);
  template <typename Status>
  void Board(const std::string& name, const Status& status, const std::string& state);
  bool TakeMapRecord();
  bool TakeFrontendRecord();
  bool TakeFrontendRecord(SeenCamera* camera);
  void NoteState(const PoseView& view);
  std::string DoesOf(const SeenCamera& camera) const;
  void NoteWhatFrontendsDo();
  std::string Who(CameraId camera) const;
  SeenCamera* FindCamera(CameraId camera);
  bool TakeLoopRecord();
  void NoteMapEvent(const MapDelta& delta);
  void NotePose(const PoseView& view);
  void ShowPoses();
  std::optional<Rigid3d> PlaceOf(const PoseView& view) const;
  void ShowFeatures(const FeatureView& view);
  void DrawIfDue();
  void ReportIfDue();
  void Note(BoardEvent::Level level, const std::string& text) {
    board_.Note(level, text, context_.wall_us());
  }
  std::string StatusJson() const;

  ViewerOptions viewer_;
  Exchange* exchange_;
  std::unique_ptr<ViewerCore> core_;
  std::unique_ptr<StreamReader> map_reader_, loop_reader_;
  ProcessBoard board_;
  std::vector<SeenCamera> seen_cameras_;  ///< by number
  MapperStatus mapper_;
  LoopcloserStatus loopcloser_;
  std::optional<TruthAlignment> alignment_;
  Eigen::Vector3d up_{0, -1, 0};
  bool map_ended_ = false;
  bool in_haste_ = false;
  /// By channel and camera.
  std::map<std::pair<std::string, CameraId>, Bytes>
      passed_over_;           ///< in haste: the newest of what is shown at its end
  uint32_t arrangement_ = 0;  ///< the scene's, as of the last Draw
  int64_t loops_ = 0;
  int64_t map_records_ = 0;
  int64_t next_draw_ns_ = 0;
  int64_t next_report_ns_ = 0;
  int64_t next_align_ns_ = 0;
};

}  // namespace dmslam
