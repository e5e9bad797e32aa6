#include "dmslam/synthetic/texture.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

uint32_t Pack(const Rgb& color) {
  const auto byte = [](float value) { return static_cast<uint32_t>(std::clamp(value + 0.5f, 0.0f, 255.0f)); };
  return byte(color.x()) | (byte(color.y()) << 8) | (byte(color.z()) << 16);
}

/// Between two packed colours, `t` in 0..256.
uint32_t Mix(uint32_t a, uint32_t b, uint32_t t) {
  constexpr uint32_t kRedBlue = 0x00ff00ff;
  const uint32_t red_blue = (((a & kRedBlue) * (256 - t) + (b & kRedBlue) * t) >> 8) & kRedBlue;
  const uint32_t green = (((a >> 8) & 0xff) * (256 - t) + ((b >> 8) & 0xff) * t) & 0xff00;
  return red_blue | green;
}

/// std::floor without the library call that it costs where the CPU's own instruction may not be assumed.
int32_t FloorToInt(float value) {
  const auto truncated = static_cast<int32_t>(value);
  return truncated - (value < static_cast<float>(truncated) ? 1 : 0);
}

/// Half the size along the sides that are longer than one pixel.
Canvas Halve(const Canvas& from) {
  const int step_x = from.width() > 1 ? 2 : 1, step_y = from.height() > 1 ? 2 : 1;
  Canvas half(from.width() / step_x, from.height() / step_y);
  for (int y = 0; y < half.height(); ++y) {
    for (int x = 0; x < half.width(); ++x) {
      const int x0 = x * step_x, y0 = y * step_y, x1 = x0 + step_x - 1, y1 = y0 + step_y - 1;
      half.at(x, y) = 0.25f * (from.at(x0, y0) + from.at(x1, y0) + from.at(x0, y1) + from.at(x1, y1));
    }
  }
  return half;
}

}  // namespace

Canvas::Canvas(int width, int height, const Rgb& fill)
    : width_(width), height_(height), pixels_(static_cast<size_t>(width) * static_cast<size_t>(height), fill) {}

void Canvas::Blend(int x, int y, const Rgb& color, float opacity) { at(x, y) += opacity * (color - at(x, y)); }

void Canvas::FillRect(float x0, float y0, float x1, float y1, const Rgb& color, float opacity) {
  const int left = std::max(0, static_cast<int>(std::ceil(x0))), right = std::min(width_, static_cast<int>(std::ceil(x1)));
  const int top = std::max(0, static_cast<int>(std::ceil(y0))), bottom = std::min(height_, static_cast<int>(std::ceil(y1)));
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) Blend(x, y, color, opacity);
  }
}

void Canvas::FillEllipse(float cx, float cy, float rx, float ry, const Rgb& color, float opacity) {
  const int top = std::max(0, static_cast<int>(cy - ry)), bottom = std::min(height_ - 1, static_cast<int>(cy + ry) + 1);
  for (int y = top; y <= bottom; ++y) {
    const float dy = (static_cast<float>(y) - cy) / ry;
    const float half = 1.0f - dy * dy;
    if (half <= 0.0f) continue;
    const float reach = rx * std::sqrt(half);
    const int left = std::max(0, static_cast<int>(std::ceil(cx - reach)));
    const int right = std::min(width_ - 1, static_cast<int>(cx + reach));
    for (int x = left; x <= right; ++x) Blend(x, y, color, opacity);
  }
}

void Canvas::FillTriangle(const Eigen::Vector2f& a, const Eigen::Vector2f& b, const Eigen::Vector2f& c,
                          const Rgb& color, float opacity) {
  const Eigen::Vector2f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  const auto side = [](const Eigen::Vector2f& p, const Eigen::Vector2f& q, float x, float y) {
    return (q.x() - p.x()) * (y - p.y()) - (q.y() - p.y()) * (x - p.x());
  };
  for (int y = std::max(0, static_cast<int>(low.y())); y <= std::min(height_ - 1, static_cast<int>(high.y())); ++y) {
    for (int x = std::max(0, static_cast<int>(low.x())); x <= std::min(width_ - 1, static_cast<int>(high.x())); ++x) {
      const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
      const float s0 = side(a, b, fx, fy), s1 = side(b, c, fx, fy), s2 = side(c, a, fx, fy);
      if ((s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0)) Blend(x, y, color, opacity);
    }
  }
}

void Canvas::DrawLine(const Eigen::Vector2f& a, const Eigen::Vector2f& b, float thickness, const Rgb& color,
                      float opacity) {
  const Eigen::Vector2f along = b - a;
  const float length = along.norm();
  if (!(length > 1e-6f)) return;
  const Eigen::Vector2f across = Eigen::Vector2f(-along.y(), along.x()) * (0.5f * thickness / length);
  FillTriangle(a - across, a + across, b + across, color, opacity);
  FillTriangle(a - across, b + across, b - across, color, opacity);
}

void Canvas::Smooth() {
  std::vector<Rgb> row(static_cast<size_t>(std::max(width_, height_)));
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      row[static_cast<size_t>(x)] =
          0.25f * at((x + width_ - 1) % width_, y) + 0.5f * at(x, y) + 0.25f * at((x + 1) % width_, y);
    }
    for (int x = 0; x < width_; ++x) at(x, y) = row[static_cast<size_t>(x)];
  }
  for (int x = 0; x < width_; ++x) {
    for (int y = 0; y < height_; ++y) {
      row[static_cast<size_t>(y)] =
          0.25f * at(x, (y + height_ - 1) % height_) + 0.5f * at(x, y) + 0.25f * at(x, (y + 1) % height_);
    }
    for (int y = 0; y < height_; ++y) at(x, y) = row[static_cast<size_t>(y)];
  }
}

Texture::Texture(const Canvas& canvas) : width_(canvas.width()), height_(canvas.height()) {
  DMSLAM_CHECK(std::has_single_bit(static_cast<unsigned>(width_)) && std::has_single_bit(static_cast<unsigned>(height_)),
               "the sides of a texture must be powers of two");
  Canvas level = canvas;
  while (true) {
    levels_.push_back({texels_.size(), std::countr_zero(static_cast<unsigned>(level.width())),
                       std::countr_zero(static_cast<unsigned>(level.height()))});
    for (int y = 0; y < level.height(); ++y) {
      for (int x = 0; x < level.width(); ++x) texels_.push_back(Pack(level.at(x, y)));
    }
    if (level.width() == 1 && level.height() == 1) break;
    level = Halve(level);
  }
}

uint32_t Texture::SampleLevel(const Level& level, float scale, float u_texels, float v_texels) const {
  // Texel centres lie at half-integers; fixed point with eight bits of fraction.
  const auto u = FloorToInt((u_texels * scale - 0.5f) * 256.0f);
  const auto v = FloorToInt((v_texels * scale - 0.5f) * 256.0f);
  const uint32_t mask_x = (1u << level.width_bits) - 1, mask_y = (1u << level.height_bits) - 1;
  const auto x0 = static_cast<uint32_t>(u >> 8) & mask_x, y0 = static_cast<uint32_t>(v >> 8) & mask_y;
  const uint32_t x1 = (x0 + 1) & mask_x, y1 = (y0 + 1) & mask_y;
  const auto tx = static_cast<uint32_t>(u) & 0xff, ty = static_cast<uint32_t>(v) & 0xff;
  const uint32_t* row0 = texels_.data() + level.offset + (static_cast<size_t>(y0) << level.width_bits);
  const uint32_t* row1 = texels_.data() + level.offset + (static_cast<size_t>(y1) << level.width_bits);
  return Mix(Mix(row0[x0], row0[x1], tx), Mix(row1[x0], row1[x1], tx), ty);
}

uint32_t Texture::Sample(float u_texels, float v_texels, float level_of_detail) const {
  const auto top = static_cast<int>(levels_.size()) - 1;
  if (!(level_of_detail > 0.0f)) return SampleLevel(levels_[0], 1.0f, u_texels, v_texels);
  const int level = std::min(static_cast<int>(level_of_detail), top);
  const float scale = 1.0f / static_cast<float>(1 << level);
  const uint32_t fine = SampleLevel(levels_[static_cast<size_t>(level)], scale, u_texels, v_texels);
  if (level == top) return fine;
  const auto t = static_cast<uint32_t>((level_of_detail - static_cast<float>(level)) * 256.0f);
  if (t == 0) return fine;
  return Mix(fine, SampleLevel(levels_[static_cast<size_t>(level) + 1], 0.5f * scale, u_texels, v_texels), t);
}

}  // namespace dmslam
