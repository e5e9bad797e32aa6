#include "dmslam/synthetic/paint.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace dmslam {
namespace {

float Uniform(Random& random, float low, float high) { return static_cast<float>(random.Uniform(low, high)); }
float F(int value) { return static_cast<float>(value); }
int Between(Random& random, int low, int high) {
  return low + static_cast<int>(random.Below(static_cast<uint32_t>(high - low + 1)));
}
bool Chance(Random& random, double probability) { return random.Uniform() < probability; }
Rgb Grey(float value) { return Rgb::Constant(value); }
Rgb Around(Random& random, const Rgb& color, float spread) {
  const float common = Uniform(random, -spread, spread), tint = 0.4f * spread;
  return color + Rgb(common + Uniform(random, -tint, tint), common + Uniform(random, -tint, tint),
                     common + Uniform(random, -tint, tint));
}

/// Adds one layer of smooth noise on a lattice of nx x ny cells that wraps around.
void AddLattice(std::vector<float>& out, int width, int height, int nx, int ny, float amplitude,
                Random& random) {
  std::vector<float> lattice(static_cast<size_t>(nx) * static_cast<size_t>(ny));
  for (float& value : lattice) value = amplitude * Uniform(random, -1.7f, 1.7f);
  const auto smooth = [](float t) { return t * t * (3.0f - 2.0f * t); };
  std::vector<float> weights(static_cast<size_t>(width));
  std::vector<int> cells(static_cast<size_t>(width));
  for (int x = 0; x < width; ++x) {
    const float at = F(x) * F(nx) / F(width);
    cells[static_cast<size_t>(x)] = static_cast<int>(at);
    weights[static_cast<size_t>(x)] = smooth(at - F(static_cast<int>(at)));
  }
  for (int y = 0; y < height; ++y) {
    const float at = F(y) * F(ny) / F(height);
    const int cell = static_cast<int>(at);
    const float* row0 = &lattice[static_cast<size_t>(cell) * static_cast<size_t>(nx)];
    const float* row1 = &lattice[static_cast<size_t>((cell + 1) % ny) * static_cast<size_t>(nx)];
    const float ty = smooth(at - F(cell));
    float* to = &out[static_cast<size_t>(y) * static_cast<size_t>(width)];
    for (int x = 0; x < width; ++x) {
      const int x0 = cells[static_cast<size_t>(x)], x1 = x0 + 1 == nx ? 0 : x0 + 1;
      const float tx = weights[static_cast<size_t>(x)];
      const float top = row0[x0] + tx * (row0[x1] - row0[x0]), bottom = row1[x0] + tx * (row1[x1] - row1[x0]);
      to[x] += top + ty * (bottom - top);
    }
  }
}

void AddNoise(Canvas& canvas, int cells, int octaves, float gain, const Rgb& amplitude, Random& random) {
  const std::vector<float> noise =
      FractalNoise(canvas.width(), canvas.height(), cells, octaves, gain, random);
  size_t i = 0;
  for (int y = 0; y < canvas.height(); ++y) {
    for (int x = 0; x < canvas.width(); ++x) canvas.at(x, y) += amplitude * noise[i++];
  }
}

/// Small marks as use leaves them: specks, scratches, stains.
void AddMarks(Canvas& canvas, int count, float contrast, Random& random) {
  for (int i = 0; i < count; ++i) {
    const float x = Uniform(random, 0, F(canvas.width())), y = Uniform(random, 0, F(canvas.height()));
    const Rgb color = Grey(Chance(random, 0.7) ? 30.0f : 235.0f);
    const float opacity = contrast * Uniform(random, 0.2f, 1.0f);
    if (Chance(random, 0.6)) {
      canvas.FillEllipse(x, y, Uniform(random, 1.0f, 4.0f), Uniform(random, 1.0f, 4.0f), color, opacity);
    } else {
      const float angle = Uniform(random, 0, 6.28f), length = Uniform(random, 6, 40);
      canvas.DrawLine({x, y}, {x + length * std::cos(angle), y + length * std::sin(angle)},
                      Uniform(random, 1.0f, 2.5f), color, opacity);
    }
  }
}

/// One letter-like figure: a few strokes on a grid of three by five.
void DrawGlyph(Canvas& canvas, float x, float y, float size, const Rgb& color, Random& random) {
  const float thickness = std::max(1.2f, 0.17f * size);
  const int strokes = Between(random, 2, 4);
  const auto point = [&] {
    return Eigen::Vector2f(x + 0.27f * size * F(Between(random, 0, 2)),
                           y + 0.25f * size * F(Between(random, 0, 4)));
  };
  for (int i = 0; i < strokes; ++i) canvas.DrawLine(point(), point(), thickness, color, 0.9f);
}

/// Lines of text in a box; the last line of a paragraph is shorter.
void DrawText(Canvas& canvas, float x0, float y0, float x1, float y1, float size, const Rgb& color,
              Random& random) {
  for (float y = y0; y + size < y1; y += 1.65f * size) {
    const float end = Chance(random, 0.2) ? x0 + Uniform(random, 0.3f, 0.8f) * (x1 - x0) : x1;
    for (float x = x0; x + 0.8f * size < end; x += 0.85f * size) {
      if (!Chance(random, 0.17)) DrawGlyph(canvas, x, y, size, color, random);
    }
  }
}

void DrawFrame(Canvas& canvas, float thickness, const Rgb& color) {
  const float w = F(canvas.width()), h = F(canvas.height());
  canvas.FillRect(0, 0, w, thickness, color);
  canvas.FillRect(0, h - thickness, w, h, color);
  canvas.FillRect(0, 0, thickness, h, color);
  canvas.FillRect(w - thickness, 0, w, h, color);
}

/// Something like a photograph: two colour fields, things with shaded edges before them, fine grain.
void DrawPhoto(Canvas& canvas, int x0, int y0, int x1, int y1, Random& random) {
  const int width = x1 - x0, height = y1 - y0;
  if (width < 8 || height < 8) return;
  const std::vector<float> field = FractalNoise(width, height, 4, 7, 0.62f, random);
  const std::vector<float> hue = FractalNoise(width, height, 3, 3, 0.5f, random);
  const Rgb dark = 0.5f * RandomColor(random), light = RandomColor(random) + Grey(75),
            other = RandomColor(random);
  Canvas part(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t i = static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
      const float t = std::clamp(0.5f + 0.3f * field[i], 0.0f, 1.0f),
                  s = std::clamp(0.3f + 0.4f * hue[i], 0.0f, 0.8f);
      part.at(x, y) = (1 - s) * (dark + t * (light - dark)) + s * t * other;
    }
  }
  const int things = Between(random, 8, 22);
  for (int i = 0; i < things; ++i) {
    const float cx = Uniform(random, 0, F(width)), cy = Uniform(random, 0, F(height));
    const float r = F(std::min(width, height)) * Uniform(random, 0.02f, 0.2f);
    const Rgb color = Around(random, Chance(random, 0.5) ? dark : light, 50);
    const float opacity = Uniform(random, 0.5f, 1.0f);
    const auto corner = [&] {
      return Eigen::Vector2f(cx + Uniform(random, -r, r), cy + Uniform(random, -r, r));
    };
    if (Chance(random, 0.4)) {
      part.FillEllipse(cx, cy, r, r * Uniform(random, 0.4f, 1.0f), color, opacity);
    } else {
      const Eigen::Vector2f a = corner(), b = corner(), c = corner(), d = corner();
      part.FillTriangle(a, b, c, color, opacity);
      if (Chance(random, 0.6)) part.FillTriangle(b, c, d, Around(random, color, 20), opacity);
    }
  }
  AddNoise(part, std::max(8, width / 8), 3, 0.8f, Grey(7), random);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) canvas.at(x0 + x, y0 + y) = part.at(x, y);
  }
}

void DrawMosaic(Canvas& canvas, Random& random) {
  const int columns = Between(random, 4, 9);
  const float step = F(canvas.width()) / F(columns);
  const Rgb base = RandomColor(random);
  std::vector<Eigen::Vector2f> grid;
  const int rows = static_cast<int>(F(canvas.height()) / step) + 2;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      grid.emplace_back((F(i) + Uniform(random, -0.3f, 0.3f)) * step,
                        (F(j) + Uniform(random, -0.3f, 0.3f)) * step);
    }
  }
  for (int j = 0; j + 1 < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const auto at = [&](int di, int dj) {
        return grid[static_cast<size_t>((j + dj) * (columns + 1) + i + di)];
      };
      canvas.FillTriangle(at(0, 0), at(1, 0), at(0, 1), Around(random, base, 70));
      canvas.FillTriangle(at(1, 0), at(1, 1), at(0, 1), Around(random, base, 70));
    }
  }
}

void DrawMap(Canvas& canvas, Random& random) {
  const int width = canvas.width(), height = canvas.height();
  const std::vector<float> field = FractalNoise(width, height, 3, 5, 0.5f, random);
  const Rgb land = Rgb(205, 210, 175), water = Rgb(130, 165, 200), contour = Rgb(150, 120, 85);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float value = field[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
      const float phase = 4.0f * value - std::floor(4.0f * value);
      canvas.at(x, y) = value < -0.5f ? water : (phase < 0.12f ? contour : Rgb(land + Grey(18.0f * value)));
    }
  }
  for (int road = 0; road < 12; ++road) {
    Eigen::Vector2f at(Uniform(random, 0, F(width)), Uniform(random, 0, F(height)));
    float angle = Uniform(random, 0, 6.28f);
    const Rgb color = Chance(random, 0.5) ? Rgb(200, 70, 50) : Rgb(60, 60, 70);
    for (int leg = 0; leg < 14; ++leg) {
      angle += Uniform(random, -0.6f, 0.6f);
      const Eigen::Vector2f next =
          at + Uniform(random, 10, 40) * Eigen::Vector2f(std::cos(angle), std::sin(angle));
      canvas.DrawLine(at, next, 2.2f, color);
      at = next;
    }
  }
  for (int town = 0; town < 40; ++town) {
    const float x = Uniform(random, 0, F(width)), y = Uniform(random, 0, F(height));
    canvas.FillEllipse(x, y, 3, 3, Grey(40));
    DrawText(canvas, x + 5, y - 4, x + Uniform(random, 25, 60), y + 6, 7, Grey(30), random);
  }
}

void DrawNotices(Canvas& canvas, Random& random) {
  canvas.FillRect(0, 0, F(canvas.width()), F(canvas.height()), Rgb(150, 115, 75));
  AddNoise(canvas, 32, 4, 0.9f, Grey(10), random);
  const int sheets = Between(random, 7, 14);
  for (int i = 0; i < sheets; ++i) {
    const float w = Uniform(random, 0.15f, 0.4f) * F(canvas.width()), h = w * Uniform(random, 0.6f, 1.5f);
    const float x = Uniform(random, 0.02f, 0.95f) * F(canvas.width()) - 0.3f * w;
    const float y = Uniform(random, 0.02f, 0.95f) * F(canvas.height()) - 0.3f * h;
    canvas.FillRect(x + 2, y + 3, x + w + 2, y + h + 3, Grey(20), 0.4f);
    canvas.FillRect(x, y, x + w, y + h, Around(random, Rgb(225, 222, 205), 25));
    if (Chance(random, 0.4)) {
      canvas.FillRect(x + 0.1f * w, y + 0.08f * h, x + 0.9f * w, y + 0.45f * h, RandomColor(random));
      DrawText(canvas, x + 0.1f * w, y + 0.5f * h, x + 0.9f * w, y + 0.95f * h, 6, Grey(40), random);
    } else {
      DrawText(canvas, x + 0.1f * w, y + 0.1f * h, x + 0.9f * w, y + 0.95f * h, Uniform(random, 5, 9),
               Grey(40), random);
    }
    canvas.FillEllipse(x + 0.5f * w, y + 3, 2.5f, 2.5f, RandomColor(random));
  }
}

}  // namespace

std::vector<float> FractalNoise(int width, int height, int cells, int octaves, float gain, Random& random) {
  std::vector<float> noise(static_cast<size_t>(width) * static_cast<size_t>(height), 0.0f);
  const int longer = std::max(width, height);
  float amplitude = 1.0f, power = 0.0f;
  for (int octave = 0; octave < octaves; ++octave, cells *= 2, amplitude *= gain) {
    if (cells > longer) break;
    const int nx = std::max(1, cells * width / longer), ny = std::max(1, cells * height / longer);
    AddLattice(noise, width, height, nx, ny, amplitude, random);
    power += 0.52f * amplitude * amplitude;  // Interpolation leaves about half of the lattice's variance.
  }
  const float scale = 1.0f / std::sqrt(std::max(power, 1e-6f));
  for (float& value : noise) value *= scale;
  return noise;
}

Rgb RandomColor(Random& random) {
  const float value = Uniform(random, 50, 210), saturation = Uniform(random, 0.1f, 0.75f),
              hue = Uniform(random, 0, 3);
  Rgb color;
  for (int i = 0; i < 3; ++i) {
    const float distance = std::min(std::abs(hue - F(i)), 3.0f - std::abs(hue - F(i)));
    color[i] = value * (1.0f - saturation * std::min(1.0f, distance));
  }
  return color;
}

Canvas PaintPlaster(int size, const Rgb& base, Random& random) {
  Canvas canvas(size, size, base);
  AddNoise(canvas, 3, 8, 0.8f, Rgb(9, 9, 9.5f), random);
  AddMarks(canvas, size / 4, 0.3f, random);
  canvas.Smooth();
  return canvas;
}

Canvas PaintWallpaper(int size, const Rgb& base, Random& random) {
  Canvas canvas(size, size, base);
  const int cells = 4;
  const float step = F(size) / F(cells);
  const Rgb motif = Around(random, base, 40) - Grey(25);
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const float cx = (F(i) + 0.5f) * step, cy = (F(j) + 0.5f * F(1 + i % 2)) * step;
      for (int petal = 0; petal < 6; ++petal) {
        const float angle = F(petal) * 1.0472f + Uniform(random, -0.1f, 0.1f), r = 0.22f * step;
        canvas.FillEllipse(cx + r * std::cos(angle), cy + r * std::sin(angle), 0.10f * step, 0.07f * step,
                           motif, 0.6f);
      }
      canvas.FillEllipse(cx, cy, 0.08f * step, 0.08f * step, motif - Grey(25), 0.7f);
    }
  }
  AddNoise(canvas, 4, 8, 0.75f, Grey(6), random);
  AddMarks(canvas, size / 10, 0.2f, random);
  canvas.Smooth();
  return canvas;
}

Canvas PaintBricks(int size, Random& random) {
  Canvas canvas(size, size, Rgb(170, 162, 150));
  const int rows = 16, columns = 6;
  const float h = F(size) / F(rows), w = F(size) / F(columns), gap = std::max(1.5f, 0.06f * h);
  const Rgb base(150, 85, 65);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const float x = (F(i) + 0.5f * F(j % 2)) * w, y = F(j) * h;
      const Rgb color = Around(random, base, 32);
      for (const float shift : {0.0f, -F(size)}) {
        canvas.FillRect(x + shift + gap, y + gap, x + shift + w - gap * Uniform(random, 0.6f, 1.4f),
                        y + h - gap, color);
      }
    }
  }
  AddNoise(canvas, 8, 7, 0.8f, Grey(12), random);
  AddMarks(canvas, size / 4, 0.3f, random);
  canvas.Smooth();
  return canvas;
}

Canvas PaintWood(int width, int height, const Rgb& base, bool planks, Random& random) {
  Canvas canvas(width, height, base);
  // Grain: noise stretched along x.
  std::vector<float> grain(static_cast<size_t>(width) * static_cast<size_t>(height), 0.0f);
  for (int octave = 0; octave < 5; ++octave) {
    AddLattice(grain, width, height, 2 << octave, std::min(height / 2, 12 << octave),
               std::pow(0.8f, F(octave)), random);
  }
  size_t index = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) canvas.at(x, y) += Rgb(8, 7.5f, 6.5f) * grain[index++];
  }
  if (planks) {
    const int rows = std::max(2, height / 64);
    const float h = F(height) / F(rows);
    for (int j = 0; j < rows; ++j) {
      canvas.FillRect(0, F(j) * h, F(width), F(j + 1) * h, Around(random, base, 45), 0.35f);
      canvas.FillRect(0, F(j) * h, F(width), F(j) * h + 2, Grey(35), 0.7f);
      for (float x = Uniform(random, 0, 0.5f) * F(width); x < F(width);
           x += Uniform(random, 0.4f, 0.8f) * F(width)) {
        canvas.FillRect(x, F(j) * h, x + 2, F(j + 1) * h, Grey(30), 0.7f);
      }
    }
  }
  const int knots = (width * height) >> 14;
  for (int i = 0; i < knots; ++i) {
    const float x = Uniform(random, 0, F(width)), y = Uniform(random, 0, F(height)),
                r = Uniform(random, 2, 7);
    canvas.FillEllipse(x, y, 1.6f * r, r, base - Grey(50), 0.5f);
    canvas.FillEllipse(x, y, 0.8f * r, 0.5f * r, base - Grey(80), 0.6f);
  }
  AddMarks(canvas, (width + height) / 24, 0.25f, random);
  canvas.Smooth();
  return canvas;
}

Canvas PaintTiles(int size, const Rgb& base, Random& random) {
  Canvas canvas(size, size, base - Grey(60));
  const int cells = 4;
  const float step = F(size) / F(cells);
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      canvas.FillRect(F(i) * step + 1.5f, F(j) * step + 1.5f, F(i + 1) * step - 1.5f, F(j + 1) * step - 1.5f,
                      Around(random, base, 14));
    }
  }
  AddNoise(canvas, 12, 7, 0.85f, Grey(9), random);
  AddMarks(canvas, size / 5, 0.3f, random);
  canvas.Smooth();
  return canvas;
}

Canvas PaintCarpet(int size, const Rgb& base, Random& random) {
  Canvas canvas(size, size, base);
  for (int i = 0; i < size / 5; ++i) {
    canvas.FillEllipse(Uniform(random, 0, F(size)), Uniform(random, 0, F(size)), Uniform(random, 3, 22),
                       Uniform(random, 3, 22), Around(random, base, 45), 0.5f);
  }
  AddNoise(canvas, 6, 8, 0.95f, Rgb(10, 9, 9), random);
  canvas.Smooth();
  return canvas;
}

Canvas PaintPage(int width, int height, Random& random) {
  Canvas canvas(width, height, Around(random, Rgb(222, 220, 208), 16));
  const float w = F(width), h = F(height), margin = 0.08f * w;
  DrawText(canvas, margin, 0.05f * h, w - margin, 0.15f * h, 0.07f * h, 0.4f * RandomColor(random), random);
  const int blocks = Between(random, 2, 4);
  const float block_height = 0.78f * h / F(blocks);
  for (int i = 0; i < blocks; ++i) {
    const float y0 = 0.18f * h + F(i) * block_height, y1 = y0 + 0.92f * block_height;
    const float split = margin + Uniform(random, 0.3f, 0.7f) * (w - 2 * margin);
    const float text_size = Uniform(random, 6.0f, 11.0f);
    const bool picture_left = Chance(random, 0.5);
    const float px0 = picture_left ? margin : split + 4, px1 = picture_left ? split - 4 : w - margin;
    const float tx0 = picture_left ? split + 4 : margin, tx1 = picture_left ? w - margin : split - 4;
    DrawPhoto(canvas, static_cast<int>(px0), static_cast<int>(y0), static_cast<int>(px1),
              static_cast<int>(y1), random);
    DrawText(canvas, tx0, y0, tx1, y1, text_size, Grey(40), random);
  }
  canvas.Smooth();
  return canvas;
}

Canvas PaintPoster(int width, int height, Random& random) {
  const double kind = random.Uniform();
  Canvas canvas(width, height, Grey(128));
  if (kind < 0.22)
    canvas = PaintPage(width, height, random);
  else if (kind < 0.40)
    DrawMosaic(canvas, random);
  else if (kind < 0.55)
    DrawMap(canvas, random);
  else if (kind < 0.75)
    DrawNotices(canvas, random);
  else
    DrawPhoto(canvas, 0, 0, width, height, random);
  AddNoise(canvas, 16, 5, 0.9f, Grey(4), random);
  DrawFrame(canvas, 0.025f * F(width),
            Around(random, Chance(random, 0.5) ? Grey(45) : Rgb(150, 110, 70), 20));
  canvas.Smooth();
  return canvas;
}

Canvas PaintBookSpine(int width, int height, Random& random) {
  const Rgb base = RandomColor(random);
  Canvas canvas(width, height, base);
  const Rgb ink = base.sum() > 330 ? Grey(25) : Rgb(225, 215, 170);
  const float w = F(width), h = F(height);
  for (const float y : {0.05f, 0.12f, 0.86f}) {
    if (Chance(random, 0.7)) canvas.FillRect(0, y * h, w, (y + 0.015f) * h, ink, 0.8f);
  }
  // The title runs along the spine: glyphs below one another.
  const float size = 0.55f * w, end = Uniform(random, 0.5f, 0.8f) * h;
  for (float y = 0.17f * h; y < end; y += 0.75f * size)
    DrawGlyph(canvas, 0.2f * w, y, size * 0.65f, ink, random);
  if (Chance(random, 0.5)) canvas.FillEllipse(0.5f * w, 0.92f * h, 0.25f * w, 0.25f * w, ink, 0.7f);
  canvas.FillRect(0, 0, 2, h, Grey(20), 0.6f);
  canvas.FillRect(w - 2, 0, w, h, Grey(20), 0.6f);
  AddNoise(canvas, 8, 5, 0.9f, Grey(6), random);
  return canvas;
}

Canvas PaintPackage(int width, int height, Random& random) {
  const bool cardboard = Chance(random, 0.3);
  const Rgb base = cardboard ? Rgb(165, 130, 90) : RandomColor(random);
  Canvas canvas(width, height, base);
  const float w = F(width), h = F(height);
  const Rgb ink = base.sum() > 330 ? Grey(30) : Grey(225);
  for (int i = 0; i < 3; ++i) {
    canvas.FillEllipse(Uniform(random, 0, w), Uniform(random, 0, h), Uniform(random, 0.05f, 0.3f) * w,
                       Uniform(random, 0.05f, 0.3f) * h, RandomColor(random), cardboard ? 0.1f : 0.8f);
  }
  DrawText(canvas, 0.08f * w, 0.08f * h, 0.92f * w, 0.4f * h, Uniform(random, 0.12f, 0.22f) * h, ink, random);
  DrawText(canvas, 0.08f * w, 0.6f * h, Uniform(random, 0.4f, 0.7f) * w, 0.93f * h, Uniform(random, 6, 10),
           ink, random);
  for (float x = 0.72f * w; x < 0.92f * w; x += Uniform(random, 2.5f, 6.0f)) {
    canvas.FillRect(x, 0.7f * h, x + Uniform(random, 1.5f, 3.5f), 0.92f * h, Grey(25));
  }
  AddNoise(canvas, 6, 7, 0.8f, Grey(7), random);
  DrawFrame(canvas, 2, base - Grey(40));
  canvas.Smooth();
  return canvas;
}

Canvas PaintScreen(int width, int height, Random& random) {
  Canvas canvas(width, height, Rgb(60, 85, 120));
  const float w = F(width), h = F(height);
  DrawPhoto(canvas, 0, 0, width, height, random);
  for (int i = 0; i < 4; ++i) {
    const float x = Uniform(random, 0.02f, 0.6f) * w, y = Uniform(random, 0.02f, 0.55f) * h;
    const float x1 = x + Uniform(random, 0.25f, 0.5f) * w, y1 = y + Uniform(random, 0.25f, 0.5f) * h;
    const bool dark = Chance(random, 0.4);
    canvas.FillRect(x, y, x1, y1, dark ? Grey(35) : Grey(225));
    canvas.FillRect(x, y, x1, y + 0.04f * h, RandomColor(random));
    DrawText(canvas, x + 5, y + 0.06f * h, x1 - 5, y1 - 5, Uniform(random, 6, 9), dark ? Grey(190) : Grey(50),
             random);
  }
  canvas.FillRect(0, 0.95f * h, w, h, Grey(50));
  DrawFrame(canvas, 0.03f * w, Grey(28));
  canvas.Smooth();
  return canvas;
}

Canvas PaintKeyboard(int width, int height, Random& random) {
  Canvas canvas(width, height, Grey(45));
  const int columns = 15, rows = 5;
  const float w = F(width) / F(columns), h = F(height) / F(rows);
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const float x = F(i) * w, y = F(j) * h;
      canvas.FillRect(x + 1.5f, y + 1.5f, x + w - 1.5f, y + h - 1.5f, Around(random, Grey(80), 10));
      DrawGlyph(canvas, x + 0.3f * w, y + 0.25f * h, 0.4f * h, Grey(215), random);
    }
  }
  return canvas;
}

Canvas PaintCloth(int size, Random& random) {
  const Rgb base = RandomColor(random);
  Canvas canvas(size, size, base);
  const double kind = random.Uniform();
  const float step = F(size) / F(Between(random, 5, 9));
  const Rgb second = RandomColor(random);
  if (kind < 0.4) {
    for (float at = 0; at < F(size); at += step) {
      canvas.FillRect(at, 0, at + 0.35f * step, F(size), second, 0.6f);
      canvas.FillRect(0, at, F(size), at + 0.35f * step, second, 0.6f);
      canvas.FillRect(at + 0.6f * step, 0, at + 0.7f * step, F(size), Grey(230), 0.5f);
    }
  } else if (kind < 0.6) {
    for (float at = 0; at < F(size); at += step) canvas.FillRect(0, at, F(size), at + 0.5f * step, second);
  } else if (kind < 0.8) {
    for (int i = 0; i < 60; ++i) {
      const float r = Uniform(random, 0.05f, 0.3f) * step;
      canvas.FillEllipse(Uniform(random, 0, F(size)), Uniform(random, 0, F(size)), r, r, second);
    }
  } else {
    const float a = 0.2f * F(size), b = 0.8f * F(size);
    canvas.FillRect(a, a, b, 0.55f * F(size), second);
    DrawText(canvas, a + 4, a + 4, b - 4, 0.52f * F(size), 0.1f * F(size), Grey(240), random);
    DrawText(canvas, a, 0.6f * F(size), b, b, 0.05f * F(size), second, random);
  }
  AddNoise(canvas, 3, 7, 0.7f, Grey(14), random);
  canvas.Smooth();
  return canvas;
}

Canvas PaintLeaf(int size, Random& random) {
  const Rgb base = Around(random, Rgb(70, 110, 50), 30);
  Canvas canvas(size, size, base);
  const float s = F(size);
  canvas.DrawLine({0.5f * s, 0}, {0.5f * s, s}, 3, base + Grey(60));
  for (float y = 0.1f * s; y < s; y += 0.15f * s) {
    canvas.DrawLine({0.5f * s, y}, {0.95f * s, y + 0.2f * s}, 1.6f, base + Grey(45));
    canvas.DrawLine({0.5f * s, y}, {0.05f * s, y + 0.2f * s}, 1.6f, base + Grey(45));
  }
  AddNoise(canvas, 4, 5, 0.7f, Grey(12), random);
  return canvas;
}

Canvas PaintDoor(int width, int height, Random& random) {
  Canvas canvas = PaintWood(width, height, Around(random, Rgb(150, 115, 80), 35), false, random);
  const float w = F(width), h = F(height);
  for (const float y : {0.07f, 0.54f}) {
    const float x0 = 0.15f * w, x1 = 0.85f * w, y0 = y * h, y1 = (y + 0.38f) * h;
    canvas.FillRect(x0, y0, x1, y0 + 3, Grey(35), 0.7f);
    canvas.FillRect(x0, y0, x0 + 3, y1, Grey(35), 0.7f);
    canvas.FillRect(x0, y1 - 3, x1, y1, Grey(230), 0.5f);
    canvas.FillRect(x1 - 3, y0, x1, y1, Grey(230), 0.5f);
  }
  canvas.FillRect(0.86f * w, 0.48f * h, 0.94f * w, 0.53f * h, Grey(190));
  canvas.FillEllipse(0.9f * w, 0.55f * h, 3, 3, Grey(30));
  canvas.FillRect(0.3f * w, 0.2f * h, 0.7f * w, 0.26f * h, Grey(225));
  DrawText(canvas, 0.33f * w, 0.21f * h, 0.67f * w, 0.26f * h, 0.035f * h, Grey(30), random);
  DrawFrame(canvas, 0.04f * w, Around(random, Grey(120), 40));
  canvas.Smooth();
  return canvas;
}

Canvas PaintSkin(int size, bool face, Random& random) {
  const Rgb base = Around(random, Rgb(185, 140, 115), 35);
  Canvas canvas(size, size, base);
  const float s = F(size);
  if (face) {
    for (const float x : {0.43f, 0.57f}) {
      canvas.FillEllipse(x * s, 0.42f * s, 0.035f * s, 0.02f * s, Grey(230));
      canvas.FillEllipse(x * s, 0.42f * s, 0.016f * s, 0.02f * s, Grey(25));
      canvas.FillRect((x - 0.04f) * s, 0.36f * s, (x + 0.04f) * s, 0.375f * s, Grey(50));
    }
    canvas.FillRect(0.485f * s, 0.43f * s, 0.515f * s, 0.55f * s, base - Grey(30), 0.6f);
    canvas.FillEllipse(0.5f * s, 0.65f * s, 0.06f * s, 0.015f * s, Rgb(140, 70, 65));
  }
  AddNoise(canvas, 6, 6, 0.7f, Grey(6), random);
  canvas.Smooth();
  return canvas;
}

Canvas PaintHair(int size, Random& random) {
  Canvas canvas = PaintWood(size, size, Around(random, Rgb(70, 55, 42), 30), false, random);
  return canvas;
}

}  // namespace dmslam
