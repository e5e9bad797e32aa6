#include "dmslam/synthetic/world.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dmslam/synthetic/revisits.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

SceneOptions QuickScene(SceneKind kind, uint64_t seed = 1) {
  SceneOptions options;
  options.kind = kind;
  options.seed = seed;
  options.texture_halvings = 4;
  return options;
}

constexpr PathKind kRoomPaths[] = {PathKind::kStatic,     PathKind::kXyz,  PathKind::kRpy,
                                   PathKind::kHalfsphere, PathKind::kTour, PathKind::kForward,
                                   PathKind::kTurn};

// A hand moves smoothly: neither place nor direction jumps, at any time, also where rounds begin again.
TEST(CameraPath, MovesSmoothly) {
  const Scene room = BuildScene(QuickScene(SceneKind::kRoom)),
              ring = BuildScene(QuickScene(SceneKind::kCorridor)),
              twins = BuildScene(QuickScene(SceneKind::kAliased));
  const auto check = [](const Scene& scene, PathKind kind, uint64_t seed) {
    const CameraPath path(scene, {.kind = kind, .seed = seed, .static_start_s = 0.5});
    Rigid3d last = path.T_world_cam(-0.01);
    for (double t = 0; t < 90; t += 0.01) {
      const Rigid3d pose = path.T_world_cam(t);
      ASSERT_LT((pose.translation - last.translation).norm(), 0.018)
          << "path " << static_cast<int>(kind) << " at " << t;
      ASSERT_LT(AngleBetween(pose.rotation, last.rotation), 0.022)
          << "path " << static_cast<int>(kind) << " at " << t;
      last = pose;
    }
  };
  for (const uint64_t seed : {1, 2}) {
    for (const PathKind kind : kRoomPaths) check(room, kind, seed);
    check(twins, PathKind::kTour, seed);
    check(ring, PathKind::kRing, seed);
    check(ring, PathKind::kForward, seed);
    for (const SceneKind kind : {SceneKind::kOffice, SceneKind::kHall, SceneKind::kWorkshop}) {
      const Scene other = BuildScene(QuickScene(kind));
      check(other, PathKind::kTour, seed);
      check(other, PathKind::kTurn, seed);
    }
  }
}

TEST(CameraPath, StaysWithinItsRoom) {
  for (const SceneKind kind :
       {SceneKind::kRoom, SceneKind::kOffice, SceneKind::kHall, SceneKind::kWorkshop}) {
    const Scene scene = BuildScene(QuickScene(kind));
    const Eigen::AlignedBox2f& room = scene.rooms.front();
    const Eigen::AlignedBox2d inside(room.min().cast<double>() + Eigen::Vector2d::Constant(0.4),
                                     room.max().cast<double>() - Eigen::Vector2d::Constant(0.4));
    for (const PathKind path_kind : kRoomPaths) {
      const CameraPath path(scene, {.kind = path_kind});
      for (double t = 0; t < 40; t += 0.1) {
        EXPECT_TRUE(inside.contains(path.T_world_cam(t).translation.head<2>().eval()))
            << static_cast<int>(kind) << " " << static_cast<int>(path_kind) << " " << t;
      }
    }
  }
}

TEST(CameraPath, ForwardLooksWhereItGoesAndTurnLooksAround) {
  for (const SceneKind kind : {SceneKind::kRoom, SceneKind::kCorridor}) {
    const Scene scene = BuildScene(QuickScene(kind));
    const CameraPath path(scene, {.kind = PathKind::kForward, .tremor = 0});
    double along = 0;
    for (int i = 0; i < 300; ++i) {
      const Rigid3d now = path.T_world_cam(0.1 * i), later = path.T_world_cam(0.1 * i + 0.01);
      along +=
          (later.translation - now.translation).normalized().dot(now.rotation * Eigen::Vector3d::UnitZ()) /
          300;
    }
    EXPECT_GT(along, 0.9);
  }
  const Scene room = BuildScene(QuickScene(SceneKind::kRoom));
  const CameraPath turn(room, {.kind = PathKind::kTurn, .tremor = 0});
  double widest = 0, farthest = 0;
  for (double t = 0; t < 20; t += 0.1) {
    widest = std::max(widest, AngleBetween(turn.T_world_cam(t).rotation, turn.T_world_cam(0).rotation));
    farthest = std::max(farthest, (turn.T_world_cam(t).translation - turn.T_world_cam(0).translation).norm());
  }
  EXPECT_GT(widest, 1.6);
  EXPECT_LT(farthest, 0.7);
}

TEST(CameraPath, StaticStartStandsStill) {
  const Scene room = BuildScene(QuickScene(SceneKind::kRoom));
  const CameraPath path(room, {.kind = PathKind::kXyz, .static_start_s = 2.0});
  EXPECT_EQ(path.T_world_cam(0.0).translation, path.T_world_cam(1.9).translation);
  EXPECT_GT((path.T_world_cam(0.0).translation - path.T_world_cam(4.0).translation).norm(), 0.05);
}

TEST(CameraPath, KindsMoveAsTheirNamesSay) {
  const Scene room = BuildScene(QuickScene(SceneKind::kRoom));
  const auto measure = [&](PathKind kind) {
    const CameraPath path(room, {.kind = kind});
    Eigen::Vector2d mean_speed(0, 0);  // m/s, rad/s
    for (int i = 0; i < 2400; ++i) {
      const Rigid3d a = path.T_world_cam(i * 0.01), b = path.T_world_cam((i + 1) * 0.01);
      mean_speed +=
          Eigen::Vector2d((b.translation - a.translation).norm(), AngleBetween(a.rotation, b.rotation)) /
          24.0;
    }
    return mean_speed;
  };
  const Eigen::Vector2d xyz = measure(PathKind::kXyz), rpy = measure(PathKind::kRpy),
                        sphere = measure(PathKind::kHalfsphere);
  EXPECT_NEAR(xyz.x(), 0.2, 0.1);  // As TUM's freiburg3_walking_xyz, 0.208 m/s.
  EXPECT_GT(rpy.y(), 2 * xyz.y());
  EXPECT_LT(rpy.x(), 0.16);
  EXPECT_NEAR(sphere.x(), 0.25, 0.13);
  EXPECT_GT(sphere.y(), 0.1);
}

TEST(CameraPath, WhatDoesNotFitIsRefused) {
  const Scene room = BuildScene(QuickScene(SceneKind::kRoom)),
              ring = BuildScene(QuickScene(SceneKind::kCorridor));
  EXPECT_THROW(CameraPath(room, {.kind = PathKind::kRing}), InputError);
  EXPECT_THROW(CameraPath(ring, {.kind = PathKind::kXyz}), InputError);
  EXPECT_THROW(ParsePathKind("zigzag"), InputError);
  EXPECT_THROW(ParseSceneKind("garden"), InputError);
  EXPECT_THROW(ParseBehaviour("dance"), InputError);
  SceneOptions tiny = QuickScene(SceneKind::kCorridor);
  tiny.ring_length_m = 5;
  EXPECT_THROW(BuildScene(tiny), InputError);
}

TEST(Scene, SeedsMakeDifferentRooms) {
  const Scene a = BuildScene(QuickScene(SceneKind::kRoom, 1)),
              b = BuildScene(QuickScene(SceneKind::kRoom, 1)),
              c = BuildScene(QuickScene(SceneKind::kRoom, 2));
  const auto positions = [](const Scene& scene) {
    Eigen::Vector3d sum(0, 0, 0);
    for (const Mesh& mesh : scene.meshes) {
      for (const Vertex& vertex : mesh.vertices) sum += vertex.position.cast<double>();
    }
    return sum;
  };
  EXPECT_EQ(positions(a), positions(b));
  EXPECT_NE(positions(a), positions(c));
}

TEST(Scene, AliasedRoomsShareTheirThings) {
  const Scene twins = BuildScene(QuickScene(SceneKind::kAliased));
  ASSERT_EQ(twins.rooms.size(), 2u);
  // Pictures that are seen in both rooms.
  std::vector<int> seen(twins.textures.size(), 0);
  for (const Mesh& mesh : twins.meshes) {
    const int room = mesh.bounds.center().y() < twins.rooms[0].max().y() ? 1 : 2;
    for (const Triangle& triangle : mesh.triangles) seen[triangle.texture] |= room;
  }
  const auto both = std::count(seen.begin(), seen.end(), 3);
  EXPECT_GT(both, static_cast<long>(twins.textures.size() / 2));
}

Camera SmallCamera() {
  return {.width_px = 64, .height_px = 48, .fx_px = 52.5, .fy_px = 52.5, .cx_px = 31.5, .cy_px = 23.5};
}

// Wherever one looks there is something: no gap between walls, nothing behind a doorway that is not built.
TEST(Scene, RoomsAreClosed) {
  for (const SceneKind kind :
       {SceneKind::kRoom, SceneKind::kOffice, SceneKind::kHall, SceneKind::kWorkshop, SceneKind::kCorridor}) {
    SceneOptions options = QuickScene(kind, 3);
    options.doorway = true;
    const Scene scene = BuildScene(options);
    Renderer renderer(SmallCamera(), RenderOptions{});
    const bool ring = kind == SceneKind::kCorridor;
    const CameraPath path(scene, {.kind = ring ? PathKind::kRing : PathKind::kTurn, .tremor = 0});
    for (int i = 0; i < 40; ++i) {
      const auto depth = renderer.RenderDepth(scene.meshes, {path.T_world_cam(0.5 * i), {}, {}}, nullptr);
      EXPECT_GT(*std::min_element(depth.begin(), depth.end()), 0)
          << "scene " << static_cast<int>(kind) << " at " << 0.5 * i;
    }
  }
}

TEST(Scene, RoomsDifferInSizeAndInWhatIsInThem) {
  const Scene room = BuildScene(QuickScene(SceneKind::kRoom)),
              office = BuildScene(QuickScene(SceneKind::kOffice)),
              hall = BuildScene(QuickScene(SceneKind::kHall)),
              workshop = BuildScene(QuickScene(SceneKind::kWorkshop));
  EXPECT_LT(office.rooms[0].volume(), 0.6f * room.rooms[0].volume());
  EXPECT_GT(hall.rooms[0].volume(), 2 * room.rooms[0].volume());
  EXPECT_EQ(hall.seats.size(), 8u);
  EXPECT_EQ(office.seats.size(), 2u);
  EXPECT_EQ(workshop.rooms[0].sizes(), room.rooms[0].sizes());
  EXPECT_LT(workshop.meshes.size(), 4 * room.meshes.size() / 5);
}

class ActorTest : public testing::Test {
 protected:
  ActorTest() : scene_(BuildScene(QuickScene(SceneKind::kRoom))), path_(scene_, {.kind = PathKind::kXyz}) {}
  ActorTimeline Timeline(const ActorOptions& options, int index = 0) {
    return {scene_, path_, options, index, 40.0};
  }
  Scene scene_;
  CameraPath path_;
};

TEST_F(ActorTest, MovementIsContinuousAndDeclared) {
  for (const Behaviour behaviour : {Behaviour::kWalk, Behaviour::kStopAndGo, Behaviour::kSit}) {
    const ActorTimeline timeline = Timeline({.behaviour = behaviour, .seed = 3});
    ActorState last = timeline.At(0);
    for (double t = 0.005; t < 40; t += 0.005) {
      const ActorState state = timeline.At(t);
      const double step_m = (state.position - last.position).norm();
      ASSERT_LT(step_m, 0.015) << t;
      if (!state.moving && !last.moving) {
        ASSERT_EQ(step_m, 0) << t;
        ASSERT_EQ(state.heading_rad, last.heading_rad) << t;
        ASSERT_EQ(state.sitting, last.sitting) << t;
      }
      last = state;
    }
  }
}

/// Shares of the time that someone moves, stands still, and sits.
Eigen::Vector3d TimeShares(const ActorTimeline& timeline) {
  Eigen::Vector3d shares(0, 0, 0);
  for (int i = 0; i < 4000; ++i) {
    const ActorState state = timeline.At(i * 0.01);
    shares += Eigen::Vector3d(state.moving, !state.moving, state.sitting == 1.0) / 4000.0;
  }
  return shares;
}

TEST_F(ActorTest, BehavioursDiffer) {
  EXPECT_GT(TimeShares(Timeline({.behaviour = Behaviour::kWalk})).x(), 0.98);
  const Eigen::Vector3d stop = TimeShares(Timeline({.behaviour = Behaviour::kStopAndGo}));
  EXPECT_GT(stop.x(), 0.35);
  EXPECT_GT(stop.y(), 0.2);
  EXPECT_EQ(stop.z(), 0);
  for (const int index : {0, 1})
    EXPECT_GT(TimeShares(Timeline({.behaviour = Behaviour::kSit}, index)).z(), 0.15);
  EXPECT_FALSE(Timeline({.stand_first_s = 3}).At(2.5).moving);
}

TEST_F(ActorTest, BodiesStandOnTheFloor) {
  TextureList textures;
  const ActorLook look = DressActor(1, 0, 4, textures);
  for (const double sitting : {0.0, 0.5, 1.0}) {
    ActorState state;
    state.sitting = sitting;
    state.stride = 1 - sitting;
    state.gait_rad = 1.3;
    const Mesh body = BuildActorMesh(look, state, 0);
    EXPECT_GT(body.bounds.min().z(), -0.09f) << sitting;
    EXPECT_LT(body.bounds.min().z(), 0.12f) << sitting;
    EXPECT_NEAR(body.bounds.max().z(), look.height_m - 0.42 * sitting * sitting, 0.14) << sitting;
  }
}

TEST(World, MovingShareIsMet) {
  for (const double share : {0.2, 0.6}) {
    WorldOptions options;
    options.scene = QuickScene(SceneKind::kRoom);
    options.moving_share = share;
    options.duration_s = 10;
    const Camera camera = SyntheticCamera();
    const World world(options, camera);
    Camera small = camera;
    small.width_px = 64;
    small.height_px = 48;
    small.fx_px = small.fy_px = 52.5;
    small.cx_px = 31.5;
    small.cy_px = 23.5;
    Renderer renderer(small, RenderOptions{});
    double covered = 0;
    for (int i = 0; i < 50; ++i) {
      std::vector<int> actor_of;
      renderer.RenderDepth({}, world.At(i * 0.2), &actor_of);
      covered +=
          static_cast<double>(std::count_if(actor_of.begin(), actor_of.end(), [](int a) { return a >= 0; })) /
          (50.0 * 64 * 48);
    }
    EXPECT_NEAR(covered, share, 0.05);
  }
}

TEST(World, ImpossibleOptionsAreRefused) {
  WorldOptions options;
  options.scene = QuickScene(SceneKind::kRoom);
  options.moving_share = 0.9;
  EXPECT_THROW(World(options, SyntheticCamera()), InputError);
  options.moving_share = 0;
  options.actors = 40;
  EXPECT_THROW(World(options, SyntheticCamera()), InputError);
}

std::vector<Rigid3d> Poses(const Scene& scene, const CameraPathOptions& options, int frames, double fps) {
  const CameraPath path(scene, options);
  std::vector<Rigid3d> poses;
  for (int i = 0; i < frames; ++i) poses.push_back(path.T_world_cam(i / fps));
  return poses;
}

TEST(Revisits, AClosedRingIsOne) {
  SceneOptions options = QuickScene(SceneKind::kCorridor);
  options.ring_length_m = 40;
  const Scene ring = BuildScene(options);
  // 40 m at 1 m/s: the start is seen again after some 38 s.
  const auto poses = Poses(ring, {.kind = PathKind::kRing, .speed_mps = 1.0}, 450, 10);
  const auto revisits = FindRevisits(ring, SyntheticCamera(), poses, {.frame_step = 3});
  ASSERT_GE(revisits.size(), 1u);
  EXPECT_GT(revisits[0].frame, 330u);
  EXPECT_LT(revisits[0].earlier_frame, 40u);
  EXPECT_LT(revisits[0].distance_m, 2.5);
  EXPECT_GE(revisits[0].graph_distance, 11);
}

TEST(Revisits, OneViewHeldIsNone) {
  const Scene room = BuildScene(QuickScene(SceneKind::kRoom));
  EXPECT_TRUE(
      FindRevisits(room, SyntheticCamera(), Poses(room, {.kind = PathKind::kXyz}, 300, 10), {.frame_step = 3})
          .empty());
}

}  // namespace
}  // namespace dmslam
