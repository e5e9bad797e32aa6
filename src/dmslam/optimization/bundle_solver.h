#pragma once

#include <functional>
#include <string>
#include <vector>

#include "dmslam/optimization/bundle_adjustment.h"

namespace dmslam {

/// Observations nearer to the camera's plane than this, or behind it, have a constant error instead.
inline constexpr double kMinBundleDepth = 1e-6;
inline constexpr double kErrorBehind = 100.0;  ///< [sigma]

/// Damping of the first step is the inverse of this, times the diagonal of the normal equations. Whether a
/// camera turned or moved aside before a wall is determined a hundred thousand times worse than the diagonal
/// says. Much more, and a young map bends for what is left of people.
inline constexpr double kBundleTrustRegion = 1e7;

inline size_t At(int index) { return static_cast<size_t>(index); }

/// Steps with one loss.
struct BundleStage {
  bool cauchy = false;  ///< Else Huber's loss.
  int iterations = 0;
  double relative_tolerance = 0.0;
};

struct BundleStageResult {
  bool sound = false;  ///< The state is no worse than before.
  bool interrupted = false;
  int iterations = 0;
  std::string message;  ///< Why it is not sound.
};

/// What an adjustment is about, and where it stands: `poses` and `problem.points` change with every stage.
struct BundleState {
  BundleProblem& problem;
  std::vector<Rigid3d> poses;
  std::vector<char> pose_held;  ///< One flag per pose.
  std::vector<char> active;     ///< One flag per observation: those that count.

  bool PoseHeld(int pose) const { return pose_held[static_cast<size_t>(pose)] != 0; }
  bool PointHeld(int point) const {
    return !problem.point_fixed.empty() && problem.point_fixed[static_cast<size_t>(point)] != 0;
  }
};

/// Makes the steps of an adjustment.
class BundleSolver {
 public:
  virtual ~BundleSolver() = default;
  /// Of the active observations, those that anything can be adjusted for.
  virtual int NumTerms() const = 0;
  virtual BundleStageResult Solve(const BundleStage& stage) = 0;
  /// The observation counts no longer.
  virtual void Disable(size_t observation) = 0;
};

}  // namespace dmslam
