#pragma once

#include <vector>

#include "dmslam/synthetic/texture.h"
#include "dmslam/util/random.h"

namespace dmslam {

/// Fractal value noise that tiles: `octaves` layers, the first with `cells` cells along the longer side, each
/// next one twice as fine and `gain` times as strong. Mean about 0, standard deviation 1; row by row.
std::vector<float> FractalNoise(int width, int height, int cells, int octaves, float gain, Random& random);

/// Pictures of things in rooms. Each draws all it needs from `random`; sizes in texels, powers of two. They
/// hold detail at every scale down to about two texels, in mixed contrast, as photographs of real surfaces
/// do.
Canvas PaintPlaster(int size, const Rgb& base, Random& random);
Canvas PaintWallpaper(int size, const Rgb& base, Random& random);
Canvas PaintBricks(int size, Random& random);
Canvas PaintWood(int width, int height, const Rgb& base, bool planks, Random& random);
Canvas PaintTiles(int size, const Rgb& base, Random& random);
Canvas PaintCarpet(int size, const Rgb& base, Random& random);
/// A framed picture on a wall: one of photograph, printed page, mosaic, map or notice board, by chance.
Canvas PaintPoster(int width, int height, Random& random);
Canvas PaintPage(int width, int height, Random& random);
Canvas PaintBookSpine(int width, int height, Random& random);
Canvas PaintPackage(int width, int height, Random& random);
Canvas PaintScreen(int width, int height, Random& random);
Canvas PaintKeyboard(int width, int height, Random& random);
Canvas PaintCloth(int size, Random& random);
Canvas PaintLeaf(int size, Random& random);
Canvas PaintDoor(int width, int height, Random& random);
Canvas PaintSkin(int size, bool face, Random& random);
Canvas PaintHair(int size, Random& random);

/// A saturated or muted colour by chance, of middle brightness.
Rgb RandomColor(Random& random);

}  // namespace dmslam
