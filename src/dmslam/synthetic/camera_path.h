#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/synthetic/scene.h"

namespace dmslam {

enum class PathKind {
  kStatic,      ///< Held still by hand.
  kXyz,         ///< Moves along its axes in turn, looks the same way.
  kRpy,         ///< Rolls, pitches and yaws in turn, stays where it is.
  kHalfsphere,  ///< On a half sphere of one metre diameter.
  kTour,  ///< Around the room (kAliased: around both, through the door), looking outwards, again and again.
  kRing,  ///< Along the ring of corridors, again and again.
  kForward,  ///< As kTour, or in a corridor as kRing, but looks where it goes.
  kTurn,  ///< Turns to and fro by 200 degrees where it stands, as a person does: the eye is before the body.
};

/// "static", "xyz", "rpy", "halfsphere", "tour", "ring", "forward" or "turn"; throws InputError for another
/// name.
PathKind ParsePathKind(const std::string& name);

struct CameraPathOptions {
  PathKind kind = PathKind::kXyz;
  uint64_t seed = 1;
  double static_start_s = 0;  ///< The camera stands on something for so long, then is taken up.
  double speed_mps =
      0;  ///< Walking speed of kTour, kRing, kForward; 0 is 0.55 m/s in rooms and 0.9 m/s in rings.
  double tremor = 1.0;  ///< How much the hand shakes; 0 is a perfect rig, 1 an ordinary hand.
};

/// Sum of sinusoids of random phase between two frequencies, the slower the stronger: smooth, bounded, of
/// unit variance.
class SmoothNoise {
 public:
  SmoothNoise(uint64_t seed, double low_hz, double high_hz);
  double At(double time_s) const;

 private:
  static constexpr int kTerms = 7;
  double frequency_rad_s_[kTerms], phase_rad_[kTerms], amplitude_[kTerms];
};

/// A hand-held camera's motion: smooth, known at every instant, the same for the same seed.
class CameraPath {
 public:
  /// Throws InputError when the path does not fit the scene (a ring needs the corridor, the others a room).
  CameraPath(const Scene& scene, const CameraPathOptions& options);

  /// The camera's pose (x right, y down, z forward) in the scene's world.
  Rigid3d T_world_cam(double time_s) const;
  /// The same without the hand's tremor, for who must be in view.
  Rigid3d Nominal(double time_s) const;
  /// How long one round takes (tour, ring), or one pass of the pattern.
  double period_s() const { return period_s_; }

 private:
  struct View {
    Eigen::Vector3d position;
    double yaw_rad = 0, pitch_rad = 0, roll_rad = 0;  ///< Yaw from +x to +y; pitch up; roll clockwise.
  };
  /// A closed line on the floor, by arc length.
  struct Loop {
    std::vector<Eigen::Vector2d> points;
    std::vector<double> arc_m;
    Eigen::Vector2d At(double s) const;
    double Heading(double s) const;
  };
  View ViewAt(double path_time_s) const;
  View AlongLoop(double path_time_s) const;
  double PhaseAt(double t) const;
  void ShiftAlongAxes(double t, View* view) const;
  void SwingAboutAxes(double t, View* view) const;
  static void GoOverHalfsphere(double t, View* view);
  static void TurnAboutBody(double t, View* view);
  double PathTime(double time_s) const;
  static Loop MakeLoop(const Scene& scene);
  static Rigid3d ToPose(const View& view);

  CameraPathOptions options_;
  bool in_ring_ = false;  ///< It goes along the ring of corridors.
  Eigen::Vector3d home_;
  Loop loop_;
  double period_s_ = 12;
  double phase_ = 0;
  std::vector<SmoothNoise> noises_;
};

}  // namespace dmslam
