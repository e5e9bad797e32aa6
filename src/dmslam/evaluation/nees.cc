#include "dmslam/evaluation/nees.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "dmslam/evaluation/alignment.h"
#include "dmslam/evaluation/association.h"
#include "dmslam/geometry/solve_symmetric.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr int kTrial = 2;  // STATE_TRIAL of dmslam_frame_pose_t
constexpr double kDegrees = 180.0 / 3.14159265358979323846;

/// A told pose and the true one of its instant.
struct Known {
  const ToldPose* told = nullptr;
  Rigid3d T_true_cam;
  double coverage = 0;
  double gone = 0;               ///< view changes since the first frame, summed up...
  double entered = 0;            ///< ...times the variance of the rotation at each of them...
  double since_first = 0;        ///< ...and the change from the first frame of its map to this one
  const Known* first = nullptr;  ///< of its map
};

std::vector<Known> Associate(std::span<const StampedPose> truth, std::span<const ToldPose> told,
                             std::span<const double> coverage, int64_t max_difference_ns) {
  std::vector<Known> known;
  for (const ToldPose& pose : told) {
    if (pose.state == kTrial) continue;
    const auto next = std::ranges::lower_bound(truth, pose.pose.stamp_ns, {}, &StampedPose::stamp_ns);
    const StampedPose* nearest = next == truth.end() ? nullptr : &*next;
    if (next != truth.begin() && (nearest == nullptr || pose.pose.stamp_ns - (next - 1)->stamp_ns <
                                                            nearest->stamp_ns - pose.pose.stamp_ns))
      nearest = &*(next - 1);
    if (nearest == nullptr || std::abs(nearest->stamp_ns - pose.pose.stamp_ns) > max_difference_ns) continue;
    known.push_back({&pose, nearest->T_world_cam, pose.frame < coverage.size() ? coverage[pose.frame] : 0.0});
  }
  return known;
}

double RotationVariance(const ToldPose& told) {
  return told.covariance ? told.covariance->bottomRightCorner<3, 3>().trace() / 3.0 : 0.0;
}

/// What was entered from a to b, as far as b's view is not a's again.
double Entered(const Known& a, const Known& b, double change) {
  const double gone = b.gone - a.gone;
  return gone > change ? (b.entered - a.entered) * change / gone : b.entered - a.entered;
}

/// Fills in what changed in the view since the first frame of each map, of which the scale is.
void FindChanges(std::vector<Known>* known) {
  const Known* first = nullptr;
  for (size_t k = 0; k < known->size(); ++k) {
    const ToldPose& now = *(*known)[k].told;
    const auto change_from = [&now](const ToldPose& before) {
      return ViewChange(now.pose.T_world_cam.Inverse() * before.pose.T_world_cam, now.depth);
    };
    if (first == nullptr || first->told->map != now.map) first = &(*known)[k];
    (*known)[k].first = first;
    (*known)[k].since_first = change_from(*first->told);
    if (k == 0) continue;
    const Known& before = (*known)[k - 1];
    const double change = change_from(*before.told);
    (*known)[k].gone = before.gone + change;
    (*known)[k].entered = before.entered + change * RotationVariance(now);
  }
}

/// Map units in a metre, by the first seconds of a map.
std::optional<double> ScaleOf(std::span<const Known> known, uint32_t map, double gauge_s) {
  std::vector<Eigen::Vector3d> truth, told;
  std::optional<int64_t> begin_ns;
  for (const Known& pose : known) {
    if (pose.told->map != map) continue;
    if (!begin_ns) begin_ns = pose.told->pose.stamp_ns;
    if (static_cast<double>(pose.told->pose.stamp_ns - *begin_ns) * 1e-9 > gauge_s) break;
    truth.push_back(pose.T_true_cam.translation);
    told.push_back(pose.told->pose.T_world_cam.translation);
  }
  const std::optional<Sim3d> told_from_truth = AlignPoints(truth, told, Alignment::kSim3);
  return told_from_truth ? std::optional(told_from_truth->scale) : std::nullopt;
}

double SquaredNorm(const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance) {
  return error.dot(SolveSymmetric<3, 1>(covariance, error));
}

double SigmaAlong(const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance) {
  const Eigen::Vector3d direction = error.normalized();
  return std::sqrt(std::max(0.0, direction.dot(covariance * direction)));
}

std::optional<NeesPair> Judge(const Known& a, const Known& b, double units, const NeesOptions& options) {
  const auto pose_a = a.told->InMap(), pose_b = b.told->InMap();
  if (!pose_a || !pose_b) return std::nullopt;
  const Rigid3d told = pose_a->T_world_cam.Inverse() * pose_b->T_world_cam;
  const double change = ViewChange(told.Inverse(), b.told->depth);
  const ViewsBetween between{change, b.gone - a.gone, a.since_first, Entered(a, b, change),
                             Entered(*a.first, a, a.since_first)};
  const Matrix6d covariance = RelativeCovariance(*pose_a, *pose_b, between, b.told->depth, options.model);
  const Rigid3d truth = a.T_true_cam.Inverse() * b.T_true_cam;
  const Eigen::Vector3d position = told.translation - units * truth.translation;
  const Eigen::Vector3d rotation = LogSo3(told.rotation * truth.rotation.conjugate());
  const Eigen::Matrix3d of_position = covariance.topLeftCorner<3, 3>(),
                        of_rotation = covariance.bottomRightCorner<3, 3>();
  NeesPair pair;
  pair.stamp_ns = b.told->pose.stamp_ns;
  pair.coverage = 0.5 * (a.coverage + b.coverage);
  pair.position = SquaredNorm(position, of_position);
  pair.rotation = SquaredNorm(rotation, of_rotation);
  pair.position_error = position.norm() / units;
  pair.position_sigma = SigmaAlong(position, of_position) / units;
  pair.rotation_error_rad = rotation.norm();
  pair.rotation_sigma_rad = SigmaAlong(rotation, of_rotation);
  pair.outside = pair.position_error > 3.0 * pair.position_sigma + options.slack_m;
  return pair;
}

}  // namespace

std::vector<NeesPair> ComputeNees(std::span<const StampedPose> ground_truth, std::span<const ToldPose> told,
                                  std::span<const double> coverage, double after_s,
                                  const NeesOptions& options) {
  std::vector<Known> known = Associate(ground_truth, told, coverage, options.max_difference_ns);
  FindChanges(&known);
  std::vector<NeesPair> pairs;
  std::optional<double> units;
  uint32_t map = 0;
  size_t end = 0;
  for (const Known& a : known) {
    if (!units || a.told->map != map) {
      map = a.told->map;
      units = ScaleOf(known, map, options.gauge_s);
      if (!units) continue;
    }
    const int64_t wanted_ns = a.told->pose.stamp_ns + ToNs(after_s);
    while (end < known.size() && known[end].told->pose.stamp_ns < wanted_ns - options.max_difference_ns)
      ++end;
    if (end == known.size()) break;
    const Known& b = known[end];
    if (b.told->pose.stamp_ns > wanted_ns + options.max_difference_ns || b.told->map != map) continue;
    if (const std::optional<NeesPair> pair = Judge(a, b, *units, options)) pairs.push_back(*pair);
  }
  return pairs;
}

NeesSummary Summarize(std::span<const NeesPair> pairs) {
  NeesSummary summary;
  summary.count = pairs.size();
  if (pairs.empty()) return summary;
  for (const NeesPair& pair : pairs) {
    summary.position += pair.position / 3.0;
    summary.rotation += pair.rotation / 3.0;
    summary.position_beyond += pair.position > kBound999 ? 1 : 0;
    summary.rotation_beyond += pair.rotation > kBound999 ? 1 : 0;
    summary.outside += pair.outside ? 1 : 0;
  }
  for (double* value : {&summary.position, &summary.rotation, &summary.position_beyond,
                        &summary.rotation_beyond, &summary.outside})
    *value /= static_cast<double>(pairs.size());
  return summary;
}

std::vector<NeesPair> ThirdByCoverage(std::vector<NeesPair> pairs, int third) {
  std::ranges::stable_sort(pairs, {}, &NeesPair::coverage);
  const size_t count = pairs.size(), part = static_cast<size_t>(third);
  return {pairs.begin() + static_cast<std::ptrdiff_t>(count * part / 3),
          pairs.begin() + static_cast<std::ptrdiff_t>(count * (part + 1) / 3)};
}

PlotFigure NeesFigure(std::span<const NeesCurve> curves, const std::string& title) {
  PlotFigure figure;
  figure.title = title;
  figure.columns = 2;
  for (const NeesCurve& curve : curves) {
    for (const bool rotation : {false, true}) {
      PlotSeries error, bound;
      error.label = "error";
      bound.label = "3 sigma";
      bound.color = kPlotPalette[1];
      for (const NeesPair& pair : curve.pairs) {
        const double time_s = static_cast<double>(pair.stamp_ns - curve.pairs.front().stamp_ns) * 1e-9;
        for (PlotSeries* series : {&error, &bound}) series->x.push_back(time_s);
        error.y.push_back(rotation ? pair.rotation_error_rad * kDegrees : pair.position_error * 1e3);
        bound.y.push_back(3.0 * (rotation ? pair.rotation_sigma_rad * kDegrees : pair.position_sigma * 1e3));
      }
      char name[80];
      std::snprintf(name, sizeof(name), "%s over %g s", rotation ? "rotation" : "position", curve.after_s);
      PlotPanel panel;
      panel.title = name;
      panel.x_label = "time [s]";
      panel.y_label = rotation ? "[degrees]" : "[mm]";
      panel.y_from_zero = true;
      panel.series = {bound, error};
      figure.panels.push_back(panel);
    }
  }
  return figure;
}

}  // namespace dmslam
