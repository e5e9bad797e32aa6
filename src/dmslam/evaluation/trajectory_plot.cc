#include "dmslam/evaluation/trajectory_plot.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr double kNoPoint = std::numeric_limits<double>::quiet_NaN();
constexpr PlotColor kGroundTruthColor = {176, 176, 176};

// Pieces of a trajectory further apart than this are not joined: a second, or five times the usual distance
// [ns].
int64_t GapLimitNs(const std::vector<int64_t>& stamps_ns) {
  std::vector<int64_t> steps;
  for (size_t i = 1; i < stamps_ns.size(); ++i) steps.push_back(stamps_ns[i] - stamps_ns[i - 1]);
  if (steps.empty()) return 0;
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  return std::max<int64_t>(1'000'000'000, 5 * steps[steps.size() / 2]);
}

/// The associated estimate, aligned, with its errors; a point that is not finite stands between pieces.
struct Track {
  std::vector<Eigen::Vector3d> positions;
  std::vector<double> seconds;  // since the first pose of the ground truth
  std::vector<double> errors;
};

Track MakeTrack(std::span<const StampedPose> ground_truth, std::span<const StampedPose> estimate,
                const AteReport& report) {
  std::vector<int64_t> stamps_ns;
  for (const PosePair& pair : report.pairs) stamps_ns.push_back(estimate[pair.estimate].stamp_ns);
  const int64_t gap_ns = GapLimitNs(stamps_ns);
  Track track;
  for (size_t i = 0; i < report.pairs.size(); ++i) {
    if (i > 0 && stamps_ns[i] - stamps_ns[i - 1] > gap_ns) {
      track.positions.emplace_back(kNoPoint, kNoPoint, kNoPoint);
      track.seconds.push_back(kNoPoint);
      track.errors.push_back(kNoPoint);
    }
    track.positions.push_back(report.ground_truth_from_estimate *
                              estimate[report.pairs[i].estimate].T_world_cam.translation);
    track.seconds.push_back(1e-9 * static_cast<double>(stamps_ns[i] - ground_truth.front().stamp_ns));
    track.errors.push_back(report.errors[i]);
  }
  return track;
}

/// One coordinate of a view: an axis of the world, upwards or downwards.
struct ViewAxis {
  int axis;
  double sign;
  std::string Label() const { return std::string(sign < 0 ? "-" : "") + "xyz"[axis] + " [m]"; }
  double Of(const Eigen::Vector3d& point) const { return sign * point[axis]; }
};

PlotSeries GroundTruthSeries(std::span<const StampedPose> ground_truth, const ViewAxis& right,
                             const ViewAxis& up) {
  PlotSeries series;
  series.label = "ground truth";
  series.color = kGroundTruthColor;
  series.line_width_px = 3.2;
  for (const StampedPose& pose : ground_truth) {
    series.x.push_back(right.Of(pose.T_world_cam.translation));
    series.y.push_back(up.Of(pose.T_world_cam.translation));
  }
  return series;
}

PlotPanel ViewPanel(const std::string& title, std::span<const StampedPose> ground_truth, const Track& track,
                    const ViewAxis& right, const ViewAxis& up, const PlotColorBar& bar) {
  PlotPanel panel;
  panel.title = title;
  panel.x_label = right.Label();
  panel.y_label = up.Label();
  panel.equal_aspect = true;
  panel.color_bar = bar;
  panel.series.push_back(GroundTruthSeries(ground_truth, right, up));
  PlotSeries estimate;
  estimate.label = "estimate";
  estimate.values = track.errors;
  for (const Eigen::Vector3d& position : track.positions) {
    estimate.x.push_back(right.Of(position));
    estimate.y.push_back(up.Of(position));
  }
  if (track.positions.size() < 200) estimate.marker_radius_px = 2.6;
  PlotSeries start;
  start.label = "first pose";
  start.color = {20, 20, 20};
  start.line_width_px = 0;
  start.marker_radius_px = 4.5;
  start.x = {estimate.x.front()};
  start.y = {estimate.y.front()};
  panel.series.push_back(std::move(estimate));
  panel.series.push_back(std::move(start));
  return panel;
}

PlotPanel ErrorPanel(const Track& track, const AteReport& report, const PlotRange& whole_time,
                     const PlotColorBar& bar) {
  PlotPanel panel;
  panel.title = "Error over time";
  panel.x_label = "time since the first ground truth [s]";
  panel.y_label = "position error [m]";
  panel.y_from_zero = true;
  panel.color_bar = bar;
  panel.color_bar->shown = false;
  panel.x_range = whole_time;
  panel.column_span = 2;
  PlotSeries error;
  error.x = track.seconds;
  error.y = track.errors;
  error.values = track.errors;
  if (track.positions.size() < 200) error.marker_radius_px = 2.6;
  panel.series.push_back(std::move(error));
  for (const auto& [label, value, color] :
       {std::tuple("RMSE", report.statistics.rmse, PlotColor{30, 30, 30}),
        std::tuple("median", report.statistics.median, PlotColor{130, 130, 130})}) {
    PlotSeries level;
    level.label = label;
    level.color = color;
    level.dashed = true;
    level.line_width_px = 1.4;
    level.x = {whole_time.low, whole_time.high};
    level.y = {value, value};
    panel.series.push_back(std::move(level));
  }
  return panel;
}

double Extent(std::span<const StampedPose> trajectory, int axis) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const StampedPose& pose : trajectory) {
    low = std::min(low, pose.T_world_cam.translation[axis]);
    high = std::max(high, pose.T_world_cam.translation[axis]);
  }
  return high - low;
}

// From zero to the 98th percentile: a few spikes would otherwise leave everything else in one colour.
PlotRange ColorRange(std::vector<double> errors) {
  std::sort(errors.begin(), errors.end());
  return {0, std::max(errors[(errors.size() - 1) * 98 / 100], 1e-9)};
}

}  // namespace

UpAxis FindUpAxis(std::span<const StampedPose> trajectory) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const StampedPose& pose : trajectory) up += pose.T_world_cam.rotation * Eigen::Vector3d(0, -1, 0);
  UpAxis best;
  up.cwiseAbs().maxCoeff(&best.axis);
  best.sign = up[best.axis] < 0 ? -1 : 1;
  return best;
}

PlotFigure TrajectoryFigure(std::span<const StampedPose> ground_truth, std::span<const StampedPose> estimate,
                            const AteReport& report, const std::string& title, const std::string& subtitle) {
  DMSLAM_CHECK(report.usable() && !report.pairs.empty(), "only a usable report can be drawn");
  const Track track = MakeTrack(ground_truth, estimate, report);
  const UpAxis up = FindUpAxis(ground_truth);
  // The wider of the two level axes goes to the right; from the top, the world is not mirrored.
  ViewAxis right{(up.axis + 1) % 3, 1}, far{(up.axis + 2) % 3, up.sign};
  if (Extent(ground_truth, far.axis) > Extent(ground_truth, right.axis)) {
    right = {(up.axis + 2) % 3, 1};
    far = {(up.axis + 1) % 3, -up.sign};
  }
  PlotColorBar bar{"position error [m]", ColorRange(report.errors), false};

  PlotFigure figure;
  figure.title = title;
  figure.subtitle = subtitle;
  figure.columns = 2;
  figure.panel_width_px = 560;
  figure.panel_height_px = 430;
  figure.panels.push_back(ViewPanel("From the top", ground_truth, track, right, far, bar));
  bar.shown = true;
  figure.panels.push_back(ViewPanel("From the side", ground_truth, track, right, {up.axis, up.sign}, bar));
  const double seconds =
      1e-9 * static_cast<double>(ground_truth.back().stamp_ns - ground_truth.front().stamp_ns);
  figure.panels.push_back(ErrorPanel(track, report, {0, std::max(seconds, 1e-3)}, bar));
  return figure;
}

}  // namespace dmslam
