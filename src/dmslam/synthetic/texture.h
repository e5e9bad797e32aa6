#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace dmslam {

/// Red, green, blue in 0..255.
using Rgb = Eigen::Vector3f;

/// A picture under construction: float colours, row by row.
class Canvas {
 public:
  Canvas(int width, int height, const Rgb& fill = Rgb::Zero());

  int width() const { return width_; }
  int height() const { return height_; }
  Rgb& at(int x, int y) { return pixels_[Index(x, y)]; }
  const Rgb& at(int x, int y) const { return pixels_[Index(x, y)]; }

  /// Fills the part of a rectangle, disc, triangle or line that lies on the canvas; sizes and positions in pixels.
  /// `opacity` 1 replaces, 0 leaves.
  void FillRect(float x0, float y0, float x1, float y1, const Rgb& color, float opacity = 1.0f);
  void FillEllipse(float cx, float cy, float rx, float ry, const Rgb& color, float opacity = 1.0f);
  void FillTriangle(const Eigen::Vector2f& a, const Eigen::Vector2f& b, const Eigen::Vector2f& c, const Rgb& color,
                    float opacity = 1.0f);
  void DrawLine(const Eigen::Vector2f& a, const Eigen::Vector2f& b, float thickness, const Rgb& color,
                float opacity = 1.0f);
  /// Blurs with (1 2 1)/4 in both directions, wrapping around: takes out what one pixel cannot hold.
  void Smooth();

 private:
  size_t Index(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  }
  void Blend(int x, int y, const Rgb& color, float opacity);

  int width_;
  int height_;
  std::vector<Rgb> pixels_;
};

/// An immutable picture with its halvings (mip levels), that repeats in both directions. Sides are powers of two.
class Texture {
 public:
  explicit Texture(const Canvas& canvas);

  int width() const { return width_; }
  int height() const { return height_; }
  /// Colour at (u, v), in texels of level 0, at a level of detail (0 sharp, 1 half the resolution, ...), interpolated
  /// in both directions and between levels. Packed 0x00BBGGRR.
  uint32_t Sample(float u_texels, float v_texels, float level_of_detail) const;

 private:
  struct Level {
    size_t offset = 0;
    int width_bits = 0, height_bits = 0;
  };
  uint32_t SampleLevel(const Level& level, float scale, float u_texels, float v_texels) const;

  int width_;
  int height_;
  std::vector<Level> levels_;
  std::vector<uint32_t> texels_;
};

}  // namespace dmslam
