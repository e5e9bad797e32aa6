#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dmslam/geometry/rigid3.h"

namespace dmslam {

/// How an estimate is laid onto the ground truth before errors are measured.
enum class Alignment {
  kNone,   // as it is
  kScale,  // only its scale
  kSe3,    // rotation and translation
  kSim3,   // rotation, translation and scale: what a monocular trajectory needs
};

/// "none", "scale", "se3", "sim3" and back; nothing for another word.
std::string_view AlignmentName(Alignment alignment);
std::optional<Alignment> ParseAlignment(std::string_view name);

/// Pairs of points, of which only what aligns them is kept: they come one by one, and may be any number.
class PointPairs {
 public:
  void Add(const Eigen::Vector3d& source, const Eigen::Vector3d& target);
  size_t count() const { return count_; }

  /// The transform `target_from_source` of the wanted kind that minimises the summed squared distance between
  /// each target and the image of its source (Umeyama, "Least-squares estimation of transformation parameters
  /// between two point patterns", PAMI 1991, Eq. 40-42). For kScale it is Umeyama's scale alone, as in `evo`.
  /// Nothing where the points do not determine it: fewer than three, all in one place, or (but for kNone) all
  /// on one line.
  std::optional<Sim3d> Align(Alignment alignment) const;

 private:
  size_t count_ = 0;
  Eigen::Vector3d source_mean_ = Eigen::Vector3d::Zero(), target_mean_ = Eigen::Vector3d::Zero();
  double source_squares_ = 0;                           ///< summed, about the mean
  Eigen::Matrix3d products_ = Eigen::Matrix3d::Zero();  ///< target times source, likewise
};

/// The same of pairs that are all there.
std::optional<Sim3d> AlignPoints(std::span<const Eigen::Vector3d> source,
                                 std::span<const Eigen::Vector3d> target, Alignment alignment);

}  // namespace dmslam
