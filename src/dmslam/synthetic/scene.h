#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "dmslam/synthetic/mesh.h"

namespace dmslam {

enum class SceneKind {
  kRoom,      ///< One furnished room of 7 x 6 m with a desk in its middle.
  kCorridor,  ///< A closed ring of corridors.
  kAliased,  ///< Two rooms, side by side, with a door between them: the same things, put up in another order.
  kOffice,   ///< A small room of 5 x 4.4 m with one desk.
  kHall,     ///< A high room of 11 x 8.5 m with two pairs of desks: most of it is far away.
  kWorkshop,  ///< As kRoom, but half of its walls are bare.
};

/// "room", "corridor", "aliased", "office", "hall" or "workshop"; throws InputError for another name.
SceneKind ParseSceneKind(const std::string& name);

struct SceneOptions {
  SceneKind kind = SceneKind::kRoom;
  uint64_t seed = 1;          ///< Everything in it: pictures, where things stand, how they are lit.
  double ring_length_m = 60;  ///< kCorridor: length of the centre line.
  bool doorway = false;       ///< A doorway with a small closet behind it, for a door; not in kAliased.
  int texture_halvings =
      0;  ///< Textures of half (1), quarter (2) ... the resolution: quick scenes for tests.
};

/// Where someone may sit: the middle of the seat, and the direction the sitter looks [rad, from +x to +y].
struct Seat {
  Eigen::Vector2f position;
  float heading_rad = 0;
};

/// Something that walkers go around.
struct Obstacle {
  Eigen::Vector2f center;
  float radius_m = 0;
};

/// A hole in a wall for a door, which opens into the room.
struct Doorway {
  Eigen::Vector2f hinge;
  Eigen::Vector2f along{1, 0};   ///< Unit, along the wall from the hinge to the other side.
  Eigen::Vector2f inward{0, 1};  ///< Unit, into the room.
  float width_m = 0;
  float height_m = 0;
};

/// A still, lit world. Axes: z up, metres; floors at z = 0.
struct Scene {
  SceneKind kind = SceneKind::kRoom;
  TextureList textures;
  std::vector<Mesh> meshes;
  std::vector<Seat> seats;
  std::vector<Obstacle> obstacles;
  std::vector<Eigen::AlignedBox2f> rooms;  ///< Inner sides of the walls, per room.
  std::vector<Doorway> doorways;           ///< Where SceneOptions asked for one.
  Eigen::Vector2f home{2, 3};              ///< Where a camera stands that does not go around; it looks to +x.
  Eigen::Vector2f ring_size_m{0, 0};       ///< kCorridor: the centre line is a rectangle from (0, 0) to here.
};

Scene BuildScene(const SceneOptions& options);

/// Half the width of a corridor, from its centre line to a wall.
inline constexpr float kCorridorHalfWidthM = 1.25f;

}  // namespace dmslam
