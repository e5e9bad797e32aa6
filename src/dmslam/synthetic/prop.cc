#include "dmslam/synthetic/prop.h"

#include <algorithm>
#include <cmath>

#include "dmslam/synthetic/angles.h"
#include "dmslam/synthetic/paint.h"
#include "dmslam/synthetic/scene_builder.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

using Eigen::Affine3f;
using Eigen::AngleAxisf;
using Eigen::Translation3f;
using Eigen::Vector2f;
using Eigen::Vector3f;

int TextureSize(int full, int halvings) { return std::max(32, full >> halvings); }

/// Light from above on both sides: what moves about is lit alike wherever it is.
SceneBuilder LitBuilder(uint64_t seed) { return {seed, {{-1.5f, -1.5f, 2.5f}, {1.5f, 1.5f, 2.5f}}}; }

Mesh TakeOne(SceneBuilder& builder) { return std::move(builder.TakeMeshes().front()); }

Mesh Placed(Mesh mesh, const Affine3f& world_from_mesh) {
  for (Vertex& vertex : mesh.vertices) vertex.position = world_from_mesh * vertex.position;
  mesh.UpdateBounds();
  return mesh;
}

/// Where a screen stands, and where it looks to.
struct Stand {
  Vector2f foot, facing;
};

Stand StandIn(const Scene& scene) {
  constexpr float kFromWall = 0.55f;
  if (scene.kind == SceneKind::kCorridor)
    return {{0.5f * scene.ring_size_m.x() + 2.6f, kFromWall - kCorridorHalfWidthM}, {0, 1}};
  const Eigen::AlignedBox2f& room = scene.rooms.front();
  return {{room.max().x() - kFromWall, room.min().y() + 0.32f * room.sizes().y()}, {-1, 0}};
}

double SmoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

}  // namespace

CarriedBox::CarriedBox(uint64_t seed, int texture_halvings, TextureList& textures) {
  Random random(DeriveSeed(seed, 0, "carried box"));
  const int size = TextureSize(256, texture_halvings);
  const Skin front{Add(textures, PaintPackage(size, size, random)), 0},
      sides{Add(textures, PaintPackage(size, size, random)), 0};
  SceneBuilder builder = LitBuilder(seed);
  const Vector3f half(static_cast<float>(random.Uniform(0.19, 0.27)),
                      static_cast<float>(random.Uniform(0.14, 0.19)),
                      static_cast<float>(random.Uniform(0.13, 0.2)));
  builder.AddBox(Affine3f::Identity(), -half, half, front, sides);
  box_ = TakeOne(builder);
}

PropState CarriedBox::At(double, std::span<const Person> people) const {
  DMSLAM_CHECK(!people.empty(), "somebody carries the box");
  const Person& carrier = people.front();
  return {Placed(box_, CarriedFrame(carrier.look, carrier.state)), carrier.state.moving};
}

namespace {

/// Carts go their own ways, not a person's.
constexpr int kCartIndex = 1000;

ActorOptions CartOptions(ActorOptions actor) {
  actor.behaviour = Behaviour::kStopAndGo;
  return actor;
}

}  // namespace

Cart::Cart(const Scene& scene, const CameraPath& path, const ActorOptions& actor, double duration_s,
           int texture_halvings, TextureList& textures)
    : ways_(scene, path, CartOptions(actor), kCartIndex, duration_s) {
  Random random(DeriveSeed(actor.seed, 0, "cart"));
  const int size = TextureSize(256, texture_halvings);
  const Skin metal{Add(textures, PaintPlaster(size, Rgb(90, 110, 140), random)), 0.8f};
  SceneBuilder builder = LitBuilder(actor.seed);
  const Affine3f frame = Affine3f::Identity();
  builder.AddBox(frame, {-0.3f, -0.4f, 0.12f}, {0.3f, 0.4f, 0.18f}, metal, metal);
  for (const float x : {-0.3f, 0.27f}) {
    for (const float y : {-0.4f, 0.37f})
      builder.AddBox(frame, {x, y, 0}, {x + 0.03f, y + 0.03f, 1.35f}, metal, metal);
  }
  for (float z = 0.18f; z < 1.2f;) {
    const auto height = static_cast<float>(random.Uniform(0.18, 0.4));
    const Skin parcel{Add(textures, PaintPackage(size, size, random)), 0};
    const auto shift = static_cast<float>(random.Uniform(-0.05, 0.05));
    builder.AddBox(frame, {-0.24f, -0.33f + shift, z}, {0.24f, 0.33f + shift, z + height}, parcel, parcel);
    z += height;
  }
  cart_ = TakeOne(builder);
}

PropState Cart::At(double time_s, std::span<const Person>) const {
  const ActorState state = ways_.At(time_s);
  const Affine3f world_from_cart =
      Translation3f(On(state.position.cast<float>(), 0)) *
      AngleAxisf(static_cast<float>(state.heading_rad) - 0.5f * kPiF, Vector3f::UnitZ());
  return {Placed(cart_, world_from_cart), state.moving};
}

SwingingDoor::SwingingDoor(const Doorway& doorway, uint64_t seed, double duration_s, int texture_halvings,
                           TextureList& textures)
    : doorway_(doorway) {
  Random random(DeriveSeed(seed, 0, "door"));
  bool opens = true;
  for (double time_s = random.Uniform(1.0, 3.0); time_s < duration_s; opens = !opens) {
    swings_.push_back({time_s, time_s + random.Uniform(1.2, 2.0), opens});
    time_s = swings_.back().end_s + random.Uniform(1.5, 4.0);
  }
  const Skin front{Add(textures, PaintDoor(TextureSize(256, texture_halvings),
                                           TextureSize(512, texture_halvings), random)),
                   0};
  SceneBuilder builder = LitBuilder(seed);
  builder.AddBox(Affine3f::Identity(), {0.01f, -0.02f, 0.01f},
                 {doorway.width_m - 0.01f, 0.02f, doorway.height_m - 0.01f}, front, front);
  leaf_ = TakeOne(builder);
}

double SwingingDoor::AngleRad(double time_s) const {
  constexpr double kOpenRad = 80.0 * std::numbers::pi / 180.0;
  double angle = 0;
  for (const Swing& swing : swings_) {
    if (time_s < swing.begin_s) break;
    const double share = SmoothStep((time_s - swing.begin_s) / (swing.end_s - swing.begin_s));
    angle = kOpenRad * (swing.opens ? share : 1.0 - share);
  }
  return angle;
}

PropState SwingingDoor::At(double time_s, std::span<const Person>) const {
  const auto angle = static_cast<float>(AngleRad(time_s));
  const Vector2f leaf = std::cos(angle) * doorway_.along + std::sin(angle) * doorway_.inward;
  Affine3f world_from_leaf = Affine3f::Identity();
  world_from_leaf.linear() << On(leaf, 0), On({-leaf.y(), leaf.x()}, 0), Vector3f::UnitZ();
  world_from_leaf.translation() = On(doorway_.hinge, 0);
  const bool moving = std::any_of(swings_.begin(), swings_.end(), [&](const Swing& swing) {
    return time_s > swing.begin_s && time_s < swing.end_s;
  });
  return {Placed(leaf_, world_from_leaf), moving};
}

PlayingScreen::PlayingScreen(const Scene& scene, uint64_t seed, double duration_s, int texture_halvings,
                             TextureList& textures) {
  Random random(DeriveSeed(seed, 0, "video"));
  std::vector<uint32_t> pictures;
  const int size = TextureSize(512, texture_halvings);
  for (int i = 0; i < 8; ++i) pictures.push_back(Add(textures, PaintPoster(size, size, random)));
  for (double time_s = 0; time_s < duration_s + 1.0; time_s += random.Uniform(1.5, 4.0)) {
    const auto draw = [&](double low, double high) { return static_cast<float>(random.Uniform(low, high)); };
    shots_.push_back({time_s,
                      pictures[random.Below(8)],
                      {draw(0, 1), draw(0, 1)},
                      {draw(-0.12, 0.12), draw(-0.05, 0.05)}});
  }
  const Skin housing{Add(textures, PaintPlaster(TextureSize(128, texture_halvings), Rgb(40, 40, 44), random)),
                     0.8f};
  const Stand stand = StandIn(scene);
  Affine3f frame = Affine3f::Identity();  // x to the right of who looks at it, y away from him, z up
  frame.linear() << On({-stand.facing.y(), stand.facing.x()}, 0), On(-stand.facing, 0), Vector3f::UnitZ();
  frame.translation() = On(stand.foot, 0);
  SceneBuilder builder = LitBuilder(seed);
  builder.AddQuad(frame * Vector3f(-0.7f, -0.001f, 1.75f), frame.linear() * Vector3f(1.4f, 0, 0),
                  Vector3f(0, 0, -0.8f), {pictures.front(), 0}, 2.0f);
  builder.AddBox(frame, {-0.74f, 0.0f, 0.91f}, {0.74f, 0.06f, 1.79f}, housing, housing);
  builder.AddBox(frame, {-0.04f, 0.01f, 0.0f}, {0.04f, 0.05f, 0.91f}, housing, housing);
  builder.AddBox(frame, {-0.35f, -0.1f, 0.0f}, {0.35f, 0.2f, 0.03f}, housing, housing);
  screen_ = TakeOne(builder);
  for (size_t i = 0; i < kPlayingVertices; ++i) screen_.vertices[i].light = 1.15f;  // It shines by itself.
}

PropState PlayingScreen::At(double time_s, std::span<const Person>) const {
  const auto after =
      std::find_if(shots_.begin() + 1, shots_.end(), [&](const Shot& shot) { return shot.begin_s > time_s; });
  const Shot& shot = *(after - 1);
  const Vector2f shift = shot.from + static_cast<float>(time_s - shot.begin_s) * shot.per_second;
  PropState state{screen_, true};
  for (size_t i = 0; i < kPlayingVertices; ++i) {
    // Most of the picture is seen at a time.
    state.mesh.vertices[i].u = 0.8f * screen_.vertices[i].u + shift.x();
    state.mesh.vertices[i].v = 0.45f * screen_.vertices[i].v + shift.y();
  }
  for (size_t i = 0; i < kPlayingTriangles; ++i) state.mesh.triangles[i].texture = shot.picture;
  return state;
}

std::vector<std::unique_ptr<const Prop>> MakeProps(const PropOptions& options, const Scene& scene,
                                                   const CameraPath& path, const ActorOptions& actor,
                                                   double duration_s, int texture_halvings,
                                                   TextureList& textures) {
  std::vector<std::unique_ptr<const Prop>> props;
  if (options.carried_box)
    props.push_back(std::make_unique<CarriedBox>(options.seed, texture_halvings, textures));
  if (options.cart)
    props.push_back(std::make_unique<Cart>(scene, path, actor, duration_s, texture_halvings, textures));
  if (options.door) {
    if (scene.doorways.empty()) throw InputError("--door: the scene has no doorway");
    props.push_back(std::make_unique<SwingingDoor>(scene.doorways.front(), options.seed, duration_s,
                                                   texture_halvings, textures));
  }
  if (options.screen)
    props.push_back(
        std::make_unique<PlayingScreen>(scene, options.seed, duration_s, texture_halvings, textures));
  return props;
}

}  // namespace dmslam
