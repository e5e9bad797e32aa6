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

  /// Fills the part of a rectangle, disc, triangle or line that lies on the canvas; sizes and positions in
  /// pixels. `opacity` 1 replaces, 0 leaves.
  void FillRect(float x0, float y0, float x1, float y1, const Rgb& color, float opacity = 1.0f);
  void FillEllipse(float cx, float cy, float rx, float ry, const Rgb& color, float opacity = 1.0f);
  void FillTriangle(const Eigen::Vector2f& a, const Eigen::Vector2f& b, const Eigen::Vector2f& c,
                    const Rgb& color, float opacity = 1.0f);
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

/// An immutable picture with its halvings (mip levels), that repeats in both directions. Sides are powers of
/// two.
class Texture {
 public:
  explicit Texture(const Canvas& canvas);

  int width() const { return width_; }
  int height() const { return height_; }
  int levels() const { return static_cast<int>(levels_.size()); }
  /// Colour at (u, v), in texels of level 0, as the given level has it (0 sharp, 1 half the resolution, ...;
  /// 0 <= level < levels()), interpolated between its texels. Packed 0x00BBGGRR.
  uint32_t Sample(float u_texels, float v_texels, int level) const {
    const Level& at = levels_[static_cast<size_t>(level)];
    // Texel centres lie at half-integers; fixed point with eight bits of fraction.
    const int32_t u = FloorToInt((u_texels * at.scale - 0.5f) * 256.0f);
    const int32_t v = FloorToInt((v_texels * at.scale - 0.5f) * 256.0f);
    const uint32_t x0 = static_cast<uint32_t>(u >> 8) & at.mask_x, x1 = (x0 + 1) & at.mask_x;
    const uint32_t y0 = static_cast<uint32_t>(v >> 8) & at.mask_y, y1 = (y0 + 1) & at.mask_y;
    const uint32_t tx = static_cast<uint32_t>(u) & 0xff, ty = static_cast<uint32_t>(v) & 0xff;
    const uint32_t* texels = texels_.data() + at.offset;
    const uint32_t a = texels[(y0 << at.width_bits) + x0], b = texels[(y0 << at.width_bits) + x1];
    const uint32_t c = texels[(y1 << at.width_bits) + x0], d = texels[(y1 << at.width_bits) + x1];
    // Weights that sum to 256; red and blue share a multiplication, sixteen bits apart.
    const uint32_t wd = (tx * ty) >> 8, wb = tx - wd, wc = ty - wd, wa = 256 - tx - ty + wd;
    constexpr uint32_t kRedBlue = 0x00ff00ff, kGreen = 0xff;
    const uint32_t red_blue =
        (a & kRedBlue) * wa + (b & kRedBlue) * wb + (c & kRedBlue) * wc + (d & kRedBlue) * wd;
    const uint32_t green = ((a >> 8) & kGreen) * wa + ((b >> 8) & kGreen) * wb + ((c >> 8) & kGreen) * wc +
                           ((d >> 8) & kGreen) * wd;
    return ((red_blue >> 8) & kRedBlue) | (green & 0xff00);
  }

 private:
  struct Level {
    size_t offset = 0;
    uint32_t mask_x = 0, mask_y = 0;
    uint32_t width_bits = 0;
    float scale = 1.0f;
  };
  /// std::floor without the library call that it costs where the CPU's own instruction may not be assumed.
  static int32_t FloorToInt(float value) {
    const auto truncated = static_cast<int32_t>(value < -2e9f ? -2e9f : value > 2e9f ? 2e9f : value);
    return truncated - (value < static_cast<float>(truncated) ? 1 : 0);
  }

  int width_;
  int height_;
  std::vector<Level> levels_;
  std::vector<uint32_t> texels_;
};

}  // namespace dmslam
