#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/features/types.h"
#include "dmslam/motion_segmentation/match.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {

/// Which two-view model explains the static world.
enum class ModelKind : uint8_t {
  kFundamental,  ///< eight points, no knowledge of the camera (the paper)
  kEssential,    ///< five points, needs K
};

/// Why a selector gives no answer.
enum class Refusal : uint8_t {
  kNone = 0,
  kTooFewMatches,         ///< fewer than the solver or the options ask for
  kBadInput,              ///< a coordinate is not finite or lies outside the image
  kNoMotion,              ///< the two frames are the same picture
  kTooFewCells,           ///< matches lie in too few cells, or too few cells have a model
  kNoModel,               ///< no sample gave a model
  kTooFewStatic,          ///< too few matches fit the model chosen
  kDistributionTooSmall,  ///< the static set is too compact: the motion is too complex (paper 2.3.1)
  kAmbiguous,             ///< another motion is nearly as wide and as numerous as the one chosen
};
std::string_view ToString(Refusal refusal);

/// What a cell's matches look like. What does not determine a motion does not vote for one (DlrsacOptions),
/// but can be voted for.
enum class CellState : uint8_t {
  kTooFew = 0,    ///< fewer matches than a model needs
  kNoModel,       ///< RANSAC found nothing that enough matches agree with
  kCollinear,     ///< all on a line
  kPlane,         ///< a homography explains them all: the epipolar geometry is not determined
  kPureRotation,  ///< a rotation alone explains them all: no translation is visible
  kGeneral,       ///< has a model of its own
};
std::string_view ToString(CellState state);

/// One image cell, row-major over the image of frame 0.
struct CellReport {
  int column = 0;
  int row = 0;
  CellState state = CellState::kTooFew;
  int num_matches = 0;
  int num_inliers = 0;  ///< of the cell's own model; those of the couple degree's denominator
  int num_static = 0;   ///< of the final answer
  bool chosen = false;  ///< belongs to the coupled set that was chosen
  Eigen::Vector2d centroid_px = Eigen::Vector2d::Zero();  ///< mean of its matches' uv0
};

/// What a selector found. `refusal` other than kNone: no model, nothing is static.
struct StaticSelection {
  Refusal refusal = Refusal::kNone;
  std::string explanation;  ///< one sentence with the numbers, when refused

  ModelKind kind = ModelKind::kFundamental;
  /// Fundamental matrix between ideal pixels: uv1^T F uv0 = 0, Frobenius norm 1.
  Eigen::Matrix3d F = Eigen::Matrix3d::Zero();
  /// Essential matrix between rays, when kind is kEssential: ray1^T E ray0 = 0, Frobenius norm 1.
  Eigen::Matrix3d E = Eigen::Matrix3d::Zero();
  /// One per match, 1 = static.
  std::vector<uint8_t> is_static;
  int num_static = 0;
  double distribution_px = 0;  ///< square root of D (paper Eq. 3) over the static matches' uv0

  int columns = 0, rows = 0;
  std::vector<CellReport> cells;
  /// C(i, j): share of cell j's own inliers that cell i's model explains (paper 2.1). Empty for RANSAC and
  /// ARSAC.
  Eigen::MatrixXd couple;
  std::optional<int> leading_cell;  ///< whose coupled set was chosen; none for RANSAC and ARSAC
  int iterations = 0;               ///< samples drawn in all

  bool IsUsable() const { return refusal == Refusal::kNone; }
};

/// Limits that every selector checks before it works.
struct InputOptions {
  int min_matches = 16;               ///< fewer is refused; never below 8
  double min_displacement_px = 0.35;  ///< median displacement below this: the same picture twice
  /// Matches that span less than this share of the image's diagonal, across and down, fill no more than a
  /// cell of the usual size (DlrsacOptions::cell_share): they do not determine a motion of the camera.
  double min_extent_share = 0.2;
  /// How far outside the image an ideal pixel may lie, as a share of the image's width. Only used for cameras
  /// with distortion, where ideal pixels leave the image; 0 is used for others.
  double outside_share = 0.5;
};

/// Whether an ideal pixel is finite and lies no farther outside the image than the options allow.
bool LiesWithinReach(const Eigen::Vector2d& uv_px, const Camera& camera, const InputOptions& options);

/// When a matched pair of points agrees with a model.
struct InlierOptions {
  double chi2 = kRoundedChiSquared1Dof;  ///< bound on the squared Sampson distance in units of its variance
  double sigma_px = 1.0;                 ///< standard deviation of a keypoint [pixels of its level]
  /// Standard deviation grows with the octave's scale (Pyramid). Off: every keypoint counts as octave 0 (the
  /// paper).
  bool scale_by_octave = true;
  Pyramid pyramid;
};

/// Finds which matches belong to the static world. Implementations keep no state between calls and never
/// throw for what is in the matches: they refuse. The same (matches, seed) gives the same answer.
class StaticSelector {
 public:
  virtual ~StaticSelector() = default;
  virtual std::string_view name() const = 0;
  virtual StaticSelection Select(std::span<const Match> matches, const Camera& camera,
                                 uint64_t seed) const = 0;
};

/// Refusals that need no model: too few, not finite, outside, identical frames, all in one place. None: go
/// on.
struct InputProblem {
  Refusal refusal = Refusal::kNone;
  std::string explanation;
};
std::optional<InputProblem> CheckMatches(std::span<const Match> matches, const Camera& camera,
                                         const InputOptions& options);

/// "dlrsac", "dlrsac-paper", "arsac" or "ransac" with default options and the given kind of model; throws
/// InputError for another name.
std::unique_ptr<StaticSelector> MakeSelector(const std::string& name, ModelKind kind);

}  // namespace dmslam
