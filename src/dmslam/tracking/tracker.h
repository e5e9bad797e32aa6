#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <variant>

#include "dmslam/map/replica.h"
#include "dmslam/tracking/motion_follower.h"
#include "dmslam/tracking/pose_certainty.h"
#include "dmslam/tracking/relocalizer.h"
#include "dmslam/tracking/usual_speed.h"

namespace dmslam {

/// What tracking a frame came to.
struct TrackingResult {
  TrackedFrame frame{};                                   ///< with its matches and classes
  TrackingReport report{};                                ///< what it sees of the map
  std::optional<PlacedPose> pose = std::nullopt;          ///< of the frame; none: the report says why
  std::optional<PoseCertainty> certainty = std::nullopt;  ///< of the pose
  bool relocalized = false;                               ///< found without the motion model
};

/// Follows the camera through the frames of a stream, in a map that is given with each and only read.
class Tracker {
 public:
  struct Setup {
    TrackingOptions options;
    Camera camera;
    std::shared_ptr<const Vocabulary> vocabulary;  ///< to find a lost camera; none: only near where it was
    uint64_t seed = 0;
  };
  explicit Tracker(const Setup& setup);

  /// Begins at a keyframe; nothing is known of the motion.
  void BeginAt(const Keyframe& keyframe);
  /// Begins lost.
  void BeginLost() { follower_.BeginLost(); }

  /// The camera was tracked in this map: lost, it is looked for in all maps, and in this one it must be
  /// within reach.
  struct InMap {
    MapId map_id = 0;
  };
  /// The camera is in one of the maps, and was in none of them yet: it may be anywhere.
  struct InAnyMap {};
  /// The camera may be in none of the maps: in each of them a place must show what it must in another map.
  struct PerhapsInNone {};
  using Whereabouts = std::variant<InAnyMap, InMap, PerhapsInNone>;
  struct Request {
    Whereabouts whereabouts;
    bool may_relocalize = true;  ///< a lost camera is looked for in the maps
  };
  /// The next frame of the stream. The map may have changed since the last one.
  TrackingResult Track(const Map& map, const Request& request, TrackedFrame frame);

  /// After each change of the map, and when it is void.
  void OnMapChanged(const Replica& map) { relocalizer_.Update(map); }
  void OnMapForgotten();
  /// The map that was tracked in is given up.
  void OnMapGivenUp();

  /// The keyframe that the frame tracked last was placed by; none: no frame was tracked yet.
  std::optional<KeyframeId> last_reference() const {
    const std::optional<PlacedPose> last = follower_.motion().last();
    return last ? std::optional(last->reference) : std::nullopt;
  }
  /// Whether the camera is followed and not believed: that will show.
  bool IsUndecided() const { return unbelieved_.has_value(); }
  /// Stamp of the frame tracked last; none: no frame was tracked yet.
  std::optional<int64_t> last_tracked_ns() const { return follower_.motion().last_stamp_ns(); }
  /// What frames said of landmarks since the last call.
  FrameEvidence TakeEvidence(int64_t stamp_ns, std::optional<MapId> map_id) {
    return search_.judge().TakeEvidence(stamp_ns, map_id);
  }
  /// By the poses that were believed so far; not kept up where options.usual_speed is off.
  const UsualSpeed& usual_speed() const { return usual_speed_; }
  /// For frames beside the stream, when it has ended.
  PoseSearch& search() { return search_; }
  Relocalizer& relocalizer() { return relocalizer_; }

 private:
  struct Attempt : MotionFollower::Attempt {
    bool relocalized = false;
    bool in_another_map = false;  ///< than it was lost in
  };

  Attempt FindPose(const Map& map, const Request& request, TrackedFrame* frame);
  void Withhold(TrackingResult* result);
  Attempt FollowMotion(const Map& map, TrackedFrame* frame);
  void FindBetterPlace(const Map& map, TrackedFrame* frame, Attempt* attempt);
  void FindTurned(const Map& map, TrackedFrame* frame, Attempt* attempt);
  bool MayRelocalize(const Attempt& attempt, int64_t stamp_ns) const;
  void Relocalize(const Map& map, const Request& request, TrackedFrame* frame, Attempt* attempt);
  bool IsCareful(int64_t stamp_ns) const;
  void Follow(const Map& map, const PlacedPose& pose, const TrackedFrame& frame, const Attempt& attempt);
  bool IsBelieved(const Map& map, const TrackingReport& report, int proven, int64_t stamp_ns) const;
  bool IsMoreThanSomebody(const TrackingReport& report) const;
  bool IsOldEnoughToProve(const Map& map) const;
  bool IsDoubtfulForLong(const TrackingReport& report, int64_t stamp_ns) const;
  bool IsCarriedAway(const Map& map, const TrackingReport& report, const TrackedFrame& frame) const;
  void GoBack();
  void Refuse(Attempt* attempt);

  TrackingOptions options_;
  uint64_t seed_;
  PoseSearch search_;
  PoseSearch second_search_;  ///< for a pose beside that which the motion leads to
  Relocalizer relocalizer_;
  MotionFollower follower_;
  PoseCertaintyEstimator certainty_;
  UsualSpeed usual_speed_;
  std::optional<int64_t> relocalized_ns_;  ///< when the camera was found last
  /// A camera that is followed and not believed.
  struct Unbelieved {
    enum class Why : uint8_t {
      kFoundAnew,  ///< it was lost, and waits to be confirmed where it was found
      kDoubtful,   ///< what it sees may be no part of the room
    };
    Why why = Why::kFoundAnew;
    bool in_another_map = false;  ///< than it was lost in
    int64_t since_ns = 0;
    MotionFollower follower;                 ///< as it was when the camera was believed last
    int frames = 0, frames_with_proven = 0;  ///< since then: all, and those that show a proven landmark
    void CountFrame(int proven) {
      ++frames;
      if (proven > 0) ++frames_with_proven;
    }
  };
  std::optional<Unbelieved> unbelieved_;
};

}  // namespace dmslam
