#pragma once

#include "dmslam/motion_segmentation/depth_layers.h"
#include "dmslam/motion_segmentation/ransac.h"
#include "dmslam/motion_segmentation/static_selector.h"
#include "dmslam/motion_segmentation/two_view_model.h"

namespace dmslam {

/// How D over a coupled set is taken.
enum class DistributionWeight : uint8_t {
  kCells,    ///< mean over the member cells' centroids (the paper)
  kMatches,  ///< each centroid weighs as much as its cell has matches
};

/// Which matches may be called static once the motion is chosen.
enum class StaticScope : uint8_t {
  kCoupledCells,    ///< all features in the cells of the chosen set (the paper)
  kCoupledInliers,  ///< those of them that agree with the model
  kImage,           ///< every match of the image that agrees with the model
};

/// DLRSAC (Lu et al., Appl. Sci. 2020, 10(12), 4252, Sec. 2.1): the static world is the motion whose support
/// is spread widest over the image. What the paper leaves open is a field here; `Paper()` is the paper as
/// written, the defaults are what selects better (docs/dlrsac.md has the numbers).
struct DlrsacOptions {
  DlrsacOptions() { sampling.stop_confidence = 0.999; }

  /// max_iterations is shared by the cells kept; stop_confidence works per cell and is 0.999 unless set
  /// otherwise.
  SamplingOptions sampling;
  InputOptions input;
  InlierOptions inlier;

  /// Side of a cell, as a share of the side of a square that has the image's area: 160 px of 640x480. The
  /// paper shows 180 and 240 px.
  double cell_share = 0.289;
  int min_cell_matches = 15;  ///< a cell with fewer is dropped; never below the solver's sample
  int min_cells = 3;          ///< fewer cells with a model: refused
  /// Cell i couples with cell j when at least this share of j's own inliers satisfies i's model.
  double couple_threshold = 0.7;
  /// The tested share is of the cell's own inliers (the paper); off: of all its matches.
  bool couple_over_own_inliers = true;
  DistributionWeight distribution_weight = DistributionWeight::kCells;
  /// Each coupled set's model is refitted to the set's matches that it explains, and its row of C taken anew,
  /// so often.
  int set_refit_rounds = 2;
  StaticScope scope = StaticScope::kImage;

  /// Cells that do not determine the motion do not vote for one: collinear ones never lead a set; planes lead
  /// only with essential matrices, which five points of a plane determine; cells without visible parallax
  /// vote for their rotation, which they do determine, and the motion is searched in the whole set that
  /// shares it. Off: told apart nowhere (the paper).
  bool tell_degenerate = true;
  double degenerate_share = 0.95;  ///< share of a cell's inliers that a plane or a rotation must explain
  double collinear_share = 0.025;  ///< spread across the main direction below this share of a cell: collinear

  /// Keeps the widest layer of disparities only (essential matrices); off: all that agree with the model (the
  /// paper).
  LayerOptions layers;

  /// After the choice the motion is searched again among all minima of the epipolar cost of what nearly
  /// agrees with it (essential matrices): a model from one cell's sample is often a wrong local one. That
  /// with the largest D times number of static matches is taken.
  bool search_minima = true;
  MinimaOptions minima;
  double loose_bound = 9.0;   ///< nearly agrees: squared Sampson distance up to so many times its bound
  double minima_slack = 3.0;  ///< minima with up to so many times the lowest cost are tried

  /// Root of D of the chosen set below this share of the image's diagonal: refused, the motion is too complex
  /// (paper 2.3.1). Two neighbouring cells stay below it.
  double min_distribution_share = 0.12;
  int min_static = 12;  ///< fewer static matches: refused

  /// What is not static is searched for a motion of its own (essential matrices with StaticScope::kImage
  /// only). Where the D times number of that rival's matches exceeds this share of the static ones':
  /// refused, two views cannot tell which of the two motions is the camera's. A layer of disparity that was
  /// left out may be the rival, though it agrees with the chosen motion: it may be somebody who goes along
  /// his epipolar lines. So a static scene in two layers of equal strength (a desk close before a far wall)
  /// is refused, too. 0: not asked (the paper).
  double max_rival_share = 0.5;

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("initializer.cell_share", cell_share, 0.02, 4, "",
             "side of DLRSAC's cells, as a share of the side of a square of the image's area");
    v.Number("initializer.min_cell_matches", min_cell_matches, 8, 10000, "", "matches that a cell needs");
    v.Number("initializer.couple_threshold", couple_threshold, 0, 1, "",
             "share of a cell's inliers that couples it");
  }

  /// Throws InputError for values outside their range.
  void Check() const;

  /// The paper as written: fundamental matrices, no octaves, no degeneracy, all features of the chosen cells.
  static DlrsacOptions Paper();
};

class Dlrsac : public StaticSelector {
 public:
  explicit Dlrsac(const DlrsacOptions& options) : options_(options) { options.Check(); }
  std::string_view name() const override { return "dlrsac"; }
  StaticSelection Select(std::span<const Match> matches, const Camera& camera, uint64_t seed) const override;
  const DlrsacOptions& options() const { return options_; }

 private:
  DlrsacOptions options_;
};

}  // namespace dmslam
