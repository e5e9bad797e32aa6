#include <cstdio>
#include <fstream>

#include "dmslam/evaluation/plot.h"
#include "dmslam/evaluation/plot_canvas.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

std::string Number(double value) {
  char buffer[64];
  std::snprintf(buffer, sizeof(buffer), "%.2f", value + 0.0);
  std::string text = buffer;
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string Hex(const PlotColor& color) {
  char buffer[16];
  std::snprintf(buffer, sizeof(buffer), "#%02x%02x%02x", color.r, color.g, color.b);
  return buffer;
}

std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

class SvgCanvas : public PlotCanvas {
 public:
  void Polyline(std::span<const PlotPoint> points, const PlotColor& color, double width_px,
                bool dashed) override {
    text_ += "<polyline fill=\"none\" stroke=\"" + Hex(color) + "\" stroke-width=\"" + Number(width_px) +
             "\" stroke-linejoin=\"round\"" + (dashed ? " stroke-dasharray=\"7 4\"" : "") +
             Opacity("stroke-opacity", color) + " points=\"" + Coordinates(points) + "\"/>\n";
  }
  void Polygon(std::span<const PlotPoint> points, const PlotColor& fill) override {
    text_ += "<polygon fill=\"" + Hex(fill) + "\"" + Opacity("fill-opacity", fill) + " points=\"" +
             Coordinates(points) + "\"/>\n";
  }
  void Disc(PlotPoint centre, double radius_px, const PlotColor& fill) override {
    text_ += "<circle cx=\"" + Number(centre.x) + "\" cy=\"" + Number(centre.y) + "\" r=\"" +
             Number(radius_px) + "\" fill=\"" + Hex(fill) + "\"" + Opacity("fill-opacity", fill) + "/>\n";
  }
  void Text(PlotPoint at, const std::string& text, const TextStyle& style) override {
    if (text.empty()) return;
    static constexpr const char* kAnchors[] = {"start", "middle", "end"};
    text_ += "<text x=\"" + Number(at.x) + "\" y=\"" + Number(at.y) + "\" font-size=\"" +
             Number(style.size_px) + "\" text-anchor=\"" + kAnchors[static_cast<int>(style.anchor)] +
             "\" fill=\"" + Hex(style.color) + "\"" + (style.bold ? " font-weight=\"bold\"" : "") +
             (style.upwards ? " transform=\"rotate(-90 " + Number(at.x) + " " + Number(at.y) + ")\"" : "") +
             ">" + Escaped(text) + "</text>\n";
  }
  void Clip(const std::optional<PlotBox>& box) override {
    if (clipping_) text_ += "</g>\n";
    clipping_ = box.has_value();
    if (!box) return;
    const std::string id = "clip" + std::to_string(++clips_);
    text_ += "<clipPath id=\"" + id + "\"><rect x=\"" + Number(box->x) + "\" y=\"" + Number(box->y) +
             "\" width=\"" + Number(box->width) + "\" height=\"" + Number(box->height) +
             "\"/></clipPath>\n<g clip-path=\"url(#" + id + ")\">\n";
  }
  const std::string& text() const { return text_; }

 private:
  static std::string Opacity(const char* attribute, const PlotColor& color) {
    return color.alpha >= 1 ? "" : std::string(" ") + attribute + "=\"" + Number(color.alpha) + "\"";
  }
  static std::string Coordinates(std::span<const PlotPoint> points) {
    std::string text;
    for (const PlotPoint& point : points) {
      if (!text.empty()) text += ' ';
      text += Number(point.x) + ',' + Number(point.y);
    }
    return text;
  }

  std::string text_;
  int clips_ = 0;
  bool clipping_ = false;
};

}  // namespace

std::string RenderSvg(const PlotFigure& figure) {
  const PlotBox size = FigureSize(figure);
  SvgCanvas canvas;
  DrawFigure(figure, &canvas);
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + Number(size.width) + "\" height=\"" +
         Number(size.height) + "\" viewBox=\"0 0 " + Number(size.width) + " " + Number(size.height) +
         "\" font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\">\n" + canvas.text() + "</svg>\n";
}

void WriteSvg(const PlotFigure& figure, const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  file << RenderSvg(figure);
  file.flush();
  if (!file) throw InputError(path + ": cannot be written; check that the folder exists and has space");
}

}  // namespace dmslam
