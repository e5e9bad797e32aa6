#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "dmslam/features/orb_extractor.h"
#include "dmslam/initialization/baseline_initializer.h"
#include "dmslam/initialization/initializer.h"
#include "dmslam/map/proposals.h"
#include "dmslam/map/replica.h"
#include "dmslam/refinement/final_poses.h"
#include "dmslam/refinement/frame_refiner.h"
#include "dmslam/slam/frontend_options.h"
#include "dmslam/tracking/pose_tracker.h"
#include "dmslam/tracking/relocalizer.h"
#include "dmslam/tracking/tracked_frame.h"

namespace dmslam {

/// Takes a frame of the stream in which a first map is looked for, and says what is known by now.
using FirstMapSearch = std::function<InitializerReport(const InitializerFrame&)>;

/// A record of the frontend's stream.
using FrontendEvent = std::variant<FramePose, InitialMap, KeyframeProposal, FrameEvidence, MapReset>;

struct FrontendCounters {
  uint64_t frames = 0;
  uint64_t tracked = 0;
  uint64_t uncertain = 0;
  uint64_t lost = 0;
  uint64_t relocalizations = 0;
  uint64_t resets = 0;
  uint64_t keyframes_proposed = 0;
  uint64_t keyframes_withheld = 0;  ///< wanted, but the mapper is behind
  uint64_t localized_later = 0;
};

/// Tracks the camera in a replica of the map and proposes keyframes. Knows no bus, no clock and no thread:
/// images and map records in, records out. The same inputs give the same outputs.
class FrontendCore {
 public:
  struct Setup {
    FrontendOptions options;
    OrbExtractorOptions extractor;
    InitializerOptions initializer;
    Camera camera;
    Pyramid pyramid;
    uint32_t session = 1;
    uint64_t seed = 0;
    bool in_saved_map = false;   ///< begins lost in a map that is there already
    bool localize_only = false;  ///< ... and adds nothing to it
    /// Frames that came while the first map was made are tracked one by one with CatchUp(), and those that
    /// come meanwhile wait their turn; else all at once when the map is there.
    bool catch_up_in_portions = false;
    std::function<FirstMapSearch(FirstMapSearch)>
        run_search;  ///< how the search for a first map is run, as in the background; empty: at once
    std::shared_ptr<const Vocabulary>
        vocabulary;  ///< for relocalisation; without one only the newest places are tried
  };
  explicit FrontendCore(Setup setup);

  /// A record of the map stream; call between frames.
  void ApplyMapDelta(const MapDelta& delta);
  /// After the record that tells of maps adjusted at the end, and before the next one: whether frames wait
  /// for their last poses, and finds that of one (applying a record or finishing does it for all that are
  /// left).
  bool IsRefining() const { return refiner_.IsBusy(); }
  void RefineNext();
  /// Makes those wait too that no record told of: their maps were not adjusted.
  void RefineRest();
  /// The replica is void: a fresh map stream, or a snapshot, begins.
  void ForgetMap();
  /// Joins a system that has been running: it is lost in the newest map that it was given.
  void Resume();
  /// Whether a keyframe was proposed whose settled record has not come: lock-step waits for it.
  KeyframeId awaited() const { return awaited_; }
  /// Told by the node: no more keyframes now (too many are not acknowledged).
  void SetWithheld(bool withheld) { withheld_ = withheld; }

  /// Tracks one frame; appends what there is to say, in order. The last FramePose in `events` is this
  /// frame's.
  void ProcessImage(uint32_t frame_index, int64_t stamp_ns, const GrayView& image,
                    std::vector<FrontendEvent>* events);
  void ProcessFeatures(uint32_t frame_index, int64_t stamp_ns, FeatureSet features,
                       std::vector<FrontendEvent>* events);
  /// When the sequence has ended, before the mapper adjusts its maps: places one of the frames that had no
  /// pose when they came, the newest first, and proposes it as a keyframe where it shows more of the scene
  /// than the map has. So the map grows back to before its first keyframe. Not while a keyframe is awaited.
  /// False: nothing is left to do.
  bool GrowBack(std::vector<FrontendEvent>* events);
  /// At the end of the sequence, when no frame waits to be refined: does a part of what is left to do, which
  /// is to place frames that had no pose when they came and to join the poses with the camera's motion.
  /// False: all is done.
  bool WorkAtEnd();
  /// Called from within long work: delivers what has arrived; may do nothing, and does not change the core.
  void SetPump(std::function<void()> pump) { pump_ = std::move(pump); }
  /// Does all that is left and tells the last poses.
  void Finish(std::vector<FrontendEvent>* events);
  /// Whether frames wait to be tracked, and tracks the oldest of them (there must be one).
  bool IsBehind() const { return !behind_.empty(); }
  size_t num_behind() const { return behind_.size(); }
  void CatchUp(std::vector<FrontendEvent>* events);

  TrackingState state() const { return state_; }
  const TrackedFrame& frame() const { return frame_; }
  const Map& map() const { return map_; }
  const FrontendCounters& counters() const { return counters_; }
  double extract_ms() const { return extract_ms_; }

 private:
  /// The placed frame that follows one to be placed, and the motion from there to the one after it.
  struct LaterNeighbours {
    std::optional<TrackedFrame> next;
    std::optional<Rigid3d> T_moving_after;  ///< camera of frame `moving` from that of its successor
    uint32_t moving = 0;

    /// By constant velocity backwards, where the three frames are consecutive.
    std::optional<Rigid3d> Predict(uint32_t index) const;
    /// A hand-held camera can have come from the frame's pose to that of `next`; `depth` of the scene [map
    /// units].
    bool Plausible(const TrackedFrame& frame, double depth) const;
    /// The frame was placed: it is the next one now, and the motion from it is kept where they are
    /// consecutive.
    void MoveTo(TrackedFrame frame);
  };
  struct Placed {
    KeyframeId reference;
    Rigid3d T_cam_reference;
    double scale = 1.0;
  };

  FirstMapSearch MakeInitializer() const;
  FirstMapSearch MakeSearch() const;
  void Initialize(std::vector<FrontendEvent>* events);
  void AwaitMap(std::vector<FrontendEvent>* events);
  void Track(std::vector<FrontendEvent>* events);
  bool FindPose();
  std::optional<Rigid3d> PredictPose() const;
  void OnTracked(const TrackingReport& report, std::vector<FrontendEvent>* events);
  void OnNotTracked(const TrackingReport& report, std::vector<FrontendEvent>* events);
  void GiveUpMap(bool drop, const std::string& reason, std::vector<FrontendEvent>* events);
  void PutBackFramesOf(MapId map_id);
  bool WantsKeyframe(const TrackingReport& report);
  void ProposeKeyframe(std::vector<FrontendEvent>* events);
  void FlushEvidence(std::vector<FrontendEvent>* events);
  std::optional<Placed> Place(const Rigid3d& T_cam_world, KeyframeId reference) const;
  FramePose MakePose(TrackingState state, const TrackingReport& report) const;
  TrackedFrame FrameOfKeyframe(const Keyframe& keyframe) const;
  TrackingReport LocalizeLater(TrackedFrame* frame);
  TrackingReport TrackBackwards(double depth, TrackedFrame* frame);
  void KeepPlacedLater(const TrackingReport& report, std::vector<FrontendEvent>* events);
  TrackedFrame TakeNewestUnplaced();
  void LocalizeNextUnplaced();
  FinalPose LaterPose(const TrackedFrame& frame) const;
  void KeepUnplaced(WaitingFrame frame);
  void PlaceNeighbourAgain();
  void NextMapId();
  void Coast();
  void BeginTrial(const Keyframe& second);
  void AwaitTurn(std::vector<FrontendEvent>* events);
  const Placed& NewestPlaced() const { return coasting_ ? coasting_->placed : last_placed_; }
  uint32_t NewestIndex() const { return coasting_ ? coasting_->index : last_.index; }
  std::optional<Rigid3d> PoseOf(const Placed& placed) const;

  FrontendOptions options_;
  Camera camera_;
  Pyramid pyramid_;
  uint32_t session_;
  uint64_t seed_;
  bool localize_only_;
  bool catch_up_in_portions_;
  Replica map_;
  FrameRefiner refiner_;
  FinalPoses final_poses_;
  std::function<void()> pump_;
  OrbExtractor extractor_;
  OrbExtractor first_map_extractor_;  ///< more features while there is no map
  InitializerOptions initializer_options_;
  std::function<FirstMapSearch(FirstMapSearch)> run_search_;
  FirstMapSearch initializer_;
  PoseTracker tracker_;
  PoseTracker searcher_;  ///< for the frames that are refined: what they see is not news of the map
  Relocalizer relocalizer_;

  TrackingState state_ = TrackingState::kNotInitialized;
  MapId map_id_ = 1;
  TrackedFrame frame_;
  TrackedFrame last_;  ///< the frame tracked last
  Placed last_placed_;
  /// A pose after the frame tracked last that too few landmarks support to be told: it only leads the search
  /// in the frames that follow.
  struct Coasting {
    Placed placed;
    uint32_t index = 0;
  };
  std::optional<Coasting> coasting_;
  std::optional<Rigid3d> weak_pose_;  ///< of this frame: may be coasted with
  std::optional<Rigid3d> velocity_;   ///< T_cam_lastcam of the newest pose, coasted ones included
  int64_t last_tracked_ns_ = 0;
  int64_t trial_until_ns_ = 0;
  int frames_since_evidence_ = 0;
  bool relocalized_ = false;
  int64_t relocalized_ns_ = 0;
  bool withheld_ = false;

  KeyframeId initial_first_, initial_second_;
  KeyframeId last_keyframe_;
  int64_t last_keyframe_ns_ = 0;
  KeyframeId awaited_;
  std::deque<WaitingFrame> unplaced_;
  std::deque<WaitingFrame> not_placed_;  ///< of them, those that were looked at and not found
  bool grows_back_ = false;
  LaterNeighbours near_;             ///< of the unplaced frame that was looked at last
  std::deque<WaitingFrame> behind_;  ///< since the first map's second keyframe, not tracked yet
  double extract_ms_ = 0;
  FrontendCounters counters_;
};

}  // namespace dmslam
