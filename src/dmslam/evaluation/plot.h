#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace dmslam {

/// A colour of a chart; `alpha` 1 covers, 0 is invisible.
struct PlotColor {
  uint8_t r = 0;
  uint8_t g = 0;
  uint8_t b = 0;
  double alpha = 1.0;
};

/// Colours that stay distinct for colour-blind readers (Okabe and Ito's), in the order in which series take
/// them.
inline constexpr std::array<PlotColor, 7> kPlotPalette = {{{0, 114, 178},
                                                           {213, 94, 0},
                                                           {0, 158, 115},
                                                           {204, 121, 167},
                                                           {230, 159, 0},
                                                           {86, 180, 233},
                                                           {70, 70, 70}}};

/// Colour of a value in [0, 1], from blue (small) over green and amber to red (large); clamped.
PlotColor ColorOfValue(double value);

struct PlotRange {
  double low = 0;
  double high = 1;
};

/// A curve, a cloud of points, or both.
struct PlotSeries {
  // In the legend; empty: not there.
  std::string label;
  // The points, equally many; one that is not finite breaks the line.
  std::vector<double> x;
  std::vector<double> y;
  // Colours each point by the panel's colour bar instead of by `color`; empty, or one per point.
  std::vector<double> values;
  // A band behind the line (10th to 90th percentile, min to max); empty, or one per point.
  std::vector<double> y_low;
  std::vector<double> y_high;
  PlotColor color = kPlotPalette[0];
  double line_width_px = 1.8;   // 0: no line
  double marker_radius_px = 0;  // 0: no markers
  bool dashed = false;
};

struct PlotColorBar {
  std::string label;
  PlotRange range;
  bool shown = true;  // false: colours as if it were there (another panel shows it)
};

/// One pair of axes.
struct PlotPanel {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<PlotSeries> series;  // later ones are drawn above earlier ones
  // Fixed ends of an axis; otherwise those of the data with a margin.
  std::optional<PlotRange> x_range;
  std::optional<PlotRange> y_range;
  bool y_from_zero = false;
  // Logarithmic y axis; values that are not positive are not drawn.
  bool y_log = false;
  // Names along the x axis at 0, 1, 2, ... instead of numbers.
  std::vector<std::string> x_categories;
  // One unit is as long in x as in y, as a map needs it.
  bool equal_aspect = false;
  std::optional<PlotColorBar> color_bar;
  // Columns of the figure's grid that the panel fills.
  size_t column_span = 1;
};

/// Panels on a grid, filled row by row.
struct PlotFigure {
  std::string title;
  std::string subtitle;
  std::vector<PlotPanel> panels;
  size_t columns = 1;
  double panel_width_px = 560;
  double panel_height_px = 400;
};

/// Round positions for about `wanted` ticks within a range (steps of 1, 2 or 5 times a power of ten), and
/// their labels, all with the same number of decimals.
struct PlotTicks {
  std::vector<double> positions;
  std::vector<std::string> labels;
};
PlotTicks MakeTicks(const PlotRange& range, size_t wanted);

/// Ticks of a logarithmic axis over positive values: powers of ten, with 2 and 5 times them (or 1.2, 1.4, ...
/// evenly) where the range is short.
PlotTicks MakeLogTicks(const PlotRange& range);

/// The figure as SVG text. The same figure gives the same bytes.
std::string RenderSvg(const PlotFigure& figure);

/// Write the figure as SVG or as PNG (twice the size in pixels where `scale` is 2). Throw InputError when the
/// file cannot be written.
void WriteSvg(const PlotFigure& figure, const std::string& path);
void WritePng(const PlotFigure& figure, const std::string& path, double scale = 2.0);

}  // namespace dmslam
