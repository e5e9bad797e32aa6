#include "dmslam/evaluation/plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "dmslam/evaluation/plot_canvas.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr double kOuterMargin = 14;
constexpr double kTitleHeight = 30;
constexpr double kSubtitleHeight = 22;
constexpr double kPanelTitleHeight = 28;
constexpr double kBelowAxis = 48;   // tick labels and the axis' label
constexpr double kLeftOfAxis = 82;  // the same beside the y axis
constexpr double kRightOfAxis = 18;
constexpr double kColorBarWidth = 14;
constexpr double kColorBarSpace = 92;  // the bar, its ticks and its label
constexpr int kColorLevels = 64;
constexpr PlotColor kWhite = {255, 255, 255};
constexpr PlotColor kAxisColor = {90, 90, 90};
constexpr PlotColor kGridColor = {228, 228, 228};
constexpr PlotColor kTextColor = {40, 40, 40};

double Fraction(const PlotRange& range, double value) {
  return (value - range.low) / (range.high - range.low);
}

/// From data to pixels, within one panel.
struct Axes {
  PlotBox box;
  PlotRange x, y;  // y in powers of ten where it is logarithmic
  bool y_log = false;
  PlotPoint ToPixel(double data_x, double data_y) const {
    const double height = y_log ? std::log10(data_y) : data_y;
    return {box.x + Fraction(x, data_x) * box.width, box.bottom() - Fraction(y, height) * box.height};
  }
};

void Extend(std::optional<PlotRange>* range, const std::vector<double>& values) {
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    if (!*range) *range = PlotRange{value, value};
    (*range)->low = std::min((*range)->low, value);
    (*range)->high = std::max((*range)->high, value);
  }
}

PlotRange WithMargin(const std::optional<PlotRange>& data, double share) {
  if (!data) return {0, 1};
  double margin = share * (data->high - data->low);
  if (!(margin > 0)) margin = std::max(1e-9, 0.5 * std::abs(data->low));
  return {data->low - margin, data->high + margin};
}

// Widens the range that has more pixels per unit until both have equally many.
void EqualiseAspect(Axes* axes) {
  const double x_per_px = (axes->x.high - axes->x.low) / axes->box.width;
  const double y_per_px = (axes->y.high - axes->y.low) / axes->box.height;
  PlotRange* narrow = x_per_px < y_per_px ? &axes->x : &axes->y;
  const double extent =
      std::max(x_per_px, y_per_px) * (narrow == &axes->x ? axes->box.width : axes->box.height);
  const double middle = 0.5 * (narrow->low + narrow->high);
  *narrow = {middle - 0.5 * extent, middle + 0.5 * extent};
}

std::vector<double> LogOfPositive(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !(value > 0); });
  for (double& value : values) value = std::log10(value);
  return values;
}

void ChooseRanges(const PlotPanel& panel, Axes* axes) {
  std::optional<PlotRange> x, y;
  for (const PlotSeries& series : panel.series) {
    Extend(&x, series.x);
    for (const auto* values : {&series.y, &series.y_low, &series.y_high}) {
      Extend(&y, panel.y_log ? LogOfPositive(*values) : *values);
    }
  }
  axes->x = panel.x_range.value_or(WithMargin(x, panel.equal_aspect ? 0.05 : 0.02));
  axes->y = panel.y_range.value_or(WithMargin(y, 0.06));
  if (panel.y_log && panel.y_range)
    axes->y = {std::log10(panel.y_range->low), std::log10(panel.y_range->high)};
  if (!panel.x_categories.empty()) axes->x = {-0.5, static_cast<double>(panel.x_categories.size()) - 0.5};
  if (panel.y_from_zero && !panel.y_range && !panel.y_log) axes->y.low = 0;
  if (panel.equal_aspect) EqualiseAspect(axes);
}

Axes MakeAxes(const PlotPanel& panel, const PlotBox& cell) {
  Axes axes;
  const bool has_bar = panel.color_bar && panel.color_bar->shown;
  axes.box = {cell.x + kLeftOfAxis, cell.y + kPanelTitleHeight,
              cell.width - kLeftOfAxis - kRightOfAxis - (has_bar ? kColorBarSpace : 0),
              cell.height - kPanelTitleHeight - kBelowAxis};
  axes.y_log = panel.y_log;
  ChooseRanges(panel, &axes);
  return axes;
}

PlotTicks CategoryTicks(const std::vector<std::string>& categories) {
  PlotTicks ticks{{}, categories};
  for (size_t i = 0; i < categories.size(); ++i) ticks.positions.push_back(static_cast<double>(i));
  return ticks;
}

size_t TicksFor(double length_px, double px_per_tick) {
  return static_cast<size_t>(std::clamp(length_px / px_per_tick, 2.0, 12.0));
}

void DrawFrameAndTicks(const PlotPanel& panel, const Axes& axes, PlotCanvas* canvas) {
  const PlotBox& box = axes.box;
  const PlotTicks x_ticks = panel.x_categories.empty() ? MakeTicks(axes.x, TicksFor(box.width, 75))
                                                       : CategoryTicks(panel.x_categories);
  const PlotTicks y_ticks = axes.y_log ? MakeLogTicks({std::pow(10, axes.y.low), std::pow(10, axes.y.high)})
                                       : MakeTicks(axes.y, TicksFor(box.height, 48));
  for (size_t i = 0; i < x_ticks.positions.size(); ++i) {
    const double x = axes.ToPixel(x_ticks.positions[i], 1).x;
    const std::array<PlotPoint, 2> line = {{{x, box.y}, {x, box.bottom() + 4}}};
    canvas->Polyline(line, kGridColor, 1, false);
    canvas->Text({x, box.bottom() + 18}, x_ticks.labels[i], {12, TextAnchor::kMiddle});
  }
  for (size_t i = 0; i < y_ticks.positions.size(); ++i) {
    const double y = axes.ToPixel(axes.x.low, y_ticks.positions[i]).y;
    const std::array<PlotPoint, 2> line = {{{box.x - 4, y}, {box.right(), y}}};
    canvas->Polyline(line, kGridColor, 1, false);
    canvas->Text({box.x - 8, y + 4}, y_ticks.labels[i], {12, TextAnchor::kEnd});
  }
  const std::array<PlotPoint, 5> frame = {{{box.x, box.y},
                                           {box.right(), box.y},
                                           {box.right(), box.bottom()},
                                           {box.x, box.bottom()},
                                           {box.x, box.y}}};
  canvas->Polyline(frame, kAxisColor, 1, false);
  canvas->Text({box.x, box.y - 10}, panel.title, {14, TextAnchor::kStart, true});
  canvas->Text({box.x + 0.5 * box.width, box.bottom() + 38}, panel.x_label, {13, TextAnchor::kMiddle});
  canvas->Text({box.x - 64, box.y + 0.5 * box.height}, panel.y_label, {13, TextAnchor::kMiddle, false, true});
}

void DrawBand(const PlotSeries& series, const Axes& axes, PlotCanvas* canvas) {
  if (series.y_low.empty()) return;
  std::vector<PlotPoint> outline;
  for (size_t i = 0; i < series.x.size(); ++i) outline.push_back(axes.ToPixel(series.x[i], series.y_low[i]));
  for (size_t i = series.x.size(); i-- > 0;) outline.push_back(axes.ToPixel(series.x[i], series.y_high[i]));
  std::erase_if(outline, [](const PlotPoint& p) { return !std::isfinite(p.x) || !std::isfinite(p.y); });
  PlotColor fill = series.color;
  fill.alpha = 0.18;
  canvas->Polygon(outline, fill);
}

int Level(const PlotPanel& panel, double value) {
  const PlotRange range = panel.color_bar ? panel.color_bar->range : PlotRange{0, 1};
  if (!(range.high > range.low)) return 0;
  return std::clamp(static_cast<int>(Fraction(range, value) * kColorLevels), 0, kColorLevels - 1);
}

PlotColor ColorOfLevel(int level) { return ColorOfValue((level + 0.5) / kColorLevels); }

// Lines whose pieces have different colours: neighbouring pieces of one colour are drawn together.
void DrawLine(const PlotPanel& panel, const PlotSeries& series, const Axes& axes, PlotCanvas* canvas) {
  std::vector<PlotPoint> run;
  int run_level = 0;
  const auto flush = [&] {
    const PlotColor color = series.values.empty() ? series.color : ColorOfLevel(run_level);
    if (run.size() > 1) canvas->Polyline(run, color, series.line_width_px, series.dashed);
    run.clear();
  };
  for (size_t i = 0; i < series.x.size(); ++i) {
    const PlotPoint point = axes.ToPixel(series.x[i], series.y[i]);
    if (!std::isfinite(point.x) || !std::isfinite(point.y)) {
      flush();
      continue;
    }
    const int level = series.values.empty() ? 0 : Level(panel, series.values[i]);
    if (!run.empty() && level != run_level) {
      run.push_back(point);
      flush();
    }
    run_level = level;
    run.push_back(point);
  }
  flush();
}

void DrawMarkers(const PlotPanel& panel, const PlotSeries& series, const Axes& axes, PlotCanvas* canvas) {
  for (size_t i = 0; i < series.x.size(); ++i) {
    const PlotPoint point = axes.ToPixel(series.x[i], series.y[i]);
    if (!std::isfinite(point.x) || !std::isfinite(point.y)) continue;
    const PlotColor color =
        series.values.empty() ? series.color : ColorOfLevel(Level(panel, series.values[i]));
    canvas->Disc(point, series.marker_radius_px, color);
  }
}

void DrawSeries(const PlotPanel& panel, const Axes& axes, PlotCanvas* canvas) {
  canvas->Clip(axes.box);
  for (const PlotSeries& series : panel.series) {
    DMSLAM_CHECK(series.x.size() == series.y.size(), "a point has an x and a y");
    DMSLAM_CHECK(series.values.empty() || series.values.size() == series.x.size(), "one value per point");
    DMSLAM_CHECK(series.y_low.size() == series.y_high.size() &&
                     (series.y_low.empty() || series.y_low.size() == series.x.size()),
                 "one band edge per point");
    DrawBand(series, axes, canvas);
    if (series.line_width_px > 0) DrawLine(panel, series, axes, canvas);
    if (series.marker_radius_px > 0) DrawMarkers(panel, series, axes, canvas);
  }
  canvas->Clip(std::nullopt);
}

double TextWidth(const std::string& text, double size_px) {
  return 0.58 * size_px * static_cast<double>(text.size());
}

// How many points of the drawn curves lie in a box.
size_t PointsWithin(const PlotPanel& panel, const Axes& axes, const PlotBox& box) {
  size_t count = 0;
  for (const PlotSeries& series : panel.series) {
    for (size_t i = 0; i < series.x.size(); ++i) {
      const PlotPoint p = axes.ToPixel(series.x[i], series.y[i]);
      count += p.x >= box.x && p.x <= box.right() && p.y >= box.y && p.y <= box.bottom() ? 1 : 0;
    }
  }
  return count;
}

// The corner of the axes in which a legend of that size hides the fewest points.
PlotBox PlaceLegend(const PlotPanel& panel, const Axes& axes, double width, double height) {
  const double left = axes.box.x + 8, right = axes.box.right() - 8 - width;
  const double top = axes.box.y + 8, bottom = axes.box.bottom() - 8 - height;
  const std::array<PlotBox, 4> corners = {{{right, top, width, height},
                                           {left, top, width, height},
                                           {right, bottom, width, height},
                                           {left, bottom, width, height}}};
  return *std::min_element(corners.begin(), corners.end(), [&](const PlotBox& a, const PlotBox& b) {
    return PointsWithin(panel, axes, a) < PointsWithin(panel, axes, b);
  });
}

void DrawLegend(const PlotPanel& panel, const Axes& axes, PlotCanvas* canvas) {
  constexpr double kRow = 18, kSwatch = 26;
  std::vector<const PlotSeries*> named;
  double widest = 0;
  for (const PlotSeries& series : panel.series) {
    if (series.label.empty()) continue;
    named.push_back(&series);
    widest = std::max(widest, TextWidth(series.label, 12));
  }
  if (named.empty()) return;
  const PlotBox box =
      PlaceLegend(panel, axes, widest + kSwatch + 22, kRow * static_cast<double>(named.size()) + 8);
  const std::array<PlotPoint, 4> corners = {
      {{box.x, box.y}, {box.right(), box.y}, {box.right(), box.bottom()}, {box.x, box.bottom()}}};
  canvas->Polygon(corners, {255, 255, 255, 0.85});
  for (size_t i = 0; i < named.size(); ++i) {
    const double y = box.y + 4 + kRow * (static_cast<double>(i) + 0.5);
    const std::array<PlotPoint, 2> swatch = {{{box.x + 8, y}, {box.x + 8 + kSwatch, y}}};
    const PlotColor color = named[i]->values.empty() ? named[i]->color : ColorOfValue(0.25);
    if (named[i]->line_width_px > 0)
      canvas->Polyline(swatch, color, named[i]->line_width_px, named[i]->dashed);
    if (named[i]->marker_radius_px > 0)
      canvas->Disc({box.x + 8 + 0.5 * kSwatch, y}, named[i]->marker_radius_px, color);
    canvas->Text({box.x + kSwatch + 15, y + 4}, named[i]->label, {12});
  }
}

void DrawColorBar(const PlotColorBar& bar, const PlotBox& axes_box, PlotCanvas* canvas) {
  const PlotBox box = {axes_box.right() + 16, axes_box.y, kColorBarWidth, axes_box.height};
  for (int level = 0; level < kColorLevels; ++level) {
    const double bottom = box.bottom() - box.height * level / kColorLevels;
    const double top = box.bottom() - box.height * (level + 1) / kColorLevels;
    const std::array<PlotPoint, 4> patch = {
        {{box.x, top}, {box.right(), top}, {box.right(), bottom + 0.4}, {box.x, bottom + 0.4}}};
    canvas->Polygon(patch, ColorOfLevel(level));
  }
  const PlotTicks ticks = MakeTicks(bar.range, TicksFor(box.height, 48));
  for (size_t i = 0; i < ticks.positions.size(); ++i) {
    const double y = box.bottom() - Fraction(bar.range, ticks.positions[i]) * box.height;
    const std::array<PlotPoint, 2> line = {{{box.right(), y}, {box.right() + 4, y}}};
    canvas->Polyline(line, kAxisColor, 1, false);
    canvas->Text({box.right() + 8, y + 4}, ticks.labels[i], {12});
  }
  canvas->Text({box.right() + 66, box.y + 0.5 * box.height}, bar.label,
               {13, TextAnchor::kMiddle, false, true});
}

void DrawPanel(const PlotPanel& panel, const PlotBox& cell, PlotCanvas* canvas) {
  const Axes axes = MakeAxes(panel, cell);
  DrawFrameAndTicks(panel, axes, canvas);
  DrawSeries(panel, axes, canvas);
  DrawLegend(panel, axes, canvas);
  if (panel.color_bar && panel.color_bar->shown) DrawColorBar(*panel.color_bar, axes.box, canvas);
}

double HeaderHeight(const PlotFigure& figure) {
  return (figure.title.empty() ? 0 : kTitleHeight) + (figure.subtitle.empty() ? 0 : kSubtitleHeight);
}

// Each panel's cell on the grid, row by row.
std::vector<PlotBox> LayOut(const PlotFigure& figure) {
  std::vector<PlotBox> cells;
  size_t row = 0, column = 0;
  for (const PlotPanel& panel : figure.panels) {
    const size_t span = std::clamp<size_t>(panel.column_span, 1, figure.columns);
    if (column + span > figure.columns) {
      ++row;
      column = 0;
    }
    cells.push_back({kOuterMargin + static_cast<double>(column) * figure.panel_width_px,
                     kOuterMargin + HeaderHeight(figure) + static_cast<double>(row) * figure.panel_height_px,
                     static_cast<double>(span) * figure.panel_width_px, figure.panel_height_px});
    column += span;
  }
  return cells;
}

}  // namespace

PlotColor ColorOfValue(double value) {
  static constexpr std::array<std::array<double, 3>, 6> kAnchors = {
      {{38, 70, 160}, {23, 132, 178}, {42, 160, 110}, {150, 182, 45}, {235, 150, 20}, {200, 30, 40}}};
  const double position = std::clamp(std::isfinite(value) ? value : 1.0, 0.0, 1.0) * (kAnchors.size() - 1);
  const size_t i = std::min(static_cast<size_t>(position), kAnchors.size() - 2);
  const double t = position - static_cast<double>(i);
  const auto channel = [&](size_t c) {
    return static_cast<uint8_t>(std::lround((1 - t) * kAnchors[i][c] + t * kAnchors[i + 1][c]));
  };
  return {channel(0), channel(1), channel(2)};
}

PlotTicks MakeTicks(const PlotRange& range, size_t wanted) {
  PlotTicks ticks;
  const double extent = range.high - range.low;
  if (!(extent > 0) || !std::isfinite(extent)) return ticks;
  const double raw = extent / static_cast<double>(std::max<size_t>(wanted, 1));
  const double magnitude = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10 * magnitude;
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * magnitude >= raw * (1 - 1e-9)) {
      step = factor * magnitude;
      break;
    }
  }
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  const double first = std::ceil(range.low / step - 1e-9), last = std::floor(range.high / step + 1e-9);
  for (double k = first; k <= last; ++k) {
    char label[64];
    std::snprintf(label, sizeof(label), "%.*f", decimals, k * step + 0.0);
    ticks.positions.push_back(k * step);
    ticks.labels.emplace_back(label);
  }
  return ticks;
}

PlotTicks MakeLogTicks(const PlotRange& range) {
  PlotTicks ticks;
  if (!(range.low > 0) || !(range.high > range.low)) return ticks;
  if (range.high < 4 * range.low) return MakeTicks(range, 6);
  const bool between = range.high < 300 * range.low;
  const double first = std::floor(std::log10(range.low)), last = std::ceil(std::log10(range.high));
  for (double power = first; power <= last; ++power) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double value = factor * std::pow(10.0, power);
      if ((factor != 1 && !between) || value < range.low * (1 - 1e-9) || value > range.high * (1 + 1e-9))
        continue;
      char label[64];
      std::snprintf(label, sizeof(label), "%g", value);
      ticks.positions.push_back(value);
      ticks.labels.emplace_back(label);
    }
  }
  return ticks;
}

PlotBox FigureSize(const PlotFigure& figure) {
  PlotBox size{0, 0, 2 * kOuterMargin + static_cast<double>(figure.columns) * figure.panel_width_px,
               2 * kOuterMargin + HeaderHeight(figure)};
  for (const PlotBox& cell : LayOut(figure))
    size.height = std::max(size.height, cell.bottom() + kOuterMargin);
  return size;
}

void DrawFigure(const PlotFigure& figure, PlotCanvas* canvas) {
  DMSLAM_CHECK(figure.columns > 0, "a figure has at least one column");
  const PlotBox size = FigureSize(figure);
  const std::array<PlotPoint, 4> all = {
      {{0, 0}, {size.width, 0}, {size.width, size.height}, {0, size.height}}};
  canvas->Polygon(all, kWhite);
  double y = kOuterMargin + 18;
  if (!figure.title.empty()) {
    canvas->Text({kOuterMargin + 6, y}, figure.title, {18, TextAnchor::kStart, true, false, kTextColor});
    y += kSubtitleHeight;
  }
  canvas->Text({kOuterMargin + 6, y}, figure.subtitle, {13, TextAnchor::kStart, false, false, {90, 90, 90}});
  const std::vector<PlotBox> cells = LayOut(figure);
  for (size_t i = 0; i < figure.panels.size(); ++i) DrawPanel(figure.panels[i], cells[i], canvas);
}

}  // namespace dmslam
