#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <vector>

#include "dmslam/synthetic/texture.h"

namespace dmslam {

/// A corner of a triangle: where it is (world, metres), what it shows (texture coordinates, 1 = once across
/// the texture), and how bright it is lit (1 = the texture as it is).
struct Vertex {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  float u = 0, v = 0;
  float light = 1.0f;
};

struct Triangle {
  uint32_t corners[3] = {0, 0, 0};
  uint32_t texture = 0;  ///< Index into the texture list of the scene.
};

/// One thing: triangles with a common bounding box. Both sides of a triangle are visible.
struct Mesh {
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
  Eigen::AlignedBox3f bounds;  ///< Of all positions; see UpdateBounds().
  int actor = -1;              ///< Index of the actor that it belongs to; -1 for what never moves.

  void UpdateBounds() {
    bounds.setEmpty();
    for (const Vertex& vertex : vertices) bounds.extend(vertex.position);
  }
};

/// Textures may be shared between scenes; index = position in the list.
using TextureList = std::vector<std::shared_ptr<const Texture>>;

}  // namespace dmslam
