#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "dmslam/camera/image_scale.h"
#include "dmslam/dynamics/frame_expectation.h"
#include "dmslam/map/map.h"

namespace dmslam {

/// What a frame knows of a place in the image: what it sees there, how far away, and whether that moves.
struct Witness {
  Eigen::Vector2d uv_px;
  double depth = 0;
  bool moves = false;
};

/// Witnesses by image cell.
class WitnessGrid {
 public:
  explicit WitnessGrid(const Camera& camera);
  void Clear();
  void Add(const Witness& witness);
  template <typename Visit>
  void ForEachNear(const Eigen::Vector2d& uv_px, double reach_px, const Visit& visit) const {
    const int top = Row(uv_px.y() - reach_px), bottom = Row(uv_px.y() + reach_px);
    const int left = Column(uv_px.x() - reach_px), right = Column(uv_px.x() + reach_px);
    const double reach_squared = reach_px * reach_px;
    for (int row = top; row <= bottom; ++row) {
      for (int column = left; column <= right; ++column) {
        for (const Witness& witness : cells_[Index(column, row)]) {
          if ((witness.uv_px - uv_px).squaredNorm() <= reach_squared) visit(witness);
        }
      }
    }
  }

 private:
  // An index alone: with any other number of cells the same witnesses are visited (FoundShare's cells, of
  // which there are as many, are what it measures by).
  static constexpr int kColumns = 20, kRows = 15;

  int Column(double x) const;
  int Row(double y) const;
  static size_t Index(int column, int row) {
    return static_cast<size_t>(row) * kColumns + static_cast<size_t>(column);
  }

  double cell_width_px_, cell_height_px_;
  std::array<std::vector<Witness>, kColumns * kRows> cells_;
};

/// Judges the landmarks that a frame should see and does not, by what it sees around them. What lies behind
/// is seen: nothing hides them, they have gone. Their neighbours move: they go together. Something nearer is
/// seen: they are hidden, and nothing is said.
class MissingLandmarks {
 public:
  /// What is seen this near to a missing landmark tells of it.
  static constexpr double kReachRad = 0.076;

  explicit MissingLandmarks(const Camera& camera)
      : reach_px_(SearchRadiusPx(camera, kReachRad)), witnesses_(camera) {}

  /// `moved`: seen elsewhere by the frame, and so not missing.
  void Judge(const Map& map, const TrackedFrame& frame, std::span<const ExpectedLandmark> expected,
             std::span<const LandmarkId> moved);

  /// Missing: what lies behind them is seen, or their neighbours move.
  const std::vector<LandmarkId>& gone() const { return gone_; }
  /// Missing, with something nearer seen in their place; sorted.
  const std::vector<LandmarkId>& hidden() const { return hidden_; }

 private:
  /// What is this much farther away says that it has gone...
  static constexpr double kSeenThroughDepth = 1.2;
  /// ...where at least so many say it, and nothing of its own depth denies it.
  static constexpr int kSeenThroughMin = 2;
  /// It goes with so many of its depth around it that move.
  static constexpr int kMovingTogetherMin = 3;

  enum class Verdict { kNone, kGone, kHidden };

  void CallWitnesses(const Map& map, const TrackedFrame& frame, std::span<const LandmarkId> moved);
  Verdict AskAround(const LandmarkView& view) const;

  double reach_px_;
  WitnessGrid witnesses_;
  std::vector<LandmarkId> gone_, hidden_;
  LandmarkSet known_;  ///< workspace: those that the frame sees, in their place or elsewhere
};

}  // namespace dmslam
