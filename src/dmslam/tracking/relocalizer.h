#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "dmslam/map/replica.h"
#include "dmslam/map/tracked_frame.h"
#include "dmslam/place_recognition/landmark_matches.h"
#include "dmslam/place_recognition/map_places.h"
#include "dmslam/tracking/pose_search.h"
#include "dmslam/tracking/unmapped_points.h"

namespace dmslam {

/// Finds a lost camera in the replica of the map: keyframes that look alike, matches by words, pose by
/// RANSAC, guided search and refinement. Needs nothing but the replica, so it works when the loop closer is
/// down.
class Relocalizer {
 public:
  explicit Relocalizer(std::shared_ptr<const Vocabulary> vocabulary);

  /// Keeps the index in step with the replica: call after each applied delta.
  void Update(const Replica& map);
  void Clear();
  /// The camera is looked for in all maps.
  struct Request {
    std::optional<KeyframeId> last_seen{};  ///< none: not known
    /// Asked of a frame with its pose and what it sees there; empty: all are.
    std::function<bool(const TrackedFrame&, const TrackingReport&)> credible{};
    uint64_t seed = 0;
    bool by_unmapped = false;  ///< places are also recognised by what is no landmark
  };
  /// A pose of `frame` with its matches; none when no keyframe fits. Keyframes that look alike are tried
  /// first, then the one seen last and its neighbours, then all that these places show together, then, if it
  /// is asked for, one place with what it shows that is no landmark: the places take turns from frame to
  /// frame. Where a place shows enough landmarks that are proven to be no person, only these say where the
  /// camera is.
  bool Relocalize(const Map& map, const Request& request, PoseSearch* search, TrackedFrame* frame);

 private:
  std::vector<KeyframeId> Candidates(const Map& map, const Keyframe* last, const BowImage& image) const;
  bool TryKeyframe(const Map& map, const Keyframe& keyframe, const BowImage& image, uint64_t seed,
                   TrackedFrame* frame) const;
  /// All that these places and their neighbours show, by descriptor alone.
  bool TryTogether(const Map& map, const std::vector<KeyframeId>& places, uint64_t seed,
                   TrackedFrame* frame) const;
  /// What this place shows, landmarks or not, by descriptor alone.
  bool TryUnmapped(const Map& map, const Keyframe& keyframe, uint64_t seed, TrackedFrame* frame);
  struct Vote {
    int min_inliers = 0;
    uint64_t seed = 0;
  };
  bool FindPose(const Map& map, const std::vector<LandmarkMatch>& matches, const Vote& vote,
                TrackedFrame* frame) const;
  static std::optional<TrackingReport> Refine(const Map& map, PoseSearch* search, TrackedFrame* frame);

  MapPlaces places_;
  UnmappedPoints unmapped_;
};

}  // namespace dmslam
