#include "dmslam/synthetic/prop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dmslam/synthetic/world.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr double kDurationS = 30;

SceneOptions QuickScene(SceneKind kind) {
  SceneOptions options;
  options.kind = kind;
  options.texture_halvings = 4;
  options.doorway = kind != SceneKind::kAliased;
  return options;
}

/// A scene with a camera that moves a little, and room for more pictures.
struct Stage {
  explicit Stage(SceneKind kind = SceneKind::kRoom)
      : scene(BuildScene(QuickScene(kind))),
        path(scene, {.kind = kind == SceneKind::kCorridor ? PathKind::kRing : PathKind::kXyz}) {}
  Scene scene;
  CameraPath path;
};

Eigen::Vector3f Middle(const Mesh& mesh) { return mesh.bounds.center(); }

/// Where it is declared still, nothing of it moves; and no corner moves faster than `speed_mps`.
void ExpectContinuous(const Prop& prop, std::span<const Person> people, double speed_mps) {
  constexpr double kStepS = 0.005;
  PropState last = prop.At(0, people);
  for (double t = kStepS; t < kDurationS; t += kStepS) {
    const PropState state = prop.At(t, people);
    ASSERT_EQ(state.mesh.vertices.size(), last.mesh.vertices.size());
    float step = 0;
    for (size_t i = 0; i < state.mesh.vertices.size(); ++i)
      step = std::max(step, (state.mesh.vertices[i].position - last.mesh.vertices[i].position).norm());
    ASSERT_LT(step, speed_mps * kStepS) << t;
    if (!state.moving && !last.moving) {
      ASSERT_EQ(step, 0) << t;
    }
    last = state;
  }
}

TEST(CarriedBox, StaysBetweenTheHands) {
  TextureList textures;
  const CarriedBox box(1, 4, textures);
  Person carrier{DressActor(1, 0, 4, textures), {}};
  carrier.state = {.position = {2, 3}, .heading_rad = 0.5, .moving = true, .carrying = true};
  const PropState standing = box.At(0, std::span(&carrier, 1));
  EXPECT_TRUE(standing.moving);
  const Eigen::Vector2f away = Middle(standing.mesh).head<2>() - Eigen::Vector2f(2, 3);
  EXPECT_NEAR(std::atan2(away.y(), away.x()), 0.5, 0.02);  // ahead of him
  EXPECT_NEAR(away.norm(), 0.4, 0.1);
  EXPECT_NEAR(Middle(standing.mesh).z(), 0.65 * carrier.look.height_m, 0.1);
  carrier.state.sitting = 1;
  EXPECT_LT(Middle(box.At(0, std::span(&carrier, 1)).mesh).z(), Middle(standing.mesh).z() - 0.3);
  carrier.state.moving = false;
  EXPECT_FALSE(box.At(0, std::span(&carrier, 1)).moving);
}

TEST(CarriedBox, ArmsReachForIt) {
  TextureList textures;
  const ActorLook look = DressActor(1, 0, 4, textures);
  ActorState state;
  const Mesh free = BuildActorMesh(look, state, 0);
  state.carrying = true;
  const Mesh carrying = BuildActorMesh(look, state, 0);
  EXPECT_GT(carrying.bounds.max().x(), free.bounds.max().x() + 0.1);  // he looks to +x
}

TEST(Cart, RollsOnTheFloorWithinTheRoom) {
  for (const SceneKind kind : {SceneKind::kRoom, SceneKind::kCorridor}) {
    Stage stage(kind);
    const Cart cart(stage.scene, stage.path, {.seed = 3}, kDurationS, 4, stage.scene.textures);
    ExpectContinuous(cart, {}, 5.0);  // it may turn on the spot by 4 rad/s
    double travelled = 0;
    int still = 0;
    for (int i = 0; i < 10 * static_cast<int>(kDurationS); ++i) {
      const PropState now = cart.At(0.1 * i, {}), later = cart.At(0.1 * (i + 1), {});
      travelled += (Middle(later.mesh) - Middle(now.mesh)).norm();
      still += now.moving ? 0 : 1;
      EXPECT_NEAR(now.mesh.bounds.min().z(), 0, 1e-3);
      EXPECT_NEAR(now.mesh.bounds.max().z(), 1.4, 0.25);
    }
    EXPECT_GT(travelled, 3);
    EXPECT_GT(still, 30);
  }
}

TEST(SwingingDoor, OpensAndClosesInItsDoorway) {
  for (const SceneKind kind : {SceneKind::kRoom, SceneKind::kOffice, SceneKind::kCorridor}) {
    Stage stage(kind);
    ASSERT_EQ(stage.scene.doorways.size(), 1u);
    const Doorway& doorway = stage.scene.doorways.front();
    const SwingingDoor door(doorway, 2, kDurationS, 4, stage.scene.textures);
    ExpectContinuous(door, {}, 2.5);
    EXPECT_EQ(door.AngleRad(0), 0);
    double most = 0;
    int closed_again = 0;
    for (double t = 0; t < kDurationS; t += 0.05) {
      most = std::max(most, door.AngleRad(t));
      closed_again += most > 1 && door.AngleRad(t) == 0 ? 1 : 0;
    }
    EXPECT_NEAR(most, 80 * std::numbers::pi / 180, 1e-9);
    EXPECT_GT(closed_again, 10);
    // Closed, it fills the hole; open, it stands in the room.
    const Eigen::Vector2f hole = doorway.hinge + 0.5f * doorway.width_m * doorway.along;
    EXPECT_LT((Middle(door.At(0, {}).mesh).head<2>() - hole).norm(), 0.05);
    double opened = 0;
    while (door.AngleRad(opened) < most) opened += 0.01;
    EXPECT_GT((Middle(door.At(opened, {}).mesh).head<2>() - hole).dot(doorway.inward), 0.3);
  }
}

TEST(PlayingScreen, PlaysOnAScreenThatStands) {
  for (const SceneKind kind : {SceneKind::kRoom, SceneKind::kHall, SceneKind::kCorridor}) {
    Stage stage(kind);
    const PlayingScreen screen(stage.scene, 4, kDurationS, 4, stage.scene.textures);
    const PropState first = screen.At(0, {});
    EXPECT_TRUE(first.moving);
    EXPECT_TRUE(stage.scene.rooms.front().contains(Middle(first.mesh).head<2>().eval()));
    int pictures = 0;
    PropState last = first;
    for (double t = 0.1; t < kDurationS; t += 0.1) {
      const PropState now = screen.At(t, {});
      EXPECT_EQ(now.mesh.vertices[0].position, first.mesh.vertices[0].position);
      EXPECT_NE(now.mesh.vertices[0].u, last.mesh.vertices[0].u);
      EXPECT_EQ(now.mesh.vertices.back().u, first.mesh.vertices.back().u);  // its housing plays nothing
      EXPECT_EQ(now.mesh.triangles.back().texture, first.mesh.triangles.back().texture);
      pictures += now.mesh.triangles[0].texture != last.mesh.triangles[0].texture ? 1 : 0;
      last = now;
    }
    EXPECT_GE(pictures, 4);
  }
}

TEST(MakeProps, WhatIsAskedForIsThere) {
  WorldOptions options;
  options.scene = QuickScene(SceneKind::kRoom);
  options.actors = 2;
  const World none(options, SyntheticCamera());
  EXPECT_EQ(none.props(), 0);
  EXPECT_EQ(none.At(1).actors.size(), 2u);
  options.props = {.carried_box = true, .cart = true, .door = true, .screen = true};
  const World all(options, SyntheticCamera());
  EXPECT_EQ(all.props(), 4);
  const Instant instant = all.At(1);
  ASSERT_EQ(instant.actors.size(), 6u);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(instant.actors[static_cast<size_t>(i)].actor, i);
  EXPECT_EQ(instant.moving.size(), 6u);
}

TEST(MakeProps, WhatDoesNotFitIsRefused) {
  WorldOptions options;
  options.scene = QuickScene(SceneKind::kRoom);
  options.props.carried_box = true;
  EXPECT_THROW(World(options, SyntheticCamera()), InputError);
  options.props = {.door = true};
  options.scene.doorway = false;
  EXPECT_THROW(World(options, SyntheticCamera()), InputError);
  options.scene.kind = SceneKind::kAliased;
  options.scene.doorway = true;
  EXPECT_THROW(BuildScene(options.scene), InputError);
}

}  // namespace
}  // namespace dmslam
