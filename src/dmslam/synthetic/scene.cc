#include "dmslam/synthetic/scene.h"

#include <algorithm>
#include <cmath>

#include "dmslam/synthetic/angles.h"
#include "dmslam/synthetic/scene_builder.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

using Eigen::Affine3f;
using Eigen::AngleAxisf;
using Eigen::Translation3f;
using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kRoomLength = 7.0f, kRoomWidth = 6.0f, kRoomHeight = 2.7f;

/// The frame of a thing whose front, at `position`, looks to `facing` (unit, on the floor).
Affine3f FrameFacing(const Vector2f& position, const Vector2f& facing) {
  // The thing's y axis points away from who looks at it, against `facing`.
  const float yaw = std::atan2(-facing.y(), -facing.x()) - 0.5f * kPiF;
  return Translation3f(On(position, 0)) * AngleAxisf(yaw, Vector3f::UnitZ());
}

/// A wall from `a` to `b` with the room on its left; openings are left out.
struct Wall {
  Vector2f a, b;
  uint32_t skin = 0;            ///< Index into Assets::walls.
  float max_depth = 0.45f;      ///< How far furniture may stand out.
  std::vector<float> openings;  ///< Middles of doorways, metres from `a`.
  float height = kRoomHeight;
  double bare = 0;  ///< Share of its places that stay empty.
  Vector2f along() const { return (b - a).normalized(); }
  Vector2f inward() const { return {-along().y(), along().x()}; }
  float length() const { return (b - a).norm(); }
};

constexpr float kDoorwayWidth = 1.1f, kDoorwayHeight = 2.1f;

void AddWallPanel(SceneBuilder& builder, const Wall& wall, const Skin& skin, float from, float to, float z0,
                  float z1) {
  if (to - from < 0.01f) return;
  // Long walls are cut into meshes, so that what is out of view is skipped.
  const int parts = std::max(1, static_cast<int>(std::ceil((to - from) / 3.0f)));
  for (int i = 0; i < parts; ++i) {
    const float s0 = from + (to - from) * static_cast<float>(i) / static_cast<float>(parts);
    const float s1 = from + (to - from) * static_cast<float>(i + 1) / static_cast<float>(parts);
    const Vector2f right = wall.a + s0 * wall.along(), left = wall.a + s1 * wall.along();
    builder.AddQuad(On(left, z1), On(right - left, 0), Vector3f(0, 0, z0 - z1), skin);
    builder.FinishMesh();
  }
}

void BuildWall(SceneBuilder& builder, const Assets& assets, const Wall& wall) {
  const Skin skin = assets.walls[wall.skin % assets.walls.size()];
  float from = 0;
  for (const float middle : wall.openings) {
    AddWallPanel(builder, wall, skin, from, middle - 0.5f * kDoorwayWidth, 0, wall.height);
    AddWallPanel(builder, wall, skin, middle - 0.5f * kDoorwayWidth, middle + 0.5f * kDoorwayWidth,
                 kDoorwayHeight, wall.height);
    from = middle + 0.5f * kDoorwayWidth;
  }
  AddWallPanel(builder, wall, skin, from, wall.length(), 0, wall.height);
}

/// The closet behind a wall's opening, with a picture in it, and the doorway itself.
Doorway AddCloset(SceneBuilder& builder, const Assets& assets, const Wall& wall, float middle) {
  constexpr float kDepth = 0.9f;
  const Vector2f hinge = wall.a + (middle - 0.5f * kDoorwayWidth) * wall.along();
  Doorway doorway{hinge, wall.along(), wall.inward(), kDoorwayWidth, kDoorwayHeight};
  const Vector3f across = On(kDoorwayWidth * wall.along(), 0), back = On(-kDepth * wall.inward(), 0),
                 up(0, 0, kDoorwayHeight), foot = On(hinge, 0);
  const Skin skin = assets.walls[(wall.skin + 2) % assets.walls.size()];
  builder.AddQuad(foot + up + back, across, -up, skin);
  builder.AddQuad(foot + up, back, -up, skin);
  builder.AddQuad(foot + up + across + back, -back, -up, skin);
  builder.AddQuad(foot + back, across, -back, assets.floor);
  builder.AddQuad(foot + up, across, back, assets.ceiling);
  builder.FinishMesh();
  AddPoster(builder, builder.Pick(assets.posters),
            FrameFacing(hinge + 0.5f * kDoorwayWidth * wall.along() - (kDepth - 0.02f) * wall.inward(),
                        wall.inward()),
            0.75f, 0.9f, 0.8f);
  return doorway;
}

/// Takes posters in turn, so that none hangs twice before all hang once.
class PosterDeck {
 public:
  explicit PosterDeck(const std::vector<uint32_t>& posters) : posters_(posters) {}
  void Shuffle(Random& random) {
    for (size_t i = posters_.size(); i > 1; --i) {
      std::swap(posters_[i - 1], posters_[random.Below(static_cast<uint32_t>(i))]);
    }
  }
  uint32_t Next() { return posters_[next_++ % posters_.size()]; }

 private:
  std::vector<uint32_t> posters_;
  size_t next_ = 0;
};

/// Hangs pictures at one place of a wall, from `low` upwards: columns of one large or two small ones.
void HangPosters(SceneBuilder& builder, PosterDeck& deck, const Vector2f& foot, const Wall& wall, float low,
                 float slot) {
  const float top = 2.45f;
  float at = -0.46f * slot;
  while (at < 0.46f * slot - 0.3f) {
    const float width = std::min(builder.Uniform(0.36f, 0.8f), 0.46f * slot - at);
    float bottom = low + builder.Uniform(0.0f, 0.2f);
    while (bottom + 0.3f < top) {
      const float height = std::min(width * builder.Uniform(0.75f, 1.3f), top - bottom);
      const Affine3f frame = FrameFacing(foot + (at + 0.5f * width) * wall.along(), wall.inward());
      AddPoster(builder, deck.Next(), frame, width, height, bottom);
      bottom += height + builder.Uniform(0.06f, 0.25f);
    }
    at += width + builder.Uniform(0.06f, 0.3f);
  }
}

/// Furnishes one place of a wall, about `slot` metres wide.
void FurnishPlace(SceneBuilder& builder, const Assets& assets, PosterDeck& deck, const Wall& wall, float at,
                  float slot) {
  const Vector2f foot = wall.a + at * wall.along();
  const auto standing = [&](float depth) {
    return FrameFacing(foot + (depth + 0.02f) * wall.inward(), wall.inward());
  };
  const float depth = std::min(wall.max_depth, builder.Uniform(0.26f, 0.42f));
  const double kind = builder.random().Uniform();
  if (kind < 0.22) {
    const float width = std::min(slot - 0.15f, builder.Uniform(0.8f, 1.3f));
    AddShelf(builder, assets, standing(depth), width, builder.Uniform(1.3f, 2.2f), depth);
  } else if (kind < 0.45) {
    const float width = std::min(slot - 0.15f, builder.Uniform(0.8f, 1.3f)),
                height = builder.Uniform(0.75f, 1.1f);
    AddCabinet(builder, assets, standing(depth), width, height, depth);
    HangPosters(builder, deck, foot, wall, height + 0.35f, slot);
  } else if (kind < 0.55) {
    AddPlant(builder, assets, standing(0.34f), builder.Uniform(0.9f, 1.6f));
    HangPosters(builder, deck, foot, wall, 1.1f, slot);
  } else if (kind < 0.65) {
    AddRadiator(builder, assets, standing(0.03f), slot - 0.4f);
    HangPosters(builder, deck, foot, wall, 0.95f, slot);
  } else if (kind < 0.75) {
    AddPileOfBoxes(builder, assets, standing(0.4f));
    HangPosters(builder, deck, foot, wall, 1.35f, slot);
  } else if (kind < 0.83) {
    AddDoor(builder, assets, FrameFacing(foot, wall.inward()));
  } else {
    HangPosters(builder, deck, foot, wall, builder.Uniform(0.4f, 0.9f), slot);
  }
}

void FurnishWall(SceneBuilder& builder, const Assets& assets, PosterDeck& deck, const Wall& wall) {
  const float margin = 0.55f, usable = wall.length() - 2 * margin;
  const int places = std::max(1, static_cast<int>(std::round(usable / 1.35f)));
  const float slot = usable / static_cast<float>(places);
  for (int i = 0; i < places; ++i) {
    const float at = margin + (static_cast<float>(i) + 0.5f) * slot;
    float from = at - 0.5f * slot, to = at + 0.5f * slot;
    for (const float middle : wall.openings) {
      const float left = middle - 0.5f * kDoorwayWidth - 0.05f, right = middle + 0.5f * kDoorwayWidth + 0.05f;
      if (right <= from || left >= to) continue;
      (left - from > to - right ? to : from) = left - from > to - right ? left : right;
    }
    const float width = to - from;
    if (wall.bare > 0 && builder.Chance(wall.bare)) continue;
    if (width > slot - 0.01f)
      FurnishPlace(builder, assets, deck, wall, at, slot);
    else if (width > 0.4f)
      HangPosters(builder, deck, wall.a + 0.5f * (from + to) * wall.along(), wall, 0.5f, width);
  }
}

void AddFloorAndCeiling(SceneBuilder& builder, const Assets& assets, const Vector2f& low,
                        const Vector2f& high, float height = kRoomHeight) {
  const Vector2f size = high - low;
  const int nx = std::max(1, static_cast<int>(std::ceil(size.x() / 3))),
            ny = std::max(1, static_cast<int>(std::ceil(size.y() / 3)));
  const float dx = size.x() / static_cast<float>(nx), dy = size.y() / static_cast<float>(ny);
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const float x = low.x() + static_cast<float>(i) * dx, y = low.y() + static_cast<float>(j) * dy;
      builder.AddQuad({x, y + dy, 0}, {dx, 0, 0}, {0, -dy, 0}, assets.floor);
      builder.AddQuad({x, y, height}, {dx, 0, 0}, {0, dy, 0}, assets.ceiling);
      builder.FinishMesh();
    }
  }
}

/// Desks side by side, fronts to -x and chairs on both sides: a pair, or one in the middle (`sides` {0}).
void AddDeskGroup(SceneBuilder& builder, const Assets& assets, const Vector2f& center, Scene& scene,
                  const std::vector<float>& sides = {-1.0f, 1.0f}) {
  for (const float side : sides) {
    const Vector2f front = center + Vector2f(-0.38f + builder.Uniform(-0.04f, 0.04f), 0.82f * side);
    AddDesk(builder, assets, FrameFacing(front, {-1, 0}), 1.55f, 0.76f);
    scene.obstacles.push_back({center + Vector2f(0, 0.82f * side), 0.78f});
    for (const float facing : {-1.0f, 1.0f}) {
      const Vector2f seat =
          center + Vector2f(facing * builder.Uniform(0.72f, 0.82f), side * builder.Uniform(0.42f, 0.65f));
      const float heading = facing < 0 ? 0.0f : kPiF;
      // The chair's back is behind the sitter; its frame's +y points there.
      AddChair(builder, assets,
               Translation3f(On(seat, 0)) * AngleAxisf(heading + 0.5f * kPiF, Vector3f::UnitZ()));
      scene.seats.push_back({seat, heading});
    }
  }
}

/// Where along its wall a doorway is.
constexpr float kDoorwayShare = 0.72f;

void AddDoorway(SceneBuilder& builder, const Assets& assets, float middle, Wall& wall, Scene& scene) {
  wall.openings.push_back(middle);
  scene.doorways.push_back(AddCloset(builder, assets, wall, middle));
}

void BuildRoom(SceneBuilder& builder, const Assets& assets, const Vector2f& low,
               const std::vector<float>& doors_at_end, const std::vector<float>& doors_at_start, bool doorway,
               Scene& scene) {
  const Vector2f high = low + Vector2f(kRoomLength, kRoomWidth);
  const uint32_t skin = builder.random().Below(4);
  PosterDeck deck(assets.posters);
  deck.Shuffle(builder.random());
  std::vector<Wall> walls = {
      {low, {high.x(), low.y()}, skin, 0.45f, doors_at_start},
      {{high.x(), low.y()}, high, skin + 1, 0.45f, {}},
      {high, {low.x(), high.y()}, skin + 2, 0.45f, doors_at_end},
      {{low.x(), high.y()}, low, skin + 3, 0.45f, {}},
  };
  if (doorway) AddDoorway(builder, assets, kDoorwayShare * walls[1].length(), walls[1], scene);
  for (const Wall& wall : walls) {
    BuildWall(builder, assets, wall);
    FurnishWall(builder, assets, deck, wall);
  }
  AddFloorAndCeiling(builder, assets, low, high);
  AddDeskGroup(builder, assets, low + Vector2f(4.0f, 3.0f), scene);
  scene.rooms.emplace_back(low, high);
}

std::vector<Vector3f> RoomLamps(const Vector2f& low) {
  return {On(low + Vector2f(1.8f, 3.0f), 2.55f), On(low + Vector2f(5.0f, 2.0f), 2.55f),
          On(low + Vector2f(5.0f, 4.4f), 2.55f)};
}

/// What distinguishes the kinds of rooms beside BuildRoom's.
struct RoomPlan {
  Vector2f size;
  float height = kRoomHeight;
  double bare = 0;
  std::vector<Vector2f> desks;      ///< Middles of desk groups.
  std::vector<float> desks_beside;  ///< As AddDeskGroup's `sides`.
  Vector2f home;
};

RoomPlan PlanOf(SceneKind kind) {
  if (kind == SceneKind::kOffice) return {{5.0f, 4.4f}, 2.6f, 0, {{2.9f, 2.2f}}, {0.0f}, {1.0f, 2.2f}};
  if (kind == SceneKind::kHall)
    return {{11.0f, 8.5f}, 3.6f, 0.15, {{5.6f, 2.6f}, {7.6f, 5.9f}}, {-1.0f, 1.0f}, {2.6f, 4.2f}};
  return {{kRoomLength, kRoomWidth}, kRoomHeight, 0.5, {{4.0f, 3.0f}}, {-1.0f, 1.0f}, {2.0f, 3.0f}};
}

void BuildPlannedRoom(const SceneOptions& options, Scene& scene) {
  const RoomPlan plan = PlanOf(options.kind);
  const Assets assets = PaintAssets(options.seed, 44, options.texture_halvings, scene.textures);
  std::vector<Vector3f> lamps;
  for (float x = 1.6f; x < plan.size.x(); x += 3.0f) {
    for (float y = 1.5f; y < plan.size.y(); y += 2.8f) lamps.push_back({x, y, plan.height - 0.15f});
  }
  SceneBuilder builder(DeriveSeed(options.seed, static_cast<uint64_t>(options.kind), "layout"), lamps);
  const uint32_t skin = builder.random().Below(4);
  PosterDeck deck(assets.posters);
  deck.Shuffle(builder.random());
  const Vector2f o(0, 0), x(plan.size.x(), 0), y(0, plan.size.y());
  std::vector<Wall> walls = {{o, x, skin, 0.45f, {}},
                             {x, plan.size, skin + 1, 0.45f, {}},
                             {plan.size, y, skin + 2, 0.45f, {}},
                             {y, o, skin + 3, 0.45f, {}}};
  for (Wall& wall : walls) {
    wall.height = plan.height;
    wall.bare = plan.bare;
  }
  if (options.doorway) AddDoorway(builder, assets, kDoorwayShare * walls[1].length(), walls[1], scene);
  for (const Wall& wall : walls) {
    BuildWall(builder, assets, wall);
    FurnishWall(builder, assets, deck, wall);
  }
  AddFloorAndCeiling(builder, assets, o, plan.size, plan.height);
  for (const Vector2f& desks : plan.desks) AddDeskGroup(builder, assets, desks, scene, plan.desks_beside);
  scene.rooms.emplace_back(o, plan.size);
  scene.home = plan.home;
  scene.meshes = builder.TakeMeshes();
}

void BuildOneRoom(const SceneOptions& options, Scene& scene) {
  const Assets assets = PaintAssets(options.seed, 44, options.texture_halvings, scene.textures);
  SceneBuilder builder(DeriveSeed(options.seed, 0, "layout"), RoomLamps({0, 0}));
  BuildRoom(builder, assets, {0, 0}, {}, {}, options.doorway, scene);
  scene.meshes = builder.TakeMeshes();
}

void BuildTwoRooms(const SceneOptions& options, Scene& scene) {
  const Assets assets = PaintAssets(options.seed, 36, options.texture_halvings, scene.textures);
  const Vector2f second(0, kRoomWidth + 0.12f);
  std::vector<Vector3f> lamps = RoomLamps({0, 0});
  for (const Vector3f& lamp : RoomLamps(second)) lamps.push_back(lamp);
  // Doorways meet: a wall runs against the direction of the one on its other side.
  const float door = 1.6f;
  SceneBuilder builder(DeriveSeed(options.seed, 0, "layout"), lamps);
  BuildRoom(builder, assets, {0, 0}, {kRoomLength - door}, {}, false, scene);
  builder.random() = Random(DeriveSeed(options.seed, 1, "layout"));
  BuildRoom(builder, assets, second, {}, {door}, false, scene);
  const float gap = second.y() - kRoomWidth, x0 = door - 0.5f * kDoorwayWidth,
              x1 = door + 0.5f * kDoorwayWidth;
  builder.AddQuad({x0, kRoomWidth, kDoorwayHeight}, {0, gap, 0}, {0, 0, -kDoorwayHeight}, assets.woods[0]);
  builder.AddQuad({x1, second.y(), kDoorwayHeight}, {0, -gap, 0}, {0, 0, -kDoorwayHeight}, assets.woods[0]);
  builder.AddQuad({x0, kRoomWidth, kDoorwayHeight}, {kDoorwayWidth, 0, 0}, {0, gap, 0}, assets.woods[0]);
  builder.AddQuad({x0, second.y(), 0}, {kDoorwayWidth, 0, 0}, {0, -gap, 0}, assets.woods[0]);
  scene.meshes = builder.TakeMeshes();
}

void BuildCorridor(const SceneOptions& options, Scene& scene) {
  const auto half_sum = static_cast<float>(0.5 * options.ring_length_m);
  const Vector2f size(0.63f * half_sum, 0.37f * half_sum);
  scene.ring_size_m = size;
  const int posters = std::clamp(static_cast<int>(options.ring_length_m * 3.5), 60, 4000);
  const Assets assets = PaintAssets(options.seed, posters, options.texture_halvings, scene.textures);
  std::vector<Vector3f> lamps;
  for (float at = 1.5f; at < size.x(); at += 4.0f) {
    lamps.push_back({at, 0, 2.55f});
    lamps.push_back({at, size.y(), 2.55f});
  }
  for (float at = 3.0f; at < size.y(); at += 4.0f) {
    lamps.push_back({0, at, 2.55f});
    lamps.push_back({size.x(), at, 2.55f});
  }
  SceneBuilder builder(DeriveSeed(options.seed, 0, "layout"), lamps);
  PosterDeck deck(assets.posters);
  const float h = kCorridorHalfWidthM;
  const Vector2f o0(-h, -h), o1(size.x() + h, -h), o2(size.x() + h, size.y() + h), o3(-h, size.y() + h);
  const Vector2f i0(h, h), i1(size.x() - h, h), i2(size.x() - h, size.y() - h), i3(h, size.y() - h);
  std::vector<Wall> walls = {{o0, o1, 0, 0.36f, {}}, {o1, o2, 2, 0.36f, {}}, {o2, o3, 3, 0.36f, {}},
                             {o3, o0, 1, 0.36f, {}}, {i0, i3, 3, 0.36f, {}}, {i3, i2, 1, 0.36f, {}},
                             {i2, i1, 0, 0.36f, {}}, {i1, i0, 2, 0.36f, {}}};
  if (options.doorway) AddDoorway(builder, assets, kDoorwayShare * walls[0].length(), walls[0], scene);
  for (const Wall& wall : walls) {
    BuildWall(builder, assets, wall);
    FurnishWall(builder, assets, deck, wall);
  }
  AddFloorAndCeiling(builder, assets, o0, {o1.x(), h});
  AddFloorAndCeiling(builder, assets, {o3.x(), i3.y()}, o2);
  AddFloorAndCeiling(builder, assets, {-h, h}, {h, i3.y()});
  AddFloorAndCeiling(builder, assets, {i1.x(), h}, {o2.x(), i2.y()});
  scene.rooms.emplace_back(o0, o2);
  scene.meshes = builder.TakeMeshes();
}

}  // namespace

SceneKind ParseSceneKind(const std::string& name) {
  if (name == "room") return SceneKind::kRoom;
  if (name == "corridor") return SceneKind::kCorridor;
  if (name == "aliased") return SceneKind::kAliased;
  if (name == "office") return SceneKind::kOffice;
  if (name == "hall") return SceneKind::kHall;
  if (name == "workshop") return SceneKind::kWorkshop;
  throw InputError("--scene: '" + name +
                   "' is not known; choose room, corridor, aliased, office, hall or workshop");
}

Scene BuildScene(const SceneOptions& options) {
  if (options.ring_length_m < 24) throw InputError("--ring-length: a ring needs at least 24 m");
  if (options.doorway && options.kind == SceneKind::kAliased)
    throw InputError("--door: --scene aliased has a doorway without a door; choose another scene");
  Scene scene;
  scene.kind = options.kind;
  switch (options.kind) {
    case SceneKind::kRoom:
      BuildOneRoom(options, scene);
      break;
    case SceneKind::kCorridor:
      BuildCorridor(options, scene);
      break;
    case SceneKind::kAliased:
      BuildTwoRooms(options, scene);
      break;
    case SceneKind::kOffice:
    case SceneKind::kHall:
    case SceneKind::kWorkshop:
      BuildPlannedRoom(options, scene);
      break;
  }
  return scene;
}

}  // namespace dmslam
