#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "dmslam/synthetic/mesh.h"
#include "dmslam/util/random.h"

namespace dmslam {

/// What a face shows: a texture once across the face (`metres_per_repeat` 0), or repeated at a fixed size.
struct Skin {
  uint32_t texture = 0;
  float metres_per_repeat = 0;
};

/// The pictures that a scene's things may show, as indices into its texture list.
struct Assets {
  std::vector<uint32_t> posters, books, packages, screens, cloths;
  std::vector<Skin> woods, walls;
  Skin floor, ceiling, keyboard, leaf, door, page, metal;
};

/// Puts a picture at the end of the list and returns its index.
uint32_t Add(TextureList& textures, const Canvas& canvas);

/// Paints all pictures. `posters` is how many different ones; `halvings` lowers the resolution.
Assets PaintAssets(uint64_t seed, int posters, int halvings, TextureList& textures);

/// The point at the height z above a point of the floor.
inline Eigen::Vector3f On(const Eigen::Vector2f& floor, float z) { return {floor.x(), floor.y(), z}; }

/// Builds meshes out of lit quads and boxes. Frames put a thing into the world: x to its right, y into it, z
/// up, as seen by who stands before it; the origin is on the floor, in the middle of its front.
class SceneBuilder {
 public:
  SceneBuilder(uint64_t seed, std::vector<Eigen::Vector3f> lamps) : random_(seed), lamps_(std::move(lamps)) {}

  Random& random() { return random_; }
  float Uniform(float low, float high) { return static_cast<float>(random_.Uniform(low, high)); }
  bool Chance(double probability) { return random_.Uniform() < probability; }
  template <typename T>
  const T& Pick(const std::vector<T>& list) {
    return list[random_.Below(static_cast<uint32_t>(list.size()))];
  }

  /// A parallelogram, cut into tiles of at most `tile_m` so that its light may vary.
  void AddQuad(const Eigen::Vector3f& origin, const Eigen::Vector3f& along_u, const Eigen::Vector3f& along_v,
               const Skin& skin, float tile_m = 0.7f);
  /// A box from `low` to `high` in `frame`; `front` is what shows to -y, `sides` everything else.
  void AddBox(const Eigen::Affine3f& frame, const Eigen::Vector3f& low, const Eigen::Vector3f& high,
              const Skin& front, const Skin& sides);
  /// Ends the mesh under construction; what follows goes into a new one.
  void FinishMesh();
  std::vector<Mesh> TakeMeshes();

 private:
  float LightAt(const Eigen::Vector3f& point, const Eigen::Vector3f& normal) const;

  Random random_;
  std::vector<Eigen::Vector3f> lamps_;
  Mesh mesh_;
  std::vector<Mesh> meshes_;
};

/// Furniture, each into a mesh of its own.
void AddShelf(SceneBuilder& builder, const Assets& assets, const Eigen::Affine3f& frame, float width,
              float height, float depth);
void AddDesk(SceneBuilder& builder, const Assets& assets, const Eigen::Affine3f& frame, float width,
             float depth);
void AddChair(SceneBuilder& builder, const Assets& assets, const Eigen::Affine3f& frame);
void AddPlant(SceneBuilder& builder, const Assets& assets, const Eigen::Affine3f& frame, float height);
void AddCabinet(SceneBuilder& builder, const Assets& assets, const Eigen::Affine3f& frame, float width,
                float height, float depth);
void AddPoster(SceneBuilder& builder, uint32_t texture, const Eigen::Affine3f& frame, float width,
               float height, float bottom);
void AddDoor(SceneBuilder& builder, const Assets& assets, const Eigen::Affine3f& frame);
void AddRadiator(SceneBuilder& builder, const Assets& assets, const Eigen::Affine3f& frame, float width);
void AddPileOfBoxes(SceneBuilder& builder, const Assets& assets, const Eigen::Affine3f& frame);

}  // namespace dmslam
