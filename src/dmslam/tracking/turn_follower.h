#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "dmslam/features/matcher.h"
#include "dmslam/map/tracked_frame.h"
#include "dmslam/motion_segmentation/match.h"

namespace dmslam {

/// Which way a camera looks while its position is not known: the turn that brings an earlier picture over the
/// present one, where one turn does so for most of it. Pictures are compared over as long a time as they
/// overlap, and a camera that moves is told from one that turns by what is near and what is far. A camera
/// that moves along a wall, and a crowd that fills the picture and moves as one, cannot be told from a turn.
class TurnFollower {
 public:
  explicit TurnFollower(const Camera& camera) : camera_(camera) {}

  /// Turns are counted from this frame on.
  void Begin(const TrackedFrame& frame);
  /// The next frame. Where no turn explains it, or too little of the earlier picture is seen, turns are
  /// counted from it on.
  void Follow(const TrackedFrame& frame);

  /// Whether the camera has turned from the frame at begun_ns() to the newest, and not moved much.
  bool IsMeasured() const { return proven_; }
  int64_t begun_ns() const { return begun_ns_; }
  /// Takes directions in the camera at begun_ns() to those in the newest.
  Eigen::Quaterniond R_now_begun() const { return R_now_anchor_ * R_anchor_begun_; }

 private:
  Eigen::Quaterniond Predicted(int64_t stamp_ns) const;
  bool IsTurn(const std::vector<Match>& matches, const Eigen::Quaterniond& R_1_0) const;
  void MoveAnchor(const TrackedFrame& frame);

  Camera camera_;
  FeatureMatcher matcher_;
  std::shared_ptr<const FrameFeatures> anchor_;  ///< the earlier picture; null: none yet
  int64_t anchor_ns_ = 0, begun_ns_ = 0, newest_ns_ = 0;
  std::optional<size_t> first_matches_;  ///< of the anchor with the frame after it; none: none came yet
  Eigen::Quaterniond R_anchor_begun_ = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond R_now_anchor_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d rad_per_s_ = Eigen::Vector3d::Zero();
  bool proven_ = false;
};

}  // namespace dmslam
