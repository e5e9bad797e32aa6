#include "dmslam/synthetic/scene_builder.h"

#include <algorithm>
#include <cmath>

#include "dmslam/synthetic/paint.h"

namespace dmslam {
namespace {

using Eigen::Vector3f;

}  // namespace

uint32_t Add(TextureList& textures, const Canvas& canvas) {
  textures.push_back(std::make_shared<const Texture>(canvas));
  return static_cast<uint32_t>(textures.size() - 1);
}

Assets PaintAssets(uint64_t seed, int posters, int halvings, TextureList& textures) {
  const auto size = [halvings](int full) { return std::max(32, full >> halvings); };
  // Each kind draws from its own generator, so that more posters do not change the books.
  const auto random = [seed](const char* kind, uint64_t i = 0) { return Random(DeriveSeed(seed, i, kind)); };
  const auto paint = [&textures](const Canvas& canvas) { return Add(textures, canvas); };
  Assets assets;
  const int poster_size = size(posters > 60 ? 256 : 512);
  for (int i = 0; i < posters; ++i) {
    Random r = random("poster", static_cast<uint64_t>(i));
    assets.posters.push_back(paint(PaintPoster(poster_size, poster_size, r)));
  }
  Random books = random("book"), packages = random("package"), screens = random("screen"),
         cloths = random("cloth");
  for (int i = 0; i < 28; ++i) assets.books.push_back(paint(PaintBookSpine(size(64), size(256), books)));
  for (int i = 0; i < 14; ++i) assets.packages.push_back(paint(PaintPackage(size(256), size(256), packages)));
  for (int i = 0; i < 3; ++i) assets.screens.push_back(paint(PaintScreen(size(512), size(256), screens)));
  for (int i = 0; i < 4; ++i) assets.cloths.push_back(paint(PaintCloth(size(256), cloths)));
  Random surfaces = random("surface");
  for (const Rgb& base : {Rgb(160, 120, 80), Rgb(110, 78, 52), Rgb(195, 175, 150)}) {
    assets.woods.push_back({paint(PaintWood(size(512), size(512), base, false, surfaces)), 0.9f});
  }
  assets.walls = {{paint(PaintPlaster(size(1024), Rgb(196, 192, 180), surfaces)), 2.4f},
                  {paint(PaintBricks(size(512), surfaces)), 1.3f},
                  {paint(PaintWallpaper(size(512), Rgb(175, 180, 165), surfaces)), 1.3f},
                  {paint(PaintPlaster(size(1024), Rgb(180, 170, 160), surfaces)), 2.4f}};
  const bool tiles = surfaces.Uniform() < 0.5;
  assets.floor = {paint(tiles ? PaintTiles(size(1024), Rgb(165, 155, 140), surfaces)
                              : PaintWood(size(1024), size(1024), Rgb(150, 112, 78), true, surfaces)),
                  2.0f};
  assets.ceiling = {paint(PaintTiles(size(512), Rgb(205, 205, 200), surfaces)), 2.4f};
  assets.keyboard = {paint(PaintKeyboard(size(256), size(128), surfaces)), 0};
  assets.leaf = {paint(PaintLeaf(size(64), surfaces)), 0};
  assets.door = {paint(PaintDoor(size(256), size(512), surfaces)), 0};
  assets.page = {paint(PaintPage(size(256), size(256), surfaces)), 0};
  assets.metal = {paint(PaintPlaster(size(256), Rgb(150, 152, 158), surfaces)), 0.8f};
  return assets;
}

float SceneBuilder::LightAt(const Vector3f& point, const Vector3f& normal) const {
  float light = 0.52f + 0.06f * normal.z() + 0.04f * normal.x();
  for (const Vector3f& lamp : lamps_) {
    const Vector3f to_lamp = lamp - point;
    const float distance_squared = to_lamp.squaredNorm();
    if (distance_squared > 64.0f) continue;
    const float facing = std::max(0.0f, normal.dot(to_lamp) / std::sqrt(distance_squared + 1e-6f));
    light += 0.75f * (0.25f + 0.75f * facing) / (1.0f + 0.35f * distance_squared);
  }
  return std::min(light, 1.35f);
}

void SceneBuilder::AddQuad(const Vector3f& origin, const Vector3f& along_u, const Vector3f& along_v,
                           const Skin& skin, float tile_m) {
  const float length_u = along_u.norm(), length_v = along_v.norm();
  const Vector3f normal = along_v.cross(along_u).normalized();
  const int nu = std::max(1, static_cast<int>(std::ceil(length_u / tile_m)));
  const int nv = std::max(1, static_cast<int>(std::ceil(length_v / tile_m)));
  const float scale_u = skin.metres_per_repeat > 0 ? length_u / skin.metres_per_repeat : 1.0f;
  const float scale_v = skin.metres_per_repeat > 0 ? length_v / skin.metres_per_repeat : 1.0f;
  const float shift_u = skin.metres_per_repeat > 0 ? Uniform(0, 1) : 0.0f;
  const float shift_v = skin.metres_per_repeat > 0 ? Uniform(0, 1) : 0.0f;
  const auto first = static_cast<uint32_t>(mesh_.vertices.size());
  for (int j = 0; j <= nv; ++j) {
    for (int i = 0; i <= nu; ++i) {
      const float s = static_cast<float>(i) / static_cast<float>(nu),
                  t = static_cast<float>(j) / static_cast<float>(nv);
      const Vector3f position = origin + s * along_u + t * along_v;
      mesh_.vertices.push_back(
          {position, shift_u + s * scale_u, shift_v + t * scale_v, LightAt(position, normal)});
    }
  }
  const auto at = [&](int i, int j) { return first + static_cast<uint32_t>(j * (nu + 1) + i); };
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      mesh_.triangles.push_back({{at(i, j), at(i + 1, j), at(i, j + 1)}, skin.texture});
      mesh_.triangles.push_back({{at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)}, skin.texture});
    }
  }
}

void SceneBuilder::AddBox(const Eigen::Affine3f& frame, const Vector3f& low, const Vector3f& high,
                          const Skin& front, const Skin& sides) {
  const auto corner = [&](bool x, bool y, bool z) {
    return Vector3f(frame * Vector3f(x ? high.x() : low.x(), y ? high.y() : low.y(), z ? high.z() : low.z()));
  };
  // Each face from its top left corner, as seen from outside: u to the right, v down.
  const auto face = [&](const Vector3f& top_left, const Vector3f& top_right, const Vector3f& bottom_left,
                        const Skin& skin) {
    AddQuad(top_left, top_right - top_left, bottom_left - top_left, skin);
  };
  face(corner(false, false, true), corner(true, false, true), corner(false, false, false), front);
  face(corner(true, true, true), corner(false, true, true), corner(true, true, false), sides);
  face(corner(false, true, true), corner(false, false, true), corner(false, true, false), sides);
  face(corner(true, false, true), corner(true, true, true), corner(true, false, false), sides);
  face(corner(false, true, true), corner(true, true, true), corner(false, false, true), sides);
  face(corner(false, false, false), corner(true, false, false), corner(false, true, false), sides);
}

void SceneBuilder::FinishMesh() {
  if (mesh_.triangles.empty()) return;
  mesh_.UpdateBounds();
  meshes_.push_back(std::move(mesh_));
  mesh_ = Mesh();
}

std::vector<Mesh> SceneBuilder::TakeMeshes() {
  FinishMesh();
  return std::move(meshes_);
}

}  // namespace dmslam
