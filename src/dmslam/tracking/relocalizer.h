#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "dmslam/map/replica.h"
#include "dmslam/map/tracked_frame.h"
#include "dmslam/place_recognition/landmark_matches.h"
#include "dmslam/place_recognition/map_places.h"
#include "dmslam/tracking/pose_search.h"

namespace dmslam {

/// Finds a lost camera in the replica of the map: keyframes that look alike, matches by words, pose by
/// RANSAC, guided search and refinement. Needs nothing but the replica, so it works when the loop closer is
/// down.
class Relocalizer {
 public:
  /// Where the camera was when it was last known: shortly after, it cannot be far away.
  struct LastKnown {
    Rigid3d T_cam_world;
    double elapsed_s = 0;  ///< since then
    double depth = 1;      ///< of the scene then [map units]
  };
  /// Whether a camera in a hand can have come to `T_cam_world`. Of what was long ago nothing follows.
  static bool CanReach(const LastKnown& last, const Rigid3d& T_cam_world);

  explicit Relocalizer(std::shared_ptr<const Vocabulary> vocabulary);

  /// Keeps the index in step with the replica: call after each applied delta.
  void Update(const Replica& map);
  void Clear();
  /// A first pose of `frame` in map `map_id` (none given: in any), with matches; none when no keyframe fits.
  /// Keyframes that look alike are tried first, then `last_seen` (may be invalid) and its neighbours, then
  /// all that these places show together. Where a place shows enough landmarks that are proven to be no
  /// person, only these say where the camera is; and where `last` says that it cannot be, so many of them
  /// must be found.
  bool Relocalize(const Map& map, std::optional<MapId> map_id, KeyframeId last_seen, uint64_t seed,
                  PoseSearch* search, TrackedFrame* frame,
                  const std::optional<LastKnown>& last = std::nullopt) const;

 private:
  std::vector<KeyframeId> Candidates(const Map& map, std::optional<MapId> map_id, KeyframeId last_seen,
                                     const BowImage& image) const;
  bool TryKeyframe(const Map& map, const Keyframe& keyframe, const BowImage& image, uint64_t seed,
                   TrackedFrame* frame) const;
  /// All that these places and their neighbours show, by descriptor alone.
  bool TryTogether(const Map& map, const std::vector<KeyframeId>& places, uint64_t seed,
                   TrackedFrame* frame) const;
  bool FindPose(const Map& map, const std::vector<LandmarkMatch>& matches, uint64_t seed,
                TrackedFrame* frame) const;
  static bool Refine(const Map& map, PoseSearch* search, TrackedFrame* frame);

  MapPlaces places_;
};

}  // namespace dmslam
