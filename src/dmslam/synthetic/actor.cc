#include "dmslam/synthetic/actor.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "dmslam/synthetic/angles.h"
#include "dmslam/synthetic/paint.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3f;

constexpr double kStepS = 0.01;
constexpr double kWalkSpeed = 1.15;
constexpr double kStrideM = 1.35;  ///< Length of two steps.

/// Walks, stops, sits down and gets up, step by step.
class Simulation {
 public:
  Simulation(const Scene& scene, const CameraPath& path, const ActorOptions& options, int index)
      : scene_(scene),
        path_(path),
        options_(options),
        random_(DeriveSeed(options.seed, static_cast<uint64_t>(index), "actor")) {
    side_ = index % 2 == 0 ? 1.0 : -1.0;
    if (options.behaviour == Behaviour::kSit && !scene.seats.empty()) {
      seat_ = scene.seats[static_cast<size_t>(index) % scene.seats.size()];
    }
    state_.position = PlaceInView(0, random_.Uniform(-0.6, 0.6));
    state_.heading_rad = random_.Uniform(-kPi, kPi);
    phase_end_s_ = options.stand_first_s;
    if (options.stand_first_s <= 0) StartWalking(0);
  }

  ActorState Step(double now_s) {
    if (now_s >= phase_end_s_) NextPhase(now_s);
    const ActorState before = state_;
    switch (phase_) {
      case Phase::kWalk:
        Walk(now_s);
        break;
      case Phase::kSitDown:
        TurnTo(seat_->heading_rad, 3.0);
        state_.sitting = std::min(1.0, state_.sitting + kStepS / 1.2);
        Settle();
        break;
      case Phase::kGetUp:
        state_.sitting = std::max(0.0, state_.sitting - kStepS / 1.1);
        break;
      case Phase::kStand:
      case Phase::kSit:
        Settle();
        break;
    }
    state_.moving = (state_.position - before.position).norm() > 1e-5 || state_.stride != before.stride ||
                    state_.sitting != before.sitting || state_.heading_rad != before.heading_rad ||
                    state_.gait_rad != before.gait_rad;
    return state_;
  }

 private:
  enum class Phase { kWalk, kStand, kSitDown, kSit, kGetUp };

  /// A place before the camera, `lateral` in -1..1 from the image's left to its right border.
  Vector2d PlaceInView(double time_s, double lateral) {
    const Rigid3d T_world_cam = path_.Nominal(time_s);
    const Eigen::Vector3d forward = T_world_cam.rotation * Eigen::Vector3d::UnitZ();
    const Vector2d ahead = Vector2d(forward.x(), forward.y()).normalized(), right(ahead.y(), -ahead.x());
    const double distance = random_.Uniform(options_.near_m, options_.far_m);
    const Vector2d camera = T_world_cam.translation.head<2>();
    return KeepClear(camera + distance * (ahead + 0.6 * lateral * right), camera);
  }

  /// Out of walls, desks and the camera itself.
  Vector2d KeepClear(Vector2d place, const Vector2d& camera) const {
    for (const Obstacle& obstacle : scene_.obstacles) {
      const Vector2d away = place - obstacle.center.cast<double>();
      if (away.norm() < obstacle.radius_m)
        place += (obstacle.radius_m / std::max(away.norm(), 1e-3) - 1.0) * away;
    }
    if (scene_.kind == SceneKind::kCorridor) place = IntoCorridor(place);
    for (const Eigen::AlignedBox2f& room : scene_.rooms) {
      if (!room.contains(camera.cast<float>())) continue;
      place = place.cwiseMax(room.min().cast<double>() + Vector2d::Constant(0.4))
                  .cwiseMin(room.max().cast<double>() - Vector2d::Constant(0.4));
    }
    const Vector2d away = place - camera;
    if (away.norm() < 0.7) place += (0.7 / std::max(away.norm(), 1e-3) - 1.0) * away;
    return place;
  }

  /// Out of the inner block of the ring.
  Vector2d IntoCorridor(Vector2d place) const {
    const double reach = kCorridorHalfWidthM - 0.45;
    const Vector2d low = Vector2d::Constant(reach), high = scene_.ring_size_m.cast<double>() - low;
    if ((place.array() <= low.array()).any() || (place.array() >= high.array()).any()) return place;
    const double gaps[4] = {place.x() - low.x(), high.x() - place.x(), place.y() - low.y(),
                            high.y() - place.y()};
    const auto nearest = std::min_element(gaps, gaps + 4) - gaps;
    if (nearest == 0) place.x() = low.x();
    if (nearest == 1) place.x() = high.x();
    if (nearest == 2) place.y() = low.y();
    if (nearest == 3) place.y() = high.y();
    return place;
  }

  void ChooseTarget(double now_s) {
    if (going_to_seat_) {
      target_ = seat_->position.cast<double>();
      return;
    }
    side_ = -side_;
    target_ = PlaceInView(now_s + 1.0, side_ * random_.Uniform(0.35, 0.95));
  }

  void StartWalking(double now_s) {
    phase_ = Phase::kWalk;
    phase_end_s_ = options_.behaviour == Behaviour::kWalk ? 1e9 : now_s + random_.Uniform(2.0, 4.0);
    ChooseTarget(now_s);
  }

  void NextPhase(double now_s) {
    switch (phase_) {
      case Phase::kWalk:
        if (seat_ && !going_to_seat_) {
          going_to_seat_ = true;
          phase_end_s_ = now_s + 6.0;
          ChooseTarget(now_s);
        } else if (!seat_) {
          phase_ = Phase::kStand;
          phase_end_s_ = now_s + random_.Uniform(1.5, 3.0) + 0.5;  // Half a second goes by in coming to rest.
        } else {
          going_to_seat_ = false;  // The chair was not reached in time: walk on.
          StartWalking(now_s);
        }
        break;
      case Phase::kSitDown:
        phase_ = Phase::kSit;
        phase_end_s_ = now_s + random_.Uniform(3.0, 6.0);
        break;
      case Phase::kSit:
        phase_ = Phase::kGetUp;
        phase_end_s_ = now_s + 1.2;
        break;
      case Phase::kStand:
      case Phase::kGetUp:
        going_to_seat_ = false;
        StartWalking(now_s);
        break;
    }
  }

  void TurnTo(double heading_rad, double rate_rad_s) {
    const double error = WrapAngle(heading_rad - state_.heading_rad), most = rate_rad_s * kStepS;
    if (std::abs(error) > 1e-9) state_.heading_rad += std::clamp(error, -most, most);
  }

  void SetSpeed(double wanted) {
    speed_ += std::clamp(wanted - speed_, -2.6 * kStepS, 1.8 * kStepS);
    if (speed_ < 1e-9) speed_ = 0;
    state_.stride = std::min(1.0, speed_ / kWalkSpeed);
    state_.gait_rad += 2.0 * kPi * speed_ * kStepS / kStrideM;
  }

  /// Comes to rest within half a second.
  void Settle() {
    SetSpeed(0);
    if (speed_ > 0) Advance();
  }

  void Advance() {
    state_.position += speed_ * kStepS * Vector2d(std::cos(state_.heading_rad), std::sin(state_.heading_rad));
  }

  void Walk(double now_s) {
    const Vector2d to_target = target_ - state_.position;
    const double distance = to_target.norm(), heading = std::atan2(to_target.y(), to_target.x());
    if (going_to_seat_ && distance < 0.12) {
      phase_ = Phase::kSitDown;
      phase_end_s_ = now_s + 1.4;
      return;
    }
    if (!going_to_seat_ && distance < 0.25) ChooseTarget(now_s);
    TurnTo(heading, 4.0);
    const double off = std::abs(WrapAngle(heading - state_.heading_rad));
    const double slow = going_to_seat_ ? std::clamp(distance / 0.6, 0.25, 1.0) : 1.0;
    SetSpeed(kWalkSpeed * slow * std::clamp(1.4 - off, 0.25, 1.0));
    Advance();
    if (going_to_seat_) return;
    const Vector2d push =
        KeepClear(state_.position, path_.Nominal(now_s).translation.head<2>()) - state_.position;
    constexpr double kMostPushMps = 1.0;
    state_.position += std::min(1.0, kMostPushMps * kStepS / std::max(push.norm(), 1e-9)) * push;
  }

  const Scene& scene_;
  const CameraPath& path_;
  ActorOptions options_;
  Random random_;
  ActorState state_;
  Phase phase_ = Phase::kStand;
  double phase_end_s_ = 0;
  double speed_ = 0;
  double side_ = 1;
  Vector2d target_{0, 0};
  std::optional<Seat> seat_;
  bool going_to_seat_ = false;
};

/// Light on a body: brighter from above and from one side.
float BodyLight(const Vector3f& normal) {
  return 0.78f + 0.18f * normal.z() + 0.10f * normal.x() - 0.08f * normal.y();
}

/// Builds limbs: tubes with round ends.
class BodyBuilder {
 public:
  /// From `a` to `b`, with radii; `front` gives the direction that shows the middle of the texture;
  /// `flatness` < 1 makes the tube thinner from front to back.
  void AddTube(const Vector3f& a, const Vector3f& b, float radius_a, float radius_b, const Vector3f& front,
               float flatness, uint32_t texture, float repeat_m) {
    const Vector3f axis = (b - a).normalized();
    const Vector3f ahead = (front - front.dot(axis) * axis).normalized(), side = axis.cross(ahead);
    const float length = (b - a).norm();
    const auto first = static_cast<uint32_t>(mesh_.vertices.size());
    for (int ring = 0; ring < kRings; ++ring) {
      const auto [along, radius, slope] = Profile(ring, length, radius_a, radius_b);
      for (int i = 0; i <= kSegments; ++i) {
        const float angle = 2.0f * static_cast<float>(kPi) * (static_cast<float>(i) / kSegments - 0.5f);
        const Vector3f out = std::cos(angle) * flatness * ahead + std::sin(angle) * side;
        Vertex vertex;
        vertex.position = a + along * axis + radius * out;
        vertex.u = repeat_m > 0 ? static_cast<float>(i) / kSegments *
                                      std::max(1.0f, std::round(6.28f * radius_a / repeat_m))
                                : static_cast<float>(i) / kSegments;
        const float total = length + radius_a + radius_b;
        vertex.v = (along + radius_a) / (repeat_m > 0 ? repeat_m : total);
        vertex.light = BodyLight((out.normalized() + slope * axis).normalized());
        mesh_.vertices.push_back(vertex);
      }
    }
    AddTubeTriangles(first, texture);
  }
  void AddBall(const Vector3f& center, float radius, float height, const Vector3f& front, uint32_t texture) {
    const float half = std::max(0.5f * height - radius, 0.005f);
    AddTube(center + half * Vector3f::UnitZ(), center - half * Vector3f::UnitZ(), radius, radius, front, 1.1f,
            texture, 0);
  }
  Mesh Take(int actor) {
    mesh_.actor = actor;
    mesh_.UpdateBounds();
    return std::move(mesh_);
  }

 private:
  static constexpr int kRings = 12, kSegments = 14, kCapRings = 4;

  struct RingProfile {
    float along, radius, slope;
  };
  /// Position along the axis, radius and slope of the normal of one ring: round cap, tube, round cap.
  static RingProfile Profile(int ring, float length, float radius_a, float radius_b) {
    if (ring < kCapRings) {
      const float angle = 0.5f * static_cast<float>(kPi) * static_cast<float>(ring) / kCapRings;
      return {-radius_a * std::cos(angle), std::max(radius_a * std::sin(angle), 1e-4f), -std::cos(angle)};
    }
    if (ring >= kRings - kCapRings) {
      const float angle = 0.5f * static_cast<float>(kPi) * static_cast<float>(kRings - 1 - ring) / kCapRings;
      return {length + radius_b * std::cos(angle), std::max(radius_b * std::sin(angle), 1e-4f),
              std::cos(angle)};
    }
    const float t = static_cast<float>(ring - kCapRings) / (kRings - 2 * kCapRings - 1);
    return {t * length, radius_a + t * (radius_b - radius_a), 0.0f};
  }
  void AddTubeTriangles(uint32_t first, uint32_t texture) {
    for (uint32_t ring = 0; ring + 1 < kRings; ++ring) {
      for (uint32_t i = 0; i < kSegments; ++i) {
        const uint32_t at = first + ring * (kSegments + 1) + i, below = at + kSegments + 1;
        mesh_.triangles.push_back({{at, at + 1, below}, texture});
        mesh_.triangles.push_back({{at + 1, below + 1, below}, texture});
      }
    }
  }

  Mesh mesh_;
};

/// A body's measures [m], directions and joints at one instant.
struct Skeleton {
  float h = 0, w = 0;  ///< Height; breadth, which is the height times the stoutness.
  float sit = 0, stride = 0, gait = 0;
  Vector3f ahead, left, up = Vector3f::UnitZ();
  Vector3f lean, hip, chest, neck, head;
  float thigh = 0, shin = 0;

  /// A direction in the body's plane of symmetry: straight down, turned by `angle` to the front.
  Vector3f Down(float angle) const { return std::sin(angle) * ahead - std::cos(angle) * up; }
  /// How far the leg of a side swings to the front [rad].
  float Swing(float side) const { return 0.5f * stride * std::sin(gait) * side; }
};

constexpr float kSeatedThighRad = 1.5f;

Skeleton Pose(const ActorLook& look, const ActorState& state) {
  Skeleton s;
  s.h = static_cast<float>(look.height_m);
  s.w = s.h * static_cast<float>(look.width);
  s.sit = static_cast<float>(state.sitting * state.sitting * (3.0 - 2.0 * state.sitting));
  s.stride = static_cast<float>(state.stride);
  s.gait = static_cast<float>(std::remainder(state.gait_rad, 2.0 * kPi));
  s.ahead = {static_cast<float>(std::cos(state.heading_rad)), static_cast<float>(std::sin(state.heading_rad)),
             0};
  s.left = {-s.ahead.y(), s.ahead.x(), 0};
  s.thigh = s.shin = 0.245f * s.h;
  const float bob = 0.015f * s.stride * std::cos(2.0f * s.gait);
  const float hip_height = s.thigh * std::cos(kSeatedThighRad * s.sit) + s.shin + 0.035f * s.h + bob;
  s.hip = {static_cast<float>(state.position.x()), static_cast<float>(state.position.y()), hip_height};
  s.lean = (s.up + (0.05f * s.stride + 0.06f * s.sit) * s.ahead).normalized();
  s.chest = s.hip + 0.285f * s.h * s.lean;
  s.neck = s.hip + 0.31f * s.h * s.lean;
  s.head = s.hip + 0.415f * s.h * s.lean;
  return s;
}

void AddTrunk(const ActorLook& look, const Skeleton& s, BodyBuilder& body) {
  const float h = s.h, w = s.w;
  body.AddTube(s.hip, s.hip + 0.06f * h * s.lean, 0.1f * w, 0.1f * w, s.ahead, 0.72f, look.trousers, 0.4f);
  body.AddTube(s.neck - 0.03f * h * s.lean, s.hip + 0.09f * h * s.lean, 0.098f * w, 0.1f * w, s.ahead, 0.7f,
               look.shirt, 0);
  body.AddTube(s.chest + 0.075f * w * s.left, s.chest - 0.075f * w * s.left, 0.045f * w, 0.045f * w, s.ahead,
               1.0f, look.shirt, 0.3f);
  body.AddTube(s.neck, s.head, 0.033f * h, 0.033f * h, s.ahead, 1.0f, look.skin, 0);
  body.AddBall(s.head + 0.035f * h * s.up, 0.047f * h, 0.135f * h, s.ahead, look.face);
  body.AddBall(s.head + 0.058f * h * s.up - 0.016f * h * s.ahead, 0.049f * h, 0.115f * h, s.ahead, look.hair);
}

void AddLeg(const ActorLook& look, const Skeleton& s, float side, BodyBuilder& body) {
  const float lift = s.stride * std::max(0.0f, std::cos(s.gait) * side);
  const float thigh_angle = (1 - s.sit) * (s.Swing(side) + 0.25f * lift) + s.sit * kSeatedThighRad;
  const float shin_angle =
      thigh_angle - (1 - s.sit) * (0.12f * s.stride + 0.9f * lift) - s.sit * kSeatedThighRad;
  const Vector3f joint = s.hip + 0.052f * s.w * side * s.left;
  const Vector3f knee = joint + s.thigh * s.Down(thigh_angle), ankle = knee + s.shin * s.Down(shin_angle);
  const Vector3f toes = ankle + 0.085f * s.h * s.ahead - 0.012f * s.h * s.up;
  body.AddTube(joint, knee, 0.053f * s.w, 0.036f * s.w, s.ahead, 1.0f, look.trousers, 0.35f);
  body.AddTube(knee, ankle, 0.035f * s.w, 0.025f * s.h, s.ahead, 1.0f, look.trousers, 0.35f);
  body.AddTube(ankle, toes, 0.026f * s.h, 0.022f * s.h, s.up, 1.0f, look.shoes, 0);
}

void AddArm(const ActorLook& look, const Skeleton& s, float side, bool carrying, BodyBuilder& body) {
  const float angle = carrying ? 0.3f : -0.75f * s.Swing(side) * (1 - s.sit) + 0.35f * s.sit;
  const float bend = carrying ? 1.25f : 0.25f + 0.25f * s.stride + 0.9f * s.sit;
  const Vector3f shoulder = s.neck - 0.025f * s.h * s.lean + 0.108f * s.w * side * s.left;
  const Vector3f elbow = shoulder + 0.165f * s.h * (s.Down(angle) + 0.12f * side * s.left).normalized();
  const Vector3f forearm = (s.Down(angle + bend) - 0.05f * side * s.left).normalized();
  const Vector3f wrist = elbow + 0.15f * s.h * forearm;
  body.AddTube(shoulder, elbow, 0.031f * s.w, 0.026f * s.h, s.ahead, 1.0f, look.shirt, 0.3f);
  body.AddTube(elbow, wrist, 0.025f * s.h, 0.018f * s.h, s.ahead, 1.0f, look.shirt, 0.3f);
  body.AddTube(wrist, wrist + 0.05f * s.h * forearm, 0.021f * s.h, 0.016f * s.h, s.ahead, 0.8f, look.skin, 0);
}

}  // namespace

Behaviour ParseBehaviour(const std::string& name) {
  if (name == "walk") return Behaviour::kWalk;
  if (name == "stop-and-go") return Behaviour::kStopAndGo;
  if (name == "sit") return Behaviour::kSit;
  throw InputError("--behaviour: '" + name + "' is not known; choose walk, stop-and-go or sit");
}

ActorTimeline::ActorTimeline(const Scene& scene, const CameraPath& path, const ActorOptions& options,
                             int index, double duration_s) {
  Simulation simulation(scene, path, options, index);
  const int steps = static_cast<int>(std::ceil(duration_s / kStepS)) + 20;
  samples_.reserve(static_cast<size_t>(steps));
  for (int i = 0; i < steps; ++i) samples_.push_back(simulation.Step(i * kStepS));
}

ActorState ActorTimeline::At(double time_s) const {
  const double at = std::clamp(time_s / kStepS, 0.0, static_cast<double>(samples_.size()) - 1.001);
  const auto i = static_cast<size_t>(at);
  const double t = at - static_cast<double>(i);
  const ActorState &a = samples_[i], &b = samples_[i + 1];
  ActorState state = a;
  state.position += t * (b.position - a.position);
  state.heading_rad += t * (b.heading_rad - a.heading_rad);
  state.gait_rad += t * (b.gait_rad - a.gait_rad);
  state.stride += t * (b.stride - a.stride);
  state.sitting += t * (b.sitting - a.sitting);
  state.moving = a.moving || b.moving;
  return state;
}

ActorLook DressActor(uint64_t seed, int index, int texture_halvings, TextureList& textures) {
  Random random(DeriveSeed(seed, static_cast<uint64_t>(index), "clothes"));
  const int size = std::max(32, 256 >> texture_halvings);
  const auto add = [&textures](const Canvas& canvas) {
    textures.push_back(std::make_shared<const Texture>(canvas));
    return static_cast<uint32_t>(textures.size() - 1);
  };
  ActorLook look;
  look.height_m = random.Uniform(1.62, 1.86);
  look.width = random.Uniform(0.92, 1.18);
  look.shirt = add(PaintCloth(size, random));
  look.trousers = add(PaintCarpet(size, 0.6f * RandomColor(random), random));
  look.skin = add(PaintSkin(size / 4, false, random));
  look.face = add(PaintSkin(size, true, random));
  look.hair = add(PaintHair(size / 4, random));
  look.shoes = add(PaintCarpet(size / 4, 0.4f * RandomColor(random), random));
  return look;
}

Eigen::Affine3f CarriedFrame(const ActorLook& look, const ActorState& state) {
  const Skeleton s = Pose(look, state);
  Eigen::Affine3f frame = Eigen::Affine3f::Identity();
  frame.linear() << -s.left, s.ahead, s.up;
  frame.translation() = s.hip + 0.14f * s.h * s.lean + 0.22f * s.h * s.ahead;
  return frame;
}

Mesh BuildActorMesh(const ActorLook& look, const ActorState& state, int index) {
  const Skeleton skeleton = Pose(look, state);
  BodyBuilder body;
  AddTrunk(look, skeleton, body);
  for (const float side : {1.0f, -1.0f}) {
    AddLeg(look, skeleton, side, body);
    AddArm(look, skeleton, side, state.carrying, body);
  }
  return body.Take(index);
}

}  // namespace dmslam
