#include "dmslam/initialization/candidate_map.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "dmslam/geometry/absolute_pose.h"
#include "dmslam/geometry/triangulation.h"
#include "dmslam/motion_segmentation/two_view_model.h"

namespace dmslam {
namespace {

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Calls visit(k, match) for every feature of `matches` that the view matched too.
template <typename Visit>
void ForEachSeen(const CandidateMap::Placed& placed, std::span<const Match> matches, Visit visit) {
  const auto& seen = placed.view->pair.matches;
  for (size_t k = 0, i = 0; k < matches.size(); ++k) {
    while (i < seen.size() && seen[i].index0 < matches[k].index0) ++i;
    if (i == seen.size()) break;
    if (seen[i].index0 == matches[k].index0) visit(k, seen[i]);
  }
}

/// Of more than `most` points keeps an even choice.
void KeepEvery(int most, CandidateMap* candidate) {
  const int have = candidate->NumPoints();
  if (have <= most) return;
  int seen = 0;
  for (uint8_t& use : candidate->use) {
    if (!use) continue;
    use = (seen + 1) * most / have > seen * most / have ? 1 : 0;
    ++seen;
  }
}

}  // namespace

int CandidateMap::NumPoints() const { return std::accumulate(use.begin(), use.end(), 0); }

bool CandidateBuilder::Sees(const Rigid3d& T_k_0, const Eigen::Vector3d& point, const Match& match) const {
  const double variance = options_.selector.inlier.pyramid.SigmaSquared(match.octave1);
  return ReprojectionErrorSquared(camera_.Ideal(), T_k_0, point, match.uv1_px) <=
         options_.geometry.max_view_chi2 * variance;
}

bool CandidateBuilder::SameMotion(const Rigid3d& a, const Rigid3d& b) {
  return AngleBetween(a.rotation, b.rotation) < 0.01 &&
         a.translation.normalized().dot(b.translation.normalized()) > std::cos(0.1);
}

std::optional<CandidateMap> CandidateBuilder::PointsOfPair(const ReferenceView& last,
                                                           std::span<const uint8_t> is_static,
                                                           const TwoViewModel& model,
                                                           Refused* refused) const {
  StaticSelection selection;
  selection.is_static.assign(is_static.begin(), is_static.end());
  selection.kind = ModelKind::kEssential;
  selection.E = model.M;
  // Little parallax refuses the winner only: the right motion may have less of it than its wrong rivals.
  ReconstructionOptions reconstruction = options_.reconstruction;
  reconstruction.min_parallax_rad = 0;
  reconstruction.max_runner_up = 1;
  const TwoViewReconstruction pair =
      ReconstructFromStatic(last.pair.matches, selection, camera_, reconstruction);
  if (!pair.IsUsable()) {
    *refused = {WaitReason::kNoReconstruction, pair.explanation};
    return std::nullopt;
  }
  CandidateMap candidate;
  candidate.points = pair.points_cam0;
  candidate.use = pair.has_point;
  candidate.placed.push_back({&last, pair.T_1_0, 1.0});
  return candidate;
}

std::optional<CandidateMap> CandidateBuilder::Build(const ReferenceView& last,
                                                    std::span<const ReferenceView* const> between,
                                                    std::span<const uint8_t> is_static,
                                                    const TwoViewModel& model, Refused* refused) const {
  std::optional<CandidateMap> candidate = PointsOfPair(last, is_static, model, refused);
  if (!candidate) return std::nullopt;
  for (const ReferenceView* view : between) PlaceView(*view, &*candidate);
  for (const CandidateMap::Placed& placed : candidate->placed) {
    if (placed.consistent_share >= options_.geometry.min_consistent_share) continue;
    *refused = {WaitReason::kInconsistent, "frame " + std::to_string(placed.view->frame.index) + " sees " +
                                               std::to_string(placed.consistent_share) +
                                               " of the points where they should be"};
    return std::nullopt;
  }
  KeepConsistent(&*candidate);
  // Twice: what had no point under the first poses has a say, too. A motion half way to its minimum would
  // lose unfairly.
  for (int round = 0; round < 2; ++round) {
    KeepEvery(options_.max_adjusted, &*candidate);
    if (!Adjust(&*candidate)) {
      *refused = {WaitReason::kInconsistent, "the adjustment failed"};
      return std::nullopt;
    }
    AddMissing(is_static, &*candidate);
  }
  candidate->cost = Cost(*candidate, is_static);
  return candidate;
}

/// Mean over the static matches of the squared errors in all views that see them, truncated at the bound and
/// in units of it. A match without a point lies at infinity: under little parallax the noise puts what is far
/// behind the cameras, and a motion that invents parallax must not win for that.
double CandidateBuilder::Cost(const CandidateMap& candidate, std::span<const uint8_t> is_static) const {
  const auto& matches = candidate.last().pair.matches;
  std::vector<double> sum(matches.size(), 0.0), count(matches.size(), 0.0);
  for (const CandidateMap::Placed& placed : candidate.placed) {
    const Rigid3d turned(placed.T_k_0.rotation, Eigen::Vector3d::Zero());
    ForEachSeen(placed, matches, [&](size_t k, const Match& seen) {
      if (!is_static[k]) return;
      const double variance = options_.selector.inlier.pyramid.SigmaSquared(seen.octave1);
      const double error =
          candidate.use[k]
              ? ReprojectionErrorSquared(camera_.Ideal(), placed.T_k_0, candidate.points[k], seen.uv1_px)
              : ReprojectionErrorSquared(camera_.Ideal(), turned, camera_.Ray(matches[k].uv0_px),
                                         seen.uv1_px);
      sum[k] += std::min(1.0, error / (variance * options_.geometry.max_view_chi2));
      count[k] += 1.0;
    });
  }
  double total = 0, asked = 0;
  for (size_t k = 0; k < matches.size(); ++k) {
    if (!is_static[k]) continue;
    total += count[k] > 0 ? sum[k] / count[k] : 1.0;
    asked += 1.0;
  }
  return asked > 0 ? total / asked : 1.0;
}

namespace {

/// Points with their places in one view, all that a pose is found from.
struct SeenPoints {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> uv_px;
  std::vector<double> information;

  size_t size() const { return points.size(); }
};

struct FittedPose {
  Rigid3d T;
  std::vector<int> inliers;
};

std::vector<int> Agreeing(const Pinhole& camera, const Rigid3d& T, const SeenPoints& seen, double max_chi2) {
  std::vector<int> agreeing;
  for (size_t k = 0; k < seen.size(); ++k) {
    const double squared = ReprojectionErrorSquared(camera, T, seen.points[k], seen.uv_px[k]);
    if (squared * seen.information[k] <= max_chi2) agreeing.push_back(static_cast<int>(k));
  }
  return agreeing;
}

/// The pose near `start` that most of the points agree with. From wide bounds to narrow ones: a start is some
/// pixels off, and a mismatch a hundred.
FittedPose PlaceFrom(const Pinhole& camera, const Rigid3d& start, const SeenPoints& seen, double max_chi2) {
  FittedPose placed{start, {}};
  for (const double slack : {300.0, 100.0, 10.0, 3.0, 1.0}) {
    const std::vector<int> agreeing = Agreeing(camera, placed.T, seen, slack * max_chi2);
    if (agreeing.size() < 10) continue;
    placed.T = RefinePose(camera, placed.T, seen.points, seen.uv_px, seen.information, agreeing, 5);
  }
  placed.inliers = Agreeing(camera, placed.T, seen, max_chi2);
  return placed;
}

/// The view placed already that is nearest in time, or the reference frame itself.
Rigid3d NearestPose(const CandidateMap& candidate, double since_reference_s) {
  Rigid3d nearest;
  double least_s = std::abs(since_reference_s);
  for (const CandidateMap::Placed& placed : candidate.placed) {
    const double apart_s = std::abs(placed.view->since_reference_s - since_reference_s);
    if (apart_s < least_s) {
      least_s = apart_s;
      nearest = placed.T_k_0;
    }
  }
  return nearest;
}

}  // namespace

void CandidateBuilder::PlaceView(const ReferenceView& view, CandidateMap* candidate) const {
  constexpr double kEnough = 0.9;  // of the points agree: no other start is tried
  const ReferenceView& last = candidate->last();
  SeenPoints seen;
  const CandidateMap::Placed placed_view{&view, Rigid3d(), 1.0};
  ForEachSeen(placed_view, last.pair.matches, [&](size_t k, const Match& match) {
    if (!candidate->use[k]) return;
    seen.points.push_back(candidate->points[k]);
    seen.uv_px.push_back(match.uv1_px);
    seen.information.push_back(1.0 / options_.selector.inlier.pyramid.SigmaSquared(match.octave1));
  });
  if (seen.size() < 20) return;  // says nothing
  const Rigid3d& T_last = candidate->T_last_0();
  const double fraction = view.since_reference_s / last.since_reference_s;
  const Rigid3d between(Eigen::Quaterniond::Identity().slerp(fraction, T_last.rotation),
                        fraction * T_last.translation);
  FittedPose best = PlaceFrom(camera_.Ideal(), between, seen, options_.geometry.max_view_chi2);
  // A hand does not move evenly.
  if (static_cast<double>(best.inliers.size()) < kEnough * static_cast<double>(seen.size())) {
    const Rigid3d nearest = NearestPose(*candidate, view.since_reference_s);
    FittedPose other = PlaceFrom(camera_.Ideal(), nearest, seen, options_.geometry.max_view_chi2);
    if (other.inliers.size() > best.inliers.size()) best = std::move(other);
  }
  candidate->placed.push_back(
      {&view, best.T, static_cast<double>(best.inliers.size()) / static_cast<double>(seen.size())});
}

std::optional<Rigid3d> CandidateBuilder::PoseOf(const ReferenceView& view,
                                                const CandidateMap& candidate) const {
  for (const CandidateMap::Placed& placed : candidate.placed) {
    if (placed.view == &view) return placed.T_k_0;
  }
  CandidateMap longer = candidate;
  PlaceView(view, &longer);
  const CandidateMap::Placed& placed = longer.placed.back();
  const bool shows_enough =
      placed.view == &view && placed.consistent_share >= options_.geometry.min_consistent_share;
  return shows_enough ? std::optional(placed.T_k_0) : std::nullopt;
}

void CandidateBuilder::KeepConsistent(CandidateMap* candidate) const {
  const auto& matches = candidate->last().pair.matches;
  for (size_t k = 0; k < matches.size(); ++k) {
    if (candidate->use[k] && !(candidate->points[k].z() > 0 && candidate->points[k].allFinite())) {
      candidate->use[k] = 0;
    }
  }
  for (const CandidateMap::Placed& placed : candidate->placed) {
    ForEachSeen(placed, matches, [&](size_t k, const Match& seen) {
      if (candidate->use[k] && !Sees(placed.T_k_0, candidate->points[k], seen)) candidate->use[k] = 0;
    });
  }
}

/// Static matches that had no point under the poses before they were adjusted may have one under them now.
void CandidateBuilder::AddMissing(std::span<const uint8_t> flags, CandidateMap* candidate) const {
  const Rigid3d& T_last = candidate->T_last_0();
  const auto& matches = candidate->last().pair.matches;
  for (size_t k = 0; k < matches.size(); ++k) {
    if (!flags[k] || candidate->use[k]) continue;
    const auto point =
        TriangulatePointInFirst(T_last, camera_.Ray(matches[k].uv0_px), camera_.Ray(matches[k].uv1_px));
    if (!point) continue;
    candidate->points[k] = *point;
    candidate->use[k] = 1;
  }
  KeepConsistent(candidate);
}

bool CandidateBuilder::Adjust(CandidateMap* candidate) const {
  if (!adjust_) return true;
  const auto& matches = candidate->last().pair.matches;
  std::vector<Rigid3d> poses{Rigid3d()};
  std::vector<Eigen::Vector3d> points;
  std::vector<int> point_of(matches.size(), -1);
  std::vector<InitialObservation> observations;
  const Pyramid& pyramid = options_.selector.inlier.pyramid;
  for (size_t k = 0; k < matches.size(); ++k) {
    if (!candidate->use[k]) continue;
    point_of[k] = static_cast<int>(points.size());
    points.push_back(candidate->points[k]);
    observations.push_back(
        {0, point_of[k], matches[k].uv0_px, 1.0 / pyramid.SigmaSquared(matches[k].octave0)});
  }
  for (const CandidateMap::Placed& placed : candidate->placed) {
    const int pose = static_cast<int>(poses.size());
    poses.push_back(placed.T_k_0);
    ForEachSeen(placed, matches, [&](size_t k, const Match& seen) {
      if (point_of[k] < 0) return;
      observations.push_back({pose, point_of[k], seen.uv1_px, 1.0 / pyramid.SigmaSquared(seen.octave1)});
    });
  }
  if (!adjust_(&poses, &points, observations)) return false;
  for (size_t p = 0; p < candidate->placed.size(); ++p) candidate->placed[p].T_k_0 = poses[p + 1];
  for (size_t k = 0; k < matches.size(); ++k) {
    if (point_of[k] >= 0) candidate->points[k] = points[static_cast<size_t>(point_of[k])];
  }
  return true;
}

double CandidateBuilder::Parallax(const CandidateMap& candidate) const {
  const Eigen::Vector3d center = candidate.T_last_0().Center();
  std::vector<double> parallax;
  for (size_t k = 0; k < candidate.use.size(); ++k) {
    if (candidate.use[k])
      parallax.push_back(ParallaxAngle(Eigen::Vector3d::Zero(), center, candidate.points[k]));
  }
  return Median(std::move(parallax));
}

MatchArrays CandidateBuilder::ArraysOf(std::span<const Match> matches) const {
  std::vector<uint32_t> order(matches.size());
  std::iota(order.begin(), order.end(), 0U);
  return MakeArrays(matches, order, camera_, options_.selector.inlier);
}

int CandidateBuilder::NumAgreeing(const ReferenceView& view, const Rigid3d& T_k_0) const {
  const Eigen::Matrix3d E = Hat(T_k_0.translation.normalized()) * T_k_0.rotation.toRotationMatrix();
  return CountInliers(E, ArraysOf(view.pair.matches), {0, view.pair.matches.size()});
}

double CandidateBuilder::DirectionSigma(const CandidateMap& candidate) const {
  const MatchArrays arrays = ArraysOf(candidate.last().pair.matches);
  TwoViewModel model;
  model.R = candidate.T_last_0().rotation.toRotationMatrix();
  model.t = candidate.T_last_0().translation.normalized();
  return dmslam::DirectionSigma(arrays, candidate.use, options_.selector.inlier.chi2, model);
}

namespace {

/// What the views before the last one see of the points, by time. `point_of`: of each match that has one.
std::vector<FirstMap::View> ViewsBetween(const CandidateMap& candidate, std::span<const uint32_t> point_of,
                                         double unit) {
  std::vector<FirstMap::View> views;
  for (const CandidateMap::Placed& placed : candidate.placed) {
    if (placed.view == &candidate.last()) continue;
    FirstMap::View view{placed.view->frame, placed.T_k_0, {}};
    view.T_k_0.translation /= unit;
    ForEachSeen(placed, candidate.last().pair.matches, [&](size_t k, const Match& seen) {
      if (candidate.use[k]) view.sights.push_back({point_of[k], seen.index1});
    });
    views.push_back(std::move(view));
  }
  std::ranges::sort(views, {}, [](const FirstMap::View& view) { return view.frame.stamp_ns; });
  return views;
}

}  // namespace

FirstMap CandidateBuilder::MakeMap(const InitializerFrame& reference, const CandidateMap& candidate,
                                   std::span<const uint8_t> is_static) const {
  const ReferenceView& last = candidate.last();
  FirstMap map;
  map.frame0 = reference;
  map.frame1 = last.frame;
  map.matches = last.pair.matches;
  map.is_static.assign(is_static.begin(), is_static.end());
  map.num_views = static_cast<int>(candidate.placed.size()) + 1;
  map.median_parallax_rad = Parallax(candidate);
  std::vector<double> depths;
  for (size_t k = 0; k < candidate.use.size(); ++k) {
    if (candidate.use[k]) depths.push_back(candidate.points[k].z());
  }
  const double unit = Median(std::move(depths));
  map.T_1_0 = candidate.T_last_0();
  map.T_1_0.translation /= unit;
  std::vector<uint32_t> point_of(candidate.use.size(), 0);  // of a match
  for (size_t k = 0; k < candidate.use.size(); ++k) {
    if (!candidate.use[k]) continue;
    const Match& match = last.pair.matches[k];
    point_of[k] = static_cast<uint32_t>(map.points.size());
    map.points.push_back({match.index0, match.index1, candidate.points[k] / unit});
  }
  map.between = ViewsBetween(candidate, point_of, unit);
  return map;
}

}  // namespace dmslam
