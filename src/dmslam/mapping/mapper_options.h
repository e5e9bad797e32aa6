#pragma once

#include "dmslam/dynamics/motion_belief.h"
#include "dmslam/dynamics/seen_through.h"
#include "dmslam/map/conventions.h"
#include "dmslam/triangulation/triangulation_options.h"

namespace dmslam {

/// Creation of landmarks: DM-SLAM's Algorithm 1 (paper 2.2) and the checks around it.
struct LandmarkCreationOptions {
  bool mutual_exclusion = true;  ///< Algorithm 1; off: every match that passes the checks becomes a landmark
  double neighbourhood_rad =
      0.0476;                ///< half the side of the neighbourhood in which one candidate excludes others
  double alpha = 1.0;        ///< candidates of a keyframe are at most alpha * Ln...
  int min_candidates = 120;  ///< ...but never fewer than this
  int confirmed_views = 4;   ///< a point seen in as many views or more...
  double confirmed_span_s = 1.0;  ///< ...over so much time is not subject to Algorithm 1; 0 views: all are
  TriangulationOptions triangulation;

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Switch("mapping.mutual_exclusion", mutual_exclusion,
             "Algorithm 1: one new landmark per neighbourhood, and a bound on their number");
    v.InBaseline("off");
    v.Number("mapping.neighbourhood_rad", neighbourhood_rad, 0, 1, "rad",
             "half the side of the neighbourhood");
    v.Number("mapping.alpha", alpha, 0, 100, "",
             "bound on the candidates, as a share of the tracked landmarks");
    v.InPaper("0.3");
    v.Number("mapping.min_candidates", min_candidates, 0, 10000, "", "candidates that are always allowed");
    v.InPaper("0");
    v.Number("mapping.confirmed_views", confirmed_views, 0, 100, "",
             "points seen in so many views for a second are free of the bound and the neighbourhood; 0: "
             "none");
    v.InPaper("0");
    v.Number("mapping.min_parallax_rad", triangulation.min_parallax_rad, 0.0005, 0.2, "rad",
             "between the rays by which the newest keyframe makes a landmark");
    v.InBaseline("0.02");
    v.InPaper("0.02");
  }
};

struct MapperOptions {
  LandmarkCreationOptions creation;
  MotionBeliefOptions belief;
  SeenThroughOptions seen_through;
  double min_found_ratio =
      0.25;  ///< landmarks found less often than this, of the frames that should see them, go
  int probation_keyframes = 3;  ///< a landmark is on probation until this many keyframes followed
  int probation_min_observations =
      3;  ///< from the second keyframe on, a landmark on probation needs as many observers
  double redundant_share = 0.9;  ///< a keyframe goes when this share of its landmarks is seen by three others
  double keypoint_sigma_px = kKeypointSigmaPx;
  int local_keyframes = 40;  ///< at most this many keyframes are adjusted at a time (most covisible first)
  int local_fixed_keyframes = 20;        ///< at most this many hold the window in place
  int final_adjustment_iterations = 30;  ///< when the sequence has ended
  int final_adjustment_keyframes =
      500;                 ///< in a larger map, so many newest ones of each camera are adjusted then
  double min_depth = 0.1;  ///< a landmark goes before that where it is nearer to a keyframe than this share
                           ///< of what the keyframe sees in the median; 0: none does
  int min_covisibility = kMinCovisibility;
  int nearby_keyframes =
      10;  ///< at most so many that look at the same place are fused with, covisible or not
  double nearby_distance = 0.5;     ///< how far they may be, as a share of the scene's depth
  double nearby_angle_rad = 0.6;    ///< how far they may be turned
  double fuse_radius_rad = 0.0057;  ///< times the scale of the predicted octave
  int max_fuse_distance = 80;       ///< bits, of a landmark and a feature at its place

  template <typename Visitor>
  void Describe(Visitor& v) {
    creation.Describe(v);
    v.Number("mapping.min_depth", min_depth, 0, 1, "",
             "nearer to a keyframe than this share of what it sees in the median, a landmark goes at the "
             "end");
    v.InBaseline("0");
    v.InPaper("0");
    seen_through.Describe(v);
    v.Number("mapping.local_keyframes", local_keyframes, 2, 1000, "", "keyframes adjusted at a time");
    v.Number("mapping.redundant_share", redundant_share, 0, 1, "",
             "a keyframe goes when so much of it is seen by three others");
    belief.Describe(v);
  }
};

}  // namespace dmslam
