#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "dmslam/map/remembered_frame.h"
#include "dmslam/map/replica.h"
#include "dmslam/refinement/last_poses.h"
#include "dmslam/refinement/late_placement.h"
#include "dmslam/refinement/unplaced_frames.h"
#include "dmslam/slam/evidence_schedule.h"
#include "dmslam/slam/feature_stage.h"
#include "dmslam/slam/first_map_phase.h"
#include "dmslam/slam/frontend_options.h"
#include "dmslam/slam/frontend_output.h"
#include "dmslam/slam/keyframe_gate.h"
#include "dmslam/slam/own_maps.h"
#include "dmslam/slam/tracking_phase.h"
#include "dmslam/tracking/odometry.h"
#include "dmslam/tracking/tracker.h"
#include "dmslam/tracking/turn_follower.h"

namespace dmslam {

/// Tracks the camera in a replica of the map and proposes keyframes: images and map records in, records out.
/// The same inputs give the same outputs. Knows no bus, and no clock decides anything (one measures how long
/// extraction took); where work is shared among threads, their number changes no output.
class FrontendCore {
 public:
  struct Setup {
    FrontendOptions options;
    OrbExtractorOptions extractor;
    InitializerOptions initializer;
    Camera camera;
    Pyramid pyramid;
    uint32_t session = 1;
    CameraId camera_id = 0;  ///< of several that work on one map
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
    std::shared_ptr<FeatureStore> feature_store;  ///< of the map; null: all of it stays in memory
    /// Hears of each frame whose last pose is still to be found, and again when more is known of it; may be
    /// empty.
    std::function<void(const RememberedFrame&)> remember;
  };
  explicit FrontendCore(const Setup& setup);

  // ---- While the sequence goes on ----

  /// Tracks one frame.
  FrontendOutput ProcessImage(uint32_t frame_index, int64_t stamp_ns, const GrayView& image);
  FrontendOutput ProcessFeatures(uint32_t frame_index, int64_t stamp_ns, FeatureSet features);
  /// Whether frames wait to be tracked, and tracks the oldest of them (there must be one).
  bool IsBehind() const { return !behind_.empty(); }
  /// Whether the oldest of them may be tracked now. Frames that are late anyway are tracked as in lock-step,
  /// each in the map that the keyframes before it made: a young map that does not grow with them is soon lost
  /// sight of.
  bool MayCatchUp() const { return IsBehind() && (!awaited() || map_.keyframes().empty()); }
  /// From the oldest frame that waits to the newest.
  double seconds_behind() const;
  FrontendOutput CatchUp();
  /// A record of the map stream; call between frames.
  void ApplyMapDelta(const MapDelta& delta);
  /// The replica is void: a fresh map stream, or a snapshot, begins.
  void ForgetMap();
  /// Joins a system that has been running: it is lost in the newest map that it was given.
  void Resume();
  /// Whether a keyframe was proposed whose settled record has not come: lock-step waits for it.
  std::optional<KeyframeId> awaited() const { return gate_.awaited(); }
  /// Told by the node: no more keyframes now (too many are not acknowledged).
  void SetWithheld(bool withheld) { gate_.SetWithheld(withheld); }

  // ---- When it has ended, step by step ----

  /// 0. A frame that a frontend before this one has left: its last pose is found as if it were an own one.
  /// The newest of them first.
  void TakeOver(RememberedFrame frame);
  /// 1. Before the mapper adjusts its maps: places one of the frames that had no pose when they came, the
  /// newest first, and proposes it as a keyframe where it shows more of the scene than the map has. So the
  /// map grows back to before its first keyframe. Not while a keyframe is awaited. None: nothing is left.
  std::optional<FrontendOutput> GrowBack();
  /// 2. After the record that tells of maps adjusted at the end, and before the next one: whether frames wait
  /// for their last poses, and finds that of one (applying a record or finishing does it for all that are
  /// left).
  bool IsRefining() const { return last_poses_.IsRefining(); }
  void RefineNext() { last_poses_.RefineNext(map_); }
  /// Makes those wait too that no record told of: their maps were not adjusted.
  void RefineRest() { last_poses_.Begin(map_); }
  /// 3. When none waits: a portion of what is left to do, which is to place frames that had no pose when they
  /// came and to join the poses with the camera's motion. False: all is done.
  bool WorkAtEnd();
  /// Whether that must not be interrupted by map records.
  bool NeedsMapUnchanged() const { return last_poses_.NeedsMapUnchanged(); }
  /// 4. Does all that is left and tells the last poses.
  FrontendOutput Finish();

  /// Of the newest frame. While a first map is looked for and there are others, the camera is lost in those.
  TrackingState state() const;
  /// Whether the next frame is one that a first map is looked for in, with more features than others.
  bool IsSearching() const { return phase_.IsSearching(); }
  /// The newest, with what it sees of the map.
  const TrackedFrame& frame() const { return frame_; }
  /// As of the newest frame.
  const OdometryState& odometry() const { return odometry_.state(); }
  CameraId camera_id() const { return camera_id_; }
  const Map& map() const { return map_; }
  const FrontendCounters& counters() const { return counters_; }
  double extract_ms() const { return features_.last_ms(); }

 private:
  FrontendOutput ProcessFrame();
  std::optional<FrontendOutput> FindAgain();
  FrontendOutput Initialize();
  FrontendOutput AwaitMap();
  FrontendOutput GiveUpRefusedMap();
  void BeginTrial(const Keyframe& second);
  FrontendOutput AwaitTurn();
  // `frame`: the one that is worked on, the newest or one that waited.
  FrontendOutput Track(TrackedFrame* frame);
  FrontendOutput OnTracked(const TrackedFrame& frame, const TrackingResult& result);
  FrontendOutput OnNotTracked(const TrackedFrame& frame, const TrackingReport& report);
  void FollowTurn(const TrackedFrame& frame);
  bool IsLostInTheLight(const TrackedFrame& frame, int64_t missing_ns);
  FrontendOutput GiveUpMap(int64_t stamp_ns, MapReset::Fate wanted, const std::string& reason);
  MapReset LeaveMap(MapId left, int64_t stamp_ns, MapReset::Fate wanted, const std::string& reason);
  void FollowJoinedMap();
  bool WantsKeyframe(const TrackedFrame& frame, const TrackingReport& report, KeyframeId reference);
  void ReportLandmarks(const TrackedFrame& frame, const PlacedPose& pose, bool keyframe,
                       EvidenceSchedule::Way way, FrontendOutput* output);
  KeyframeId KeyframeIdOf(const TrackedFrame& frame) const {
    return KeyframeId::Make(session_, frame.index, camera_id_);
  }
  KeyframeProposal ProposeKeyframe(const TrackedFrame& frame, const PlacedPose& pose);
  KeyframeProposal SeenBy(const TrackedFrame& frame) const;
  void KeepUnplaced(const TrackedFrame& frame);
  FramePose NoPose(const TrackedFrame& frame, TrackingState state, std::string reason) const;
  FramePose MakePose(const TrackedFrame& frame, TrackingState state, const TrackingReport& report,
                     const std::optional<PlacedPose>& pose) const;
  TrackedFrame TakeNewestUnplaced() { return unplaced_.TakeNewest().ToTracked(camera_, pyramid_); }
  std::optional<LatePlacement::Placed> PlaceLate(LateMap late_map, TrackedFrame* frame);
  bool KeepBelieved(LateMap late_map, LatePlacement::Placed placed);

  // What is given
  FrontendOptions options_;
  Camera camera_;
  Pyramid pyramid_;
  uint32_t session_;
  CameraId camera_id_;
  bool localize_only_;
  bool catch_up_in_portions_;
  std::function<void(const RememberedFrame&)> remember_;

  // The map and where tracking stands
  Replica map_;
  std::optional<MapId> map_id_;  ///< of the map tracked in or looked for; none: whichever it finds itself in
  OwnMaps own_maps_;
  TrackingPhase phase_;

  // What does the work
  FeatureStage features_;
  FirstMapPhase first_map_;
  Tracker tracker_;
  Odometer odometry_;
  TurnFollower turns_;  ///< of a camera that is not tracked
  KeyframeGate gate_;
  LatePlacement late_;
  LastPoses last_poses_;

  // Frames
  TrackedFrame frame_;  ///< the newest
  UnplacedFrames unplaced_;
  std::deque<WaitingFrame> behind_;  ///< since the first map's second keyframe, not tracked yet
  EvidenceSchedule evidence_;
  std::optional<int64_t> lit_since_ns_;  ///< since when the frames of a lost camera show anything
  FrontendCounters counters_;
};

}  // namespace dmslam
