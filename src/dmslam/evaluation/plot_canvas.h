#pragma once

#include <optional>
#include <span>
#include <string>

#include "dmslam/evaluation/plot.h"

namespace dmslam {

struct PlotPoint {
  double x;
  double y;
};

struct PlotBox {
  double x;
  double y;
  double width;
  double height;
  double right() const { return x + width; }
  double bottom() const { return y + height; }
};

enum class TextAnchor { kStart, kMiddle, kEnd };

struct TextStyle {
  double size_px = 13;  // height of the letters from the foot of a 'p' to the top of an 'l', about
  TextAnchor anchor = TextAnchor::kStart;
  bool bold = false;
  bool upwards = false;  // turned by a quarter, read from below
  PlotColor color = {40, 40, 40};
};

/// What a figure is drawn on: x to the right, y downwards, in pixels of the figure.
class PlotCanvas {
 public:
  virtual ~PlotCanvas() = default;
  virtual void Polyline(std::span<const PlotPoint> points, const PlotColor& color, double width_px,
                        bool dashed) = 0;
  virtual void Polygon(std::span<const PlotPoint> points, const PlotColor& fill) = 0;
  virtual void Disc(PlotPoint centre, double radius_px, const PlotColor& fill) = 0;
  /// `at` is on the base line, at the start, middle or end of the text as the style says.
  virtual void Text(PlotPoint at, const std::string& text, const TextStyle& style) = 0;
  /// What follows is drawn within the box only; without one, everywhere.
  virtual void Clip(const std::optional<PlotBox>& box) = 0;
};

/// The size a figure needs, and its drawing.
PlotBox FigureSize(const PlotFigure& figure);
void DrawFigure(const PlotFigure& figure, PlotCanvas* canvas);

}  // namespace dmslam
