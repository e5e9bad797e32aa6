#include "dmslam/synthetic/camera_path.h"

#include <algorithm>
#include <cmath>

#include "dmslam/synthetic/angles.h"
#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr double kDegree = kPi / 180.0;
constexpr double kEyeHeight = 1.42;

/// How much of the pattern's k-th of three movements is on at a phase in 0..1: one after another, softly
/// exchanged.
double Share(double phase, int k) {
  double distance = std::abs(phase - (k + 0.5) / 3.0);
  distance = std::min(distance, 1.0 - distance);
  const double x = std::clamp((0.21 - distance) / 0.08, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

/// Appends a rectangle with rounded corners, against the clock, from the middle of its lower side.
void AppendRoundedRectangle(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double radius,
                            std::vector<Eigen::Vector2d>& points) {
  const Eigen::Vector2d centers[4] = {{high.x() - radius, low.y() + radius},
                                      {high.x() - radius, high.y() - radius},
                                      {low.x() + radius, high.y() - radius},
                                      {low.x() + radius, low.y() + radius}};
  points.emplace_back(0.5 * (low.x() + high.x()), low.y());
  for (int corner = 0; corner < 4; ++corner) {
    for (int i = 0; i <= 24; ++i) {
      const double angle = (corner - 1 + i / 24.0) * 0.5 * kPi;
      points.push_back(centers[corner] + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
  }
  points.push_back(Eigen::Vector2d(0.5 * (low.x() + high.x()), low.y()));
}

}  // namespace

PathKind ParsePathKind(const std::string& name) {
  if (name == "static") return PathKind::kStatic;
  if (name == "xyz") return PathKind::kXyz;
  if (name == "rpy") return PathKind::kRpy;
  if (name == "halfsphere") return PathKind::kHalfsphere;
  if (name == "tour") return PathKind::kTour;
  if (name == "ring") return PathKind::kRing;
  if (name == "forward") return PathKind::kForward;
  if (name == "turn") return PathKind::kTurn;
  throw InputError("--path: '" + name +
                   "' is not known; choose static, xyz, rpy, halfsphere, tour, ring, forward or turn");
}

SmoothNoise::SmoothNoise(uint64_t seed, double low_hz, double high_hz) {
  Random random(seed);
  double power = 0;
  for (int i = 0; i < kTerms; ++i) {
    const double hz = low_hz * std::pow(high_hz / low_hz, (i + random.Uniform(0.1, 0.9)) / kTerms);
    frequency_rad_s_[i] = 2.0 * kPi * hz;
    phase_rad_[i] = random.Uniform(0, 2.0 * kPi);
    amplitude_[i] = low_hz / hz;
    power += 0.5 * amplitude_[i] * amplitude_[i];
  }
  for (double& amplitude : amplitude_) amplitude /= std::sqrt(power);
}

double SmoothNoise::At(double time_s) const {
  double sum = 0;
  for (int i = 0; i < kTerms; ++i)
    sum += amplitude_[i] * std::sin(frequency_rad_s_[i] * time_s + phase_rad_[i]);
  return sum;
}

Eigen::Vector2d CameraPath::Loop::At(double s) const {
  const double length = arc_m.back();
  s -= length * std::floor(s / length);
  const auto next = std::upper_bound(arc_m.begin() + 1, arc_m.end() - 1, s) - arc_m.begin();
  const auto i = static_cast<size_t>(next);
  const double t = (s - arc_m[i - 1]) / (arc_m[i] - arc_m[i - 1]);
  return points[i - 1] + t * (points[i] - points[i - 1]);
}

double CameraPath::Loop::Heading(double s) const {
  // Over half a metre on either side, so that corners of the polygon do not show.
  const Eigen::Vector2d along = At(s + 0.5) - At(s - 0.5);
  return std::atan2(along.y(), along.x());
}

CameraPath::Loop CameraPath::MakeLoop(const Scene& scene) {
  Loop loop;
  if (scene.kind == SceneKind::kCorridor) {
    AppendRoundedRectangle({0, 0}, scene.ring_size_m.cast<double>(), 1.0, loop.points);
  } else if (scene.kind == SceneKind::kAliased) {
    // Around the first room, through the door at x = 1.6, around the second, and back.
    const Eigen::Vector2d shift = (scene.rooms[1].min() - scene.rooms[0].min()).cast<double>();
    loop.points = {{1.5, 4.6}, {1.35, 3.6}, {1.4, 2.2}, {2.0, 1.35}, {3.2, 1.1}, {4.6, 1.1},  {5.6, 1.6},
                   {5.9, 3.0}, {5.6, 4.4},  {4.6, 4.9}, {3.2, 4.9},  {2.2, 5.0}, {1.65, 5.6}, {1.6, 6.4}};
    const std::vector<Eigen::Vector2d> second = {{1.8, 1.2}, {3.2, 1.1}, {4.6, 1.1}, {5.6, 1.6},
                                                 {5.9, 3.0}, {5.6, 4.4}, {4.6, 4.9}, {3.2, 4.9},
                                                 {2.0, 4.7}, {1.4, 3.8}, {1.3, 2.4}, {1.5, 1.0}};
    for (const Eigen::Vector2d& point : second) loop.points.push_back(point + shift);
    loop.points.push_back({1.55, 5.6});
    loop.points.push_back({1.5, 4.6});
    // Corners are cut twice (Chaikin), which keeps the line within its polygon.
    for (int round = 0; round < 3; ++round) {
      std::vector<Eigen::Vector2d> finer;
      for (size_t i = 0; i + 1 < loop.points.size(); ++i) {
        finer.push_back(0.75 * loop.points[i] + 0.25 * loop.points[i + 1]);
        finer.push_back(0.25 * loop.points[i] + 0.75 * loop.points[i + 1]);
      }
      finer.push_back(finer.front());
      loop.points = std::move(finer);
    }
  } else {
    const Eigen::Vector2d low = scene.rooms[0].min().cast<double>(),
                          high = scene.rooms[0].max().cast<double>();
    const Eigen::Vector2d first = low + Eigen::Vector2d(1.6, 1.15), last = high - Eigen::Vector2d(1.3, 1.15);
    AppendRoundedRectangle(first, last, std::min(1.1, 0.45 * (last - first).minCoeff()), loop.points);
  }
  double arc = 0;
  for (size_t i = 0; i < loop.points.size(); ++i) {
    if (i > 0) arc += std::max(1e-9, (loop.points[i] - loop.points[i - 1]).norm());
    loop.arc_m.push_back(arc);
  }
  return loop;
}

CameraPath::CameraPath(const Scene& scene, const CameraPathOptions& options) : options_(options) {
  const bool corridor = scene.kind == SceneKind::kCorridor, forward = options.kind == PathKind::kForward;
  if (!forward && corridor != (options.kind == PathKind::kRing)) {
    throw InputError(
        "--path: the ring belongs to --scene corridor, forward to all scenes, all other paths to a room; "
        "change one of them");
  }
  in_ring_ = corridor;
  const Eigen::Vector2f home = scene.rooms.front().min() + scene.home;
  home_ = {home.x(), home.y(), kEyeHeight};
  if (corridor || forward || options.kind == PathKind::kTour) {
    loop_ = MakeLoop(scene);
    if (options_.speed_mps <= 0) options_.speed_mps = corridor ? 0.9 : 0.55;
    period_s_ = loop_.arc_m.back() / options_.speed_mps;
  }
  Random random(DeriveSeed(options.seed, 0, "path"));
  phase_ = random.Uniform();
  for (uint64_t i = 0; i < 12; ++i) {
    // Six slow ones (wandering), six quick ones (tremor).
    const bool slow = i < 6;
    noises_.emplace_back(DeriveSeed(options.seed, i, "tremor"), slow ? 0.25 : 1.2, slow ? 1.0 : 7.0);
  }
}

double CameraPath::PathTime(double time_s) const {
  if (options_.static_start_s <= 0) return time_s;
  const double moving_s = std::max(0.0, time_s - options_.static_start_s);
  return moving_s < 1.0 ? 0.5 * moving_s * moving_s : moving_s - 0.5;
}

CameraPath::View CameraPath::AlongLoop(double path_time_s) const {
  const bool ring = in_ring_, forward = options_.kind == PathKind::kForward;
  const double start = ring ? 0.0 : phase_ * loop_.arc_m.back();
  const double s = start + options_.speed_mps * path_time_s;
  const Eigen::Vector2d position = loop_.At(s);
  const double steps_rad_s = 2.0 * kPi * 0.9;
  View view;
  view.position = {position.x(), position.y(),
                   kEyeHeight + 0.06 * std::sin(0.5 * s) + 0.012 * std::sin(2.0 * steps_rad_s * path_time_s)};
  // Heading over a longer stretch turns the camera before the corner, as people do.
  const double h0 = loop_.Heading(s - 0.4), h1 = loop_.Heading(s + 0.4), h2 = loop_.Heading(s + 1.0);
  const double heading = h1 + 0.3 * (WrapAngle(h0 - h1) + WrapAngle(h2 - h1));
  // Loops run against the clock: outwards is to the right. The sway does not fit the loop's length, so that
  // rounds differ a little in where one looks.
  const double outwards = forward ? 0 : ring ? 28 : 42;
  const double sway = (forward ? 5.0 : ring ? 9.0 : 12.0) * std::sin(0.31 * s + 6.28 * phase_);
  view.yaw_rad = heading - (outwards + sway) * kDegree;
  view.pitch_rad = ((ring ? -5.0 : -9.0) + 4.0 * std::sin(0.23 * s)) * kDegree;
  view.roll_rad = 1.2 * kDegree * std::sin(steps_rad_s * path_time_s);
  return view;
}

CameraPath::View CameraPath::ViewAt(double path_time_s) const {
  if (!loop_.points.empty()) return AlongLoop(path_time_s);
  View view;
  view.position = home_;
  view.pitch_rad = -7.0 * kDegree;
  switch (options_.kind) {
    case PathKind::kXyz:
      ShiftAlongAxes(path_time_s, &view);
      break;
    case PathKind::kRpy:
      SwingAboutAxes(path_time_s, &view);
      break;
    case PathKind::kHalfsphere:
      GoOverHalfsphere(path_time_s, &view);
      break;
    case PathKind::kTurn:
      TurnAboutBody(path_time_s, &view);
      break;
    default:
      break;
  }
  return view;
}

/// In the period in which one axis after the other has its turn.
double CameraPath::PhaseAt(double t) const { return t / period_s_ - std::floor(t / period_s_); }

void CameraPath::ShiftAlongAxes(double t, View* view) const {
  for (int k = 0; k < 3; ++k)
    view->position[k] += (k == 2 ? 0.20 : 0.27) * Share(PhaseAt(t), k) * std::sin(2.0 * kPi * t / 4.0);
}

void CameraPath::SwingAboutAxes(double t, View* view) const {
  const double swing = 17.0 * kDegree * std::sin(2.0 * kPi * t / 4.0);
  view->roll_rad += Share(PhaseAt(t), 0) * swing;
  view->pitch_rad += 0.75 * Share(PhaseAt(t), 1) * swing;
  view->yaw_rad += 1.2 * Share(PhaseAt(t), 2) * swing;
  // Wrists turn, arms follow: a camera that is turned by hand is never turned about its centre.
  view->position.y() += 0.10 * (view->yaw_rad + 0.5 * view->roll_rad) + 0.05 * std::sin(0.9 * t);
  view->position.z() += 0.12 * (view->pitch_rad + 7.0 * kDegree) + 0.02 * std::sin(1.3 * t + 1);
  view->position.x() += 0.04 * std::sin(0.7 * t + 2);
}

void CameraPath::GoOverHalfsphere(double t, View* view) {
  constexpr double kRadius = 0.5;
  const double azimuth = 70.0 * kDegree * std::sin(2.0 * kPi * t / 9.0);
  const double elevation = (25.0 - 30.0 * std::cos(2.0 * kPi * t / 6.3)) * kDegree;
  view->position +=
      kRadius * Eigen::Vector3d(-std::cos(azimuth) * std::cos(elevation) + 0.5,
                                -std::sin(azimuth) * std::cos(elevation), std::sin(elevation) - 0.2);
  view->yaw_rad = 0.42 * azimuth;
  view->pitch_rad = -0.35 * elevation;
}

void CameraPath::TurnAboutBody(double t, View* view) {
  constexpr double kReach = 0.35;  // From the body's axis to the camera.
  view->yaw_rad = 100.0 * kDegree * std::sin(2.0 * kPi * t / 20.0);
  view->pitch_rad += 5.0 * kDegree * std::sin(0.8 * t);
  view->position +=
      Eigen::Vector3d(kReach * (std::cos(view->yaw_rad) - 1.0),
                      kReach * std::sin(view->yaw_rad) + 0.05 * std::sin(1.1 * t), 0.03 * std::sin(1.7 * t));
}

Rigid3d CameraPath::ToPose(const View& view) {
  const double cy = std::cos(view.yaw_rad), sy = std::sin(view.yaw_rad);
  const double cp = std::cos(view.pitch_rad), sp = std::sin(view.pitch_rad);
  Eigen::Matrix3d R_world_cam;
  const Eigen::Vector3d forward(cy * cp, sy * cp, sp), right(sy, -cy, 0);
  R_world_cam.col(0) = right;
  R_world_cam.col(1) = forward.cross(right);
  R_world_cam.col(2) = forward;
  const Eigen::Quaterniond roll(Eigen::AngleAxisd(view.roll_rad, Eigen::Vector3d::UnitZ()));
  return {(Eigen::Quaterniond(R_world_cam) * roll).normalized(), view.position};
}

Rigid3d CameraPath::Nominal(double time_s) const { return ToPose(ViewAt(PathTime(time_s))); }

Rigid3d CameraPath::T_world_cam(double time_s) const {
  const double t = PathTime(time_s);
  Rigid3d pose = ToPose(ViewAt(t));
  Eigen::Vector3d shift, turn;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<size_t>(k);
    shift[k] = 0.010 * noises_[i].At(t) + 0.0008 * noises_[i + 6].At(t);
    turn[k] = kDegree * (0.55 * noises_[i + 3].At(t) + 0.07 * noises_[i + 9].At(t));
  }
  pose.translation += options_.tremor * shift;
  pose.rotation = (pose.rotation * ExpSo3(options_.tremor * turn)).normalized();
  return pose;
}

}  // namespace dmslam
