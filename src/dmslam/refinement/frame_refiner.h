#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "dmslam/features/types.h"
#include "dmslam/map/map.h"
#include "dmslam/map/proposals.h"
#include "dmslam/refinement/final_poses.h"
#include "dmslam/refinement/unplaced_frames.h"

namespace dmslam {

/// How many frames of a camera are remembered, so that their poses are improved at the end: two minutes at 30
/// Hz.
inline constexpr size_t kFramesRemembered = 3600;

struct FrameRefinerOptions {
  size_t max_frames = kFramesRemembered;  ///< the oldest is forgotten beyond
  /// The features of the oldest are forgotten beyond (38 bytes each): these frames are only optimised with
  /// the landmarks that they saw.
  size_t max_features = 3'000'000;
  /// The poses are smoothed afterwards. Then it is the wrong ones that count, more than those that few sights
  /// leave open: no pose rests on a single sight (MeasureCheckedPose()), and where a frame sees less of the
  /// map than the one before, it is looked for from that one's motion as well, as beside a wrong pose what is
  /// near is not found, and what is far agrees.
  bool for_smoothing = false;
};

/// What tracked frames saw, kept so that their poses can be found once more when the map has become better
/// and larger than it was at their time.
class FrameRefiner {
 public:
  /// Looks for more of the map from the frame's pose and with its landmarks; whether that went well.
  using Search = std::function<bool(TrackedFrame*)>;

  explicit FrameRefiner(const FrameRefinerOptions& options = {}) : options_(options) {}

  /// Keeps a tracked frame and the pose that was told of it.
  void Keep(const TrackedFrame& frame, const FramePose& pose);
  /// The same of a frame before all that are kept, as far as there is room for it.
  void KeepEarlier(const TrackedFrame& frame, const FramePose& pose);

  /// Gives back the frames that were tracked in map `map_id`, which was wrong, as far as their features are
  /// kept.
  std::vector<WaitingFrame> TakeFramesOf(MapId map_id);

  /// Takes the frames of map `map_id` (none given: of all) for RefineNext(); they are told once.
  void Begin(const Map& map, std::optional<MapId> map_id = std::nullopt);
  bool IsBusy() const { return !due_.empty(); }
  /// Looks for the oldest frames that are due, for as many at a time as there are searches: RefineNext() does
  /// less then, with the same result, and the map must not change until IsAhead() is false. A search finds
  /// the same whatever it was used for before.
  void LookAhead(const Map& map, std::span<const Search> searches);
  bool IsAhead() const { return !ahead_.empty(); }
  /// The pose of the oldest frame that is due, relative to its reference keyframe as that is now (state:
  /// localised later). Where its observations do not agree with the map any more, or put it where the
  /// keyframes before and after rule it out (AgreesWithKeyframesAside()) and it was not before: none, as it
  /// was told before; of a frame that was placed late, and never told, where it was, with nothing measured.
  std::optional<FinalPose> RefineNext(const Map& map, const Search& search);

 private:
  struct Kept {
    FramePose pose;
    std::vector<Sight> sights;
    FeatureSet features;  ///< empty: forgotten
  };
  /// A frame that was found in the map.
  struct Found {
    MapId map_id = 0;
    int64_t stamp_ns = 0;
    Rigid3d T_cam_world;
    size_t num_sights = 0;
  };
  /// A frame that was looked for from where it was told to be.
  struct Looked {
    std::vector<Sight> known;          ///< what it saw when it was tracked, and is in the map now
    std::optional<FinalPose> refined;  ///< none: it does not agree with the map
  };
  static Kept ToKept(const TrackedFrame& frame, const FramePose& pose);
  void Bound();
  void CountFeatures();
  std::optional<Looked> Look(const Map& map, const Kept& kept, const Search& search) const;
  static std::vector<Sight> SightsNow(const Map& map, MapId map_id, const Kept& kept);
  std::optional<FinalPose> Measured(const Map& map, const Kept& kept, const Rigid3d& told,
                                    const std::vector<Sight>& sights) const;
  static std::optional<std::vector<Sight>> SearchAgain(const Map& map, const Kept& kept, const Rigid3d& told,
                                                       const std::vector<Sight>& known, const Search& search);
  std::optional<Rigid3d> FromMotion(MapId map_id, int64_t stamp_ns) const;
  void LookFromMotion(const Map& map, MapId map_id, const Kept& kept, const std::vector<Sight>& known,
                      const Search& search, std::optional<FinalPose>* refined) const;

  FrameRefinerOptions options_;
  std::deque<Kept> frames_;
  std::deque<Kept> due_;
  std::deque<std::optional<Looked>> ahead_;  ///< of the first that are due; none: their keyframe is gone
  std::optional<Found> before_, last_;       ///< the last but one, and the last
  size_t num_features_ = 0;                  ///< of all frames kept
  size_t num_without_features_ = 0;          ///< oldest frames whose features are forgotten
};

}  // namespace dmslam
