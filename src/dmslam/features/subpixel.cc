#include "dmslam/features/subpixel.h"

#include <algorithm>

namespace dmslam {

SubpixelOffset RefineMaximum(const uint8_t* scores) {
  // Six times the gradient, six times the second derivatives along the axes, four times the mixed one; in
  // integers.
  int gradient_x = 0, gradient_y = 0, curvature_x = 0, curvature_y = 0, mixed = 0;
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      const int score = scores[3 * (y + 1) + x + 1];
      gradient_x += x * score;
      gradient_y += y * score;
      curvature_x += (6 * x * x - 4) * score;
      curvature_y += (6 * y * y - 4) * score;
      mixed += x * y * score;
    }
  }
  const double gx = gradient_x / 6.0, gy = gradient_y / 6.0;
  const double hxx = curvature_x / 6.0, hyy = curvature_y / 6.0, hxy = mixed / 4.0;
  const double determinant = hxx * hyy - hxy * hxy;
  if (determinant <= 0.0 || hxx >= 0.0) return {};
  constexpr double kFarthest = 0.7;
  return {std::clamp((hxy * gy - hyy * gx) / determinant, -kFarthest, kFarthest),
          std::clamp((hxy * gx - hxx * gy) / determinant, -kFarthest, kFarthest)};
}

}  // namespace dmslam
