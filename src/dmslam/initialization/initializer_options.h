#pragma once

#include <cstdint>

#include "dmslam/initialization/pair_agreement.h"
#include "dmslam/initialization/two_view_reconstruction.h"
#include "dmslam/motion_segmentation/dlrsac.h"
#include "dmslam/motion_segmentation/match_frames.h"
#include "dmslam/motion_segmentation/two_view_model.h"

namespace dmslam {

/// What selects the matches of a pair of frames that are static.
enum class SelectorMethod : uint8_t { kDlrsac, kArsac, kRansac };

/// Several motions explain what several views show, and one of them shall be the camera's.
struct ContestOptions {
  int max_motions = 3;   ///< that are looked for, each in what the ones before leave
  int min_support = 40;  ///< matches of one, in all views
  double min_distribution_share = kMinDistributionShare;  ///< of the winner's support
  double max_rival_share = 0.3;  ///< D times number of what another motion explains besides, by the winner's
  double step_s = 0.1;           ///< it is held so often at most: it is costly
  double lead_s = 0.35;          ///< it must have won for so long...
  double min_overlap = 0.6;      ///< ...with this share of the smaller support in common from view to view
};

/// Reference frames that are kept side by side. Behind people a moment in which enough of the room is seen is
/// short, and a window that begins in it finds a map.
struct ReferenceOptions {
  int most = 8;
  double step_s = 0.1;               ///< a new one is taken so long after the last
  double max_age_s = 2.0;            ///< an older one is given up...
  double max_promising_age_s = 4.0;  ///< ...or as old as this, where it is promising
  /// Brief ones are taken between the others where one has shown enough for no longer than they are kept:
  /// behind people who walk beside a camera that turns, the room is seen for a third of a second.
  double brief_step_s = 0.05;    ///< one is taken so long after the last of either kind...
  double max_brief_age_s = 0.4;  ///< ...and kept for so long
  /// While they are taken, the frames of two pairs that must agree are apart by so much in the mean.
  double brief_pair_step_s = 0.05;
};

/// How the motion of a pair is searched, and when it is the only one.
struct PairMotionOptions {
  MinimaOptions minima;
  double minima_slack = 5.0;        ///< a minimum with up to so many times the lowest cost is looked at, too
  double min_runner_up_cost = 1.3;  ///< another motion must cost all views this many times as much
  /// Mean squared error over all views, as a share of the bound: more is no one motion...
  double max_cost = 0.1;
  double max_cost_alone = 0.2;        ///< ...but up to this where nothing else comes near...
  double alone_runner_up_cost = 3.0;  ///< ...which is to say that another motion costs so many times as much
};

/// What the geometry of a first map must be.
struct GeometryOptions {
  double min_parallax_rad = 0.015;  ///< median over the points; below it the direction is chance
  /// Standard deviation of the direction of translation, from the residuals: later views mend it.
  double max_direction_sigma_rad = 0.1;
  /// Where no other reference frame has a say, a map beside whose motion another one comes near
  /// (alone_runner_up_cost) must know its direction to so much.
  double clear_direction_sigma_rad = 0.05;
  /// A view with no more than this share of the first view's matches, of those that agree with the motion:
  /// the camera turns away from what the reference frame shows, and waiting brings no more parallax.
  double losing_share = 0.5;
  double losing_parallax_rad = 0.006;  ///< so much is enough then, with clear_direction_sigma_rad
  double max_view_chi2 = 9.0;          ///< a view agrees with a point: squared reprojection error / variance
  double min_consistent_share = 0.75;  ///< of the points that a view between shows, where they should be
  int min_points = 80;                 ///< points that all views agree on

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("initializer.min_parallax_rad", min_parallax_rad, 0, 1, "rad",
             "median parallax of the first map's points");
  }
};

/// Frames before the reference frame testify: who has just stopped is in his place in all views, but not in
/// them.
struct PastOptions {
  double seconds = 0.45;       ///< they are older than the reference frame by up to so much
  int views = 6;               ///< so many of them at most; 0: none
  double max_conflict = 0.08;  ///< of the points, that one of them sees elsewhere; more: wait
  int first = 0;               ///< so many frames come before the first reference frame: they testify only
};

/// What reference frames say of each other's motions.
struct TestimonyOptions {
  double max_turn_rad = 0.02;       ///< two say the same: their rotations differ by so much at most...
  double max_direction_rad = 0.35;  ///< ...and their directions of translation by so much
  double min_rival_ratio = 1.1;  ///< who knows a rival that costs less than this many times as much is silent
  double min_moved_share = 0.2;  ///< of an older one's motion, that the frames compared must be apart
  double memory_s = 1.0;         ///< what was found longer ago does not count
  double share_s = 0.5;          ///< what was found within so much is tried at younger reference frames
};

/// Times are of the frames' stamps.
struct InitializerOptions {
  /// Fewer samples than the selector's own default.
  InitializerOptions() {
    selector.sampling.max_iterations = 600;
    // Agreement over pairs and the comparison of motions over all views decide what one pair leaves open.
    selector.max_rival_share = 0;
  }

  DlrsacOptions selector;      ///< of DLRSAC; its sampling, input and inlier options hold for the others, too
  AgreementOptions agreement;  ///< what several pairs must agree on
  ContestOptions contest;      ///< where they do not
  ReconstructionOptions reconstruction;
  MatchingOptions matching;

  ReferenceOptions references;
  PairMotionOptions motion;
  GeometryOptions geometry;
  PastOptions past;
  TestimonyOptions testimony;

  int threads = 2;  ///< that match a frame with the reference frames; with any number to the same result
  int min_features = 100;              ///< a frame with fewer takes no part
  double frame_step_s = 0.045;         ///< frames nearer to the last one looked at are left out...
  double nearly_parallax_share = 0.9;  ///< ...unless that had this share of the parallax asked for
  int min_matches = 120;               ///< of a frame with the reference frame; fewer: it is given up
  int num_pairs = 3;                   ///< pairs with the reference frame that must agree
  double min_pair_step_s = 0.1;        ///< the frames of two such pairs are apart by so much in the mean
  /// Median displacement of the matches before a pair is worth its cost.
  double min_displacement_rad = 0.015;
  int max_views = 8;       ///< frames after the reference frame that a map is made of, at most
  int max_adjusted = 300;  ///< points that rival motions are adjusted with; the winner takes all
  /// A map of views that are nearer in time must be confirmed by another reference frame or found again, and
  /// may not be compact.
  double sure_age_s = 0.4;

  /// The pyramid of the features, as it is set.
  void SetPyramid(const Pyramid& pyramid) { selector.inlier.pyramid = reconstruction.pyramid = pyramid; }

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("initializer.min_matches", min_matches, 8, 10000, "",
             "matches a frame must have with the reference frame");
    v.Number("initializer.num_pairs", num_pairs, 1, 5, "", "pairs of frames that must agree");
    agreement.Describe(v);
    geometry.Describe(v);
    selector.Describe(v);
  }
};

}  // namespace dmslam
