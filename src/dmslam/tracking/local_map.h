#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "dmslam/map/map.h"
#include "dmslam/map/tracked_frame.h"

namespace dmslam {

/// The part of the map around a frame: the keyframes that see its landmarks, one neighbour of each, and all
/// that these see. Kept from frame to frame without asking the heap for memory.
class LocalMap {
 public:
  explicit LocalMap(int max_keyframes) : max_keyframes_(static_cast<size_t>(max_keyframes)) {}

  /// Around what the frame is matched with. Where that is nothing the reference stays.
  void Collect(const Map& map, const TrackedFrame& frame);
  /// Takes out what has left the map since it was collected.
  void DropGone(const Map& map);
  void Reset();

  /// The keyframe that shares most landmarks with the frame; none before the first.
  std::optional<KeyframeId> reference() const { return reference_; }
  /// Sorted.
  const std::vector<LandmarkId>& landmarks() const { return landmarks_; }

 private:
  void RankByVotes(const Map& map, const TrackedFrame& frame);
  std::optional<KeyframeId> NewNeighbour(const Map& map, KeyframeId of);
  void AddNeighbours(const Map& map);
  void ListLandmarks(const Map& map);

  size_t max_keyframes_;
  std::optional<KeyframeId> reference_;
  std::vector<KeyframeId> keyframes_;
  std::vector<LandmarkId> landmarks_;
  // Workspace:
  std::vector<KeyframeId> votes_;  ///< one for each observation of the frame's landmarks
  std::vector<std::pair<int, KeyframeId>> ranked_;
  std::vector<KeyframeId> listed_;                 ///< keyframes_, sorted
  std::vector<int> counts_;                        ///< of the votes, by keyframe
  std::vector<uint64_t> marks_;                    ///< one bit for each landmark id
  std::vector<std::span<const LandmarkId>> seen_;  ///< by each local keyframe
};

}  // namespace dmslam
