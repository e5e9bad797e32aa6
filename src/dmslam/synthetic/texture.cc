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
    : width_(width),
      height_(height),
      pixels_(static_cast<size_t>(width) * static_cast<size_t>(height), fill) {}

void Canvas::Blend(int x, int y, const Rgb& color, float opacity) {
  at(x, y) += opacity * (color - at(x, y));
}

void Canvas::FillRect(float x0, float y0, float x1, float y1, const Rgb& color, float opacity) {
  const int left = std::max(0, static_cast<int>(std::ceil(x0))),
            right = std::min(width_, static_cast<int>(std::ceil(x1)));
  const int top = std::max(0, static_cast<int>(std::ceil(y0))),
            bottom = std::min(height_, static_cast<int>(std::ceil(y1)));
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) Blend(x, y, color, opacity);
  }
}

void Canvas::FillEllipse(float cx, float cy, float rx, float ry, const Rgb& color, float opacity) {
  const int top = std::max(0, static_cast<int>(cy - ry)),
            bottom = std::min(height_ - 1, static_cast<int>(cy + ry) + 1);
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
  for (int y = std::max(0, static_cast<int>(low.y())); y <= std::min(height_ - 1, static_cast<int>(high.y()));
       ++y) {
    for (int x = std::max(0, static_cast<int>(low.x()));
         x <= std::min(width_ - 1, static_cast<int>(high.x())); ++x) {
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
  DMSLAM_CHECK(std::has_single_bit(static_cast<unsigned>(width_)) &&
                   std::has_single_bit(static_cast<unsigned>(height_)),
               "the sides of a texture must be powers of two");
  Canvas level = canvas;
  while (true) {
    const auto level_width = static_cast<uint32_t>(level.width()),
               level_height = static_cast<uint32_t>(level.height());
    levels_.push_back({texels_.size(), level_width - 1, level_height - 1,
                       static_cast<uint32_t>(std::countr_zero(level_width)),
                       1.0f / static_cast<float>(1u << levels_.size())});
    for (int y = 0; y < level.height(); ++y) {
      for (int x = 0; x < level.width(); ++x) texels_.push_back(Pack(level.at(x, y)));
    }
    if (level.width() == 1 && level.height() == 1) break;
    level = Halve(level);
  }
}

}  // namespace dmslam
