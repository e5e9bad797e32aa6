#pragma once

#include <Eigen/Core>
#include <bitset>
#include <cstddef>

#include "dmslam/camera/image_cells.h"

namespace dmslam {

/// Number times D (paper Eq. 3) of points in the image, added one by one: how much of the image they hold.
class SupportWidth {
 public:
  /// A point in that cell of the image (`CellOf`).
  void Add(const Eigen::Vector2d& uv_px, size_t cell);
  int count() const { return count_; }
  /// Sum of the squared distances from the points' mean [px^2]: their number times D.
  double Score() const;
  /// Number of cells that hold any, times D [px^2]: a fine texture counts no more than a coarse one.
  double CellScore() const;

 private:
  std::bitset<kNumCells> cells_;
  int count_ = 0;
  Eigen::Vector2d sum_ = Eigen::Vector2d::Zero();
  double squared_sum_ = 0;
};

/// Two motions explain what a frame sees, each something that the other does not. People stand close together
/// in the image and the room is all around them, so the wider one is the camera's. The rival is wider where
/// its number times D is three times that of the first; or where its cells times D are, and its number times
/// D is more: somebody whose clothes have a fine texture has more points than the room, but does not fill
/// more cells. For maps that are too young for age to tell the two apart (elders.h).
class RivalMotions {
 public:
  /// Whether `contradicting` matches are enough to look for a motion of their own.
  bool IsWorthALook(int contradicting) const { return contradicting >= kMinSupport; }
  /// Whether what only the rival explains outweighs what only the first motion explains; `contradicting` the
  /// first one were so many.
  bool RivalWins(const SupportWidth& first, const SupportWidth& rival, int contradicting) const;

 private:
  /// Matches that one motion explains and the other does not, to count as a motion.
  static constexpr int kMinSupport = 20;
  /// Of the matches that contradict the first motion, those that the rival explains.
  static constexpr double kMinShare = 0.5;
  /// The rival's score by the other's, from which it is believed.
  static constexpr double kMinAdvantage = 3.0;
};

}  // namespace dmslam
