#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/initialization/first_map.h"
#include "dmslam/initialization/initializer_options.h"

namespace dmslam {

/// A frame with its matches to a reference frame.
struct ReferenceView {
  InitializerFrame frame;
  PairView pair;
  double since_reference_s = 0;  ///< negative for frames before the reference frame
  bool moved = false;            ///< far enough for the selector to be asked
  Eigen::Quaterniond R_k_0 = Eigen::Quaterniond::Identity();  ///< roughly: how far the camera has turned
};

/// A map of a reference frame and some views of it, whose matches share the feature of the reference frame.
struct CandidateMap {
  struct Placed {
    const ReferenceView* view = nullptr;
    Rigid3d T_k_0;
    double consistent_share = 1;  ///< of the points that the view shows: those where they should be
  };
  std::vector<Eigen::Vector3d> points;  ///< in the reference camera; parallel to the last view's matches
  std::vector<uint8_t> use;             ///< points that stand
  std::vector<Placed> placed;           ///< the last view first
  double cost = 1;                      ///< mean truncated squared error over all views
  /// What the next best motion costs, in units of this one's cost; none: there is no other.
  std::optional<double> rival_ratio = std::nullopt;

  bool HasRivalBelow(double ratio) const { return rival_ratio && *rival_ratio < ratio; }
  const ReferenceView& last() const { return *placed.front().view; }
  const Rigid3d& T_last_0() const { return placed.front().T_k_0; }
  int NumPoints() const;
};

/// Why there is no map.
struct Refused {
  WaitReason wait = WaitReason::kNone;  ///< kNone: nothing was refused yet
  std::string text;
  double parallax_rad = 0;  ///< median, where it or the direction was not good enough
};

/// Makes candidates under a given motion and measures them. Holds no state but its options.
class CandidateBuilder {
 public:
  CandidateBuilder(const InitializerOptions& options, const Camera& camera, AdjustFunction adjust)
      : options_(options), camera_(camera), adjust_(std::move(adjust)) {}

  /// The map under one motion of the reference frame and `last`: points of the static matches, poses of the
  /// views between, adjusted twice. None: `refused` says why.
  std::optional<CandidateMap> Build(const ReferenceView& last, std::span<const ReferenceView* const> between,
                                    std::span<const uint8_t> is_static, const TwoViewModel& model,
                                    Refused* refused) const;
  /// Finds the pose of a view from the points, and how many it sees where they should be; a view that shows
  /// too few of them says nothing and is left out.
  void PlaceView(const ReferenceView& view, CandidateMap* candidate) const;
  /// The view's pose by the points; none where it shows too few of them where they should be.
  std::optional<Rigid3d> PoseOf(const ReferenceView& view, const CandidateMap& candidate) const;
  /// Drops points that some view does not see where they should be.
  void KeepConsistent(CandidateMap* candidate) const;
  /// Matches flagged that have no point get one under the poses as they are, where all views agree with it.
  void AddMissing(std::span<const uint8_t> flags, CandidateMap* candidate) const;
  /// Poses and points together; false where that fails.
  bool Adjust(CandidateMap* candidate) const;

  /// The two motions are the same to within 0.01 rad and 0.1 rad of direction.
  static bool SameMotion(const Rigid3d& a, const Rigid3d& b);
  /// Median over the points, at the last view [rad].
  double Parallax(const CandidateMap& candidate) const;
  /// How many of the view's matches agree with such a motion: those of somebody who moves do not.
  int NumAgreeing(const ReferenceView& view, const Rigid3d& T_k_0) const;
  /// How well the direction of translation to the last view is known [rad].
  double DirectionSigma(const CandidateMap& candidate) const;
  FirstMap MakeMap(const InitializerFrame& reference, const CandidateMap& candidate,
                   std::span<const uint8_t> is_static) const;

 private:
  std::optional<CandidateMap> PointsOfPair(const ReferenceView& last, std::span<const uint8_t> is_static,
                                           const TwoViewModel& model, Refused* refused) const;
  bool Sees(const Rigid3d& T_k_0, const Eigen::Vector3d& point, const Match& match) const;
  MatchArrays ArraysOf(std::span<const Match> matches) const;
  double Cost(const CandidateMap& candidate, std::span<const uint8_t> is_static) const;

  InitializerOptions options_;
  Camera camera_;
  AdjustFunction adjust_;
};

}  // namespace dmslam
