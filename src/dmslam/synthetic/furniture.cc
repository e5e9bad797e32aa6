#include <algorithm>
#include <cmath>

#include "dmslam/synthetic/scene_builder.h"

namespace dmslam {
namespace {

using Eigen::Affine3f;
using Eigen::AngleAxisf;
using Eigen::Translation3f;
using Eigen::Vector3f;

Affine3f At(const Affine3f& frame, const Vector3f& position, float yaw_rad = 0) {
  return frame * Translation3f(position) * AngleAxisf(yaw_rad, Vector3f::UnitZ());
}

/// A box that stands on z = 0 of `frame`, centred.
void AddStanding(SceneBuilder& builder, const Affine3f& frame, const Vector3f& size, const Skin& front,
                 const Skin& sides) {
  builder.AddBox(frame, {-0.5f * size.x(), -0.5f * size.y(), 0}, {0.5f * size.x(), 0.5f * size.y(), size.z()},
                 front, sides);
}

/// A row of books from x0 to x1, their spines at y = 0, standing on z.
void AddBooks(SceneBuilder& builder, const Assets& assets, const Affine3f& frame, float x0, float x1, float z,
              float max_height) {
  for (float x = x0; x < x1;) {
    const float thickness = builder.Uniform(0.018f, 0.05f),
                height = max_height * builder.Uniform(0.6f, 0.95f);
    if (x + thickness > x1) break;
    const float back = builder.Uniform(0.0f, 0.06f);
    const Skin spine{builder.Pick(assets.books), 0};
    builder.AddBox(frame, {x, back, z}, {x + thickness, back + 0.17f, z + height}, spine, spine);
    x += thickness + (builder.Chance(0.08) ? builder.Uniform(0.03f, 0.12f) : 0.001f);
  }
}

/// Things that lie about, on a top at height z.
void AddClutter(SceneBuilder& builder, const Assets& assets, const Affine3f& frame, float x0, float x1,
                float y0, float y1, float z, int count) {
  for (int i = 0; i < count; ++i) {
    const Affine3f place =
        At(frame, {builder.Uniform(x0, x1), builder.Uniform(y0, y1), z}, builder.Uniform(-0.6f, 0.6f));
    const Skin package{builder.Pick(assets.packages), 0}, book{builder.Pick(assets.books), 0};
    if (builder.Chance(0.5)) {
      AddStanding(
          builder, place,
          {builder.Uniform(0.06f, 0.2f), builder.Uniform(0.05f, 0.14f), builder.Uniform(0.06f, 0.26f)},
          package, package);
    } else if (builder.Chance(0.5)) {
      AddStanding(builder, place, {0.21f, 0.29f, builder.Uniform(0.004f, 0.05f)}, book, assets.page);
    } else {
      AddStanding(builder, place, {0.07f, 0.07f, 0.1f}, package, assets.metal);
    }
  }
}

}  // namespace

void AddShelf(SceneBuilder& builder, const Assets& assets, const Affine3f& frame, float width, float height,
              float depth) {
  const Skin wood = builder.Pick(assets.woods);
  const float half = 0.5f * width, board = 0.022f;
  builder.AddBox(frame, {-half, 0, 0}, {-half + board, depth, height}, wood, wood);
  builder.AddBox(frame, {half - board, 0, 0}, {half, depth, height}, wood, wood);
  builder.AddBox(frame, {-half, depth - 0.01f, 0}, {half, depth, height}, wood, wood);
  const int shelves = std::max(2, static_cast<int>(height / 0.36f));
  const float step = (height - board) / static_cast<float>(shelves);
  for (int i = 0; i <= shelves; ++i) {
    const float z = static_cast<float>(i) * step;
    builder.AddBox(frame, {-half + board, 0, z}, {half - board, depth, z + board}, wood, wood);
    if (i == shelves) break;
    const float split = builder.Uniform(-half, half);
    const bool books_left = builder.Chance(0.5);
    const float b0 = books_left ? -half + board : split, b1 = books_left ? split : half - board;
    AddBooks(builder, assets, frame, b0, b1, z + board, step - board);
    const float c0 = books_left ? split : -half + board, c1 = books_left ? half - board : split;
    if (c1 - c0 > 0.25f) {
      AddClutter(builder, assets, frame, c0 + 0.1f, c1 - 0.1f, 0.1f, depth - 0.1f, z + board,
                 builder.Chance(0.5) ? 2 : 1);
    }
  }
  AddClutter(builder, assets, frame, -half + 0.1f, half - 0.1f, 0.1f, depth - 0.05f, height, 2);
  builder.FinishMesh();
}

void AddDesk(SceneBuilder& builder, const Assets& assets, const Affine3f& frame, float width, float depth) {
  const Skin wood = builder.Pick(assets.woods);
  const float half = 0.5f * width, height = 0.74f, leg = 0.06f;
  builder.AddBox(frame, {-half, 0, height - 0.03f}, {half, depth, height}, wood, wood);
  for (const float x : {-half + 0.03f, half - 0.03f - leg}) {
    for (const float y : {0.03f, depth - 0.03f - leg}) {
      builder.AddBox(frame, {x, y, 0}, {x + leg, y + leg, height - 0.03f}, assets.metal, assets.metal);
    }
  }
  const Skin drawer = builder.Pick(assets.woods);
  builder.AddBox(frame, {half - 0.5f, 0.05f, 0.05f}, {half - 0.1f, depth - 0.05f, height - 0.05f}, drawer,
                 drawer);
  for (const float x : {-0.28f * width, 0.18f * width}) {
    const Affine3f screen =
        At(frame, {x, builder.Uniform(0.35f, 0.5f) * depth + 0.1f, height}, builder.Uniform(-0.35f, 0.35f));
    AddStanding(builder, screen, {0.22f, 0.18f, 0.015f}, assets.metal, assets.metal);
    builder.AddBox(screen, {-0.03f, 0, 0}, {0.03f, 0.03f, 0.2f}, assets.metal, assets.metal);
    const Skin front{builder.Pick(assets.screens), 0};
    builder.AddBox(screen, {-0.27f, -0.03f, 0.1f}, {0.27f, 0, 0.43f}, front, assets.metal);
    builder.AddBox(At(frame, {x, 0.12f, height}, builder.Uniform(-0.15f, 0.15f)), {-0.2f, 0, 0},
                   {0.2f, 0.15f, 0.02f}, assets.metal, assets.keyboard);
  }
  AddClutter(builder, assets, frame, -half + 0.1f, half - 0.1f, 0.1f, depth - 0.1f, height, 14);
  builder.FinishMesh();
}

void AddChair(SceneBuilder& builder, const Assets& assets, const Affine3f& frame) {
  const Skin cloth{builder.Pick(assets.cloths), 0.5f};
  const Skin wood = builder.Pick(assets.woods);
  builder.AddBox(frame, {-0.22f, -0.22f, 0.40f}, {0.22f, 0.22f, 0.46f}, cloth, cloth);
  builder.AddBox(frame, {-0.21f, 0.19f, 0.46f}, {0.21f, 0.23f, 0.92f}, cloth, cloth);
  for (const float x : {-0.2f, 0.16f}) {
    for (const float y : {-0.2f, 0.16f})
      builder.AddBox(frame, {x, y, 0}, {x + 0.04f, y + 0.04f, 0.4f}, wood, wood);
  }
  builder.FinishMesh();
}

void AddPlant(SceneBuilder& builder, const Assets& assets, const Affine3f& frame, float height) {
  const Skin pot{builder.Pick(assets.packages), 0};
  AddStanding(builder, At(frame, {0, 0.17f, 0}), {0.28f, 0.28f, 0.3f}, pot, pot);
  const int leaves = static_cast<int>(45 * height);
  for (int i = 0; i < leaves; ++i) {
    const float angle = builder.Uniform(0, 6.28f), rise = builder.Uniform(0.35f, height),
                tilt = builder.Uniform(-0.2f, 0.9f);
    const float length = builder.Uniform(0.14f, 0.3f), width = builder.Uniform(0.05f, 0.11f);
    const float reach = builder.Uniform(0.0f, 0.12f);
    const Vector3f out(std::cos(angle), std::sin(angle), 0), side(-std::sin(angle), std::cos(angle), 0);
    const Vector3f root = Vector3f(0, 0.17f, rise) + reach * out;
    const Vector3f along = length * (std::cos(tilt) * out + std::sin(tilt) * Vector3f::UnitZ());
    builder.AddQuad(frame * Vector3f(root - 0.5f * width * side), frame.linear() * (width * side),
                    frame.linear() * along, assets.leaf);
  }
  builder.AddBox(frame, {-0.012f, 0.158f, 0.3f}, {0.012f, 0.182f, height}, assets.leaf, assets.leaf);
  builder.FinishMesh();
}

void AddCabinet(SceneBuilder& builder, const Assets& assets, const Affine3f& frame, float width, float height,
                float depth) {
  const Skin wood = builder.Pick(assets.woods);
  const float half = 0.5f * width;
  builder.AddBox(frame, {-half, 0.01f, 0.06f}, {half, depth, height}, wood, wood);
  const int doors = std::max(1, static_cast<int>(width / 0.4f));
  const float step = width / static_cast<float>(doors);
  for (int i = 0; i < doors; ++i) {
    const float x = -half + static_cast<float>(i) * step;
    builder.AddBox(frame, {x + 0.008f, -0.01f, 0.07f}, {x + step - 0.008f, 0.01f, height - 0.015f}, wood,
                   wood);
    builder.AddBox(frame, {x + step - 0.06f, -0.03f, 0.7f * height},
                   {x + step - 0.045f, -0.01f, 0.82f * height}, assets.metal, assets.metal);
  }
  AddClutter(builder, assets, frame, -half + 0.1f, half - 0.1f, 0.1f, depth - 0.06f, height,
             static_cast<int>(6 * width));
  builder.FinishMesh();
}

void AddPoster(SceneBuilder& builder, uint32_t texture, const Affine3f& frame, float width, float height,
               float bottom) {
  const Skin skin{texture, 0};
  builder.AddBox(frame, {-0.5f * width, -0.02f, bottom}, {0.5f * width, 0.0f, bottom + height}, skin, skin);
  builder.FinishMesh();
}

void AddDoor(SceneBuilder& builder, const Assets& assets, const Affine3f& frame) {
  builder.AddBox(frame, {-0.48f, -0.035f, 0}, {0.48f, 0, 2.05f}, assets.door, builder.Pick(assets.woods));
  builder.FinishMesh();
}

void AddRadiator(SceneBuilder& builder, const Assets& assets, const Affine3f& frame, float width) {
  for (float x = -0.5f * width; x < 0.5f * width; x += 0.06f) {
    builder.AddBox(frame, {x, -0.12f, 0.12f}, {x + 0.04f, -0.03f, 0.62f}, assets.metal, assets.metal);
  }
  builder.FinishMesh();
}

void AddPileOfBoxes(SceneBuilder& builder, const Assets& assets, const Affine3f& frame) {
  float z = 0;
  for (int i = 0; i < 4; ++i) {
    const float height = builder.Uniform(0.2f, 0.38f);
    const Skin skin{builder.Pick(assets.packages), 0};
    AddStanding(builder, At(frame, {builder.Uniform(-0.05f, 0.05f), 0.2f, z}, builder.Uniform(-0.25f, 0.25f)),
                {builder.Uniform(0.3f, 0.45f), builder.Uniform(0.28f, 0.36f), height}, skin, skin);
    z += height;
    if (builder.Chance(0.25)) break;
  }
  builder.FinishMesh();
}

}  // namespace dmslam
