#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <span>
#include <string>
#include <vector>

#include "dmslam/evaluation/plot.h"
#include "dmslam/evaluation/plot_canvas.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"

namespace dmslam {
namespace {

// Everything is drawn that many times larger and then averaged down, which smooths edges.
constexpr int kOversampling = 2;
// Drawing functions take coordinates in 1/16 pixel.
constexpr int kFractionBits = 4;

class PngCanvas : public PlotCanvas {
 public:
  PngCanvas(const PlotBox& size, double scale) : factor_(scale * kOversampling) {
    image_ = cv::Mat(Pixels(size.height), Pixels(size.width), CV_8UC3, cv::Scalar(255, 255, 255));
    target_ = image_;
  }

  void Polyline(std::span<const PlotPoint> points, const PlotColor& color, double width_px,
                bool dashed) override {
    const int thickness = std::max(1, static_cast<int>(std::lround(width_px * factor_)));
    Blend(color, Around(points, thickness), [&] {
      for (const std::vector<cv::Point>& piece : dashed ? Dashes(points) : Pieces(points)) {
        cv::polylines(target_, piece, false, Bgr(color), thickness, cv::LINE_AA, kFractionBits);
      }
    });
  }
  void Polygon(std::span<const PlotPoint> points, const PlotColor& fill) override {
    if (points.size() < 3) return;  // encloses nothing
    const std::vector<std::vector<cv::Point>> polygon = Pieces(points);
    Blend(fill, Around(points, 0),
          [&] { cv::fillPoly(target_, polygon, Bgr(fill), cv::LINE_AA, kFractionBits); });
  }
  void Disc(PlotPoint centre, double radius_px, const PlotColor& fill) override {
    const int radius = static_cast<int>(std::lround(radius_px * factor_ * (1 << kFractionBits)));
    Blend(fill, Around({&centre, 1}, Pixels(radius_px)), [&] {
      cv::circle(target_, Fixed(centre), radius, Bgr(fill), cv::FILLED, cv::LINE_AA, kFractionBits);
    });
  }
  void Text(PlotPoint at, const std::string& text, const TextStyle& style) override;
  void Clip(const std::optional<PlotBox>& box) override {
    offset_ = {0, 0};
    target_ = image_;
    if (!box) return;
    const cv::Rect wanted(Pixels(box->x), Pixels(box->y), Pixels(box->width), Pixels(box->height));
    const cv::Rect rect = wanted & cv::Rect(0, 0, image_.cols, image_.rows);
    target_ = image_(rect);
    offset_ = rect.tl();
  }
  /// The finished picture at its final size.
  cv::Mat Finish() const {
    cv::Mat small;
    cv::resize(image_, small, {image_.cols / kOversampling, image_.rows / kOversampling}, 0, 0,
               cv::INTER_AREA);
    return small;
  }

 private:
  int Pixels(double length) const { return static_cast<int>(std::lround(length * factor_)); }
  static cv::Scalar Bgr(const PlotColor& color) {
    return {double(color.b), double(color.g), double(color.r)};
  }
  cv::Point Fixed(PlotPoint point) const {
    const double ones = 1 << kFractionBits;
    const auto fix = [&](double value, int offset) {
      return static_cast<int>(std::lround(std::clamp((value * factor_ - offset) * ones, -1e8, 1e8)));
    };
    return {fix(point.x, offset_.x), fix(point.y, offset_.y)};
  }
  std::vector<std::vector<cv::Point>> Pieces(std::span<const PlotPoint> points) const {
    std::vector<cv::Point> piece;
    for (const PlotPoint& point : points) piece.push_back(Fixed(point));
    return {piece};
  }
  std::vector<std::vector<cv::Point>> Dashes(std::span<const PlotPoint> points) const;

  // What may be drawn on, up to `reach` pixels and a smoothed edge around the points.
  cv::Rect Around(std::span<const PlotPoint> points, int reach) const {
    constexpr int kEdge = 3;
    cv::Rect box;
    for (const PlotPoint& point : points) {
      const cv::Point at = Fixed(point) / (1 << kFractionBits);
      box |= cv::Rect(at.x - reach - kEdge, at.y - reach - kEdge, 2 * (reach + kEdge), 2 * (reach + kEdge));
    }
    return box & cv::Rect({0, 0}, target_.size());
  }
  // Draws into `box` of the target, and lets what was there show through.
  template <typename Draw>
  void Blend(const PlotColor& color, const cv::Rect& box, const Draw& draw) {
    if (color.alpha >= 1) return draw();
    if (box.empty()) return;
    const cv::Mat before = target_(box).clone();
    draw();
    cv::addWeighted(target_(box), color.alpha, before, 1 - color.alpha, 0, target_(box));
  }

  double factor_;
  cv::Mat image_;
  cv::Mat target_;  // the part of image_ that may be drawn on
  cv::Point offset_ = {0, 0};
};

// Cuts a line into strokes of 7 with gaps of 4 pixels.
std::vector<std::vector<cv::Point>> PngCanvas::Dashes(std::span<const PlotPoint> points) const {
  constexpr double kStroke = 7, kPeriod = 11;
  std::vector<std::vector<cv::Point>> dashes;
  double along = 0;
  for (size_t i = 1; i < points.size(); ++i) {
    const PlotPoint &a = points[i - 1], &b = points[i];
    const double length = std::hypot(b.x - a.x, b.y - a.y);
    const auto at = [&](double s) {
      return PlotPoint{a.x + (b.x - a.x) * s / length, a.y + (b.y - a.y) * s / length};
    };
    for (double s = 0; s < length;) {
      const double phase = std::fmod(along + s, kPeriod);
      const double rest = phase < kStroke ? kStroke - phase : kPeriod - phase;
      const double end = std::min(length, s + std::max(rest, 1e-6));
      if (phase < kStroke) dashes.push_back({Fixed(at(s)), Fixed(at(end))});
      s = end;
    }
    along += length;
  }
  return dashes;
}

void PngCanvas::Text(PlotPoint at, const std::string& text, const TextStyle& style) {
  if (text.empty()) return;
  // Letters of this font are 21 units high at scale 1; capitals take 0.72 of a font's size.
  const double font_scale = style.size_px * factor_ * 0.70 / 21.0;
  const int thickness =
      std::max(1, static_cast<int>(std::lround(style.size_px * factor_ * (style.bold ? 0.125 : 0.085))));
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, font_scale, thickness, &baseline);
  const int pad = 2 * thickness + baseline;
  // Ink on a plane of its own, so that it can be turned and laid over whatever is there.
  cv::Mat ink(size.height + 2 * pad, size.width + 2 * pad, CV_8UC1, cv::Scalar(0));
  cv::putText(ink, text, {pad, pad + size.height}, cv::FONT_HERSHEY_SIMPLEX, font_scale, cv::Scalar(255),
              thickness, cv::LINE_AA);
  const double share = style.anchor == TextAnchor::kStart    ? 0.0
                       : style.anchor == TextAnchor::kMiddle ? 0.5
                                                             : 1.0;
  const int back = static_cast<int>(std::lround(share * size.width));
  cv::Point corner(Pixels(at.x) - back - pad, Pixels(at.y) - size.height - pad);
  if (style.upwards) {
    cv::rotate(ink, ink, cv::ROTATE_90_COUNTERCLOCKWISE);
    corner = {Pixels(at.x) - size.height - pad, Pixels(at.y) + back + pad - ink.rows};
  }
  const cv::Rect wanted(corner, ink.size());
  const cv::Rect visible = wanted & cv::Rect(0, 0, image_.cols, image_.rows);
  if (visible.empty()) return;
  const cv::Mat mask = ink(cv::Rect(visible.tl() - corner, visible.size()));
  image_(visible).setTo(Bgr(style.color), mask > 127);
}

}  // namespace

void WritePng(const PlotFigure& figure, const std::string& path, double scale) {
  PngCanvas canvas(FigureSize(figure), scale);
  DrawFigure(figure, &canvas);
  std::vector<uint8_t> bytes;
  bool encoded = false;
  try {
    encoded = cv::imencode(std::filesystem::path(path).extension().string(), canvas.Finish(), bytes);
  } catch (const cv::Exception&) {
    encoded = false;
  }
  if (!encoded) throw InputError(path + ": is no name of a picture; give one that ends in .png");
  OutputFile file(path);
  file.Write(std::as_bytes(std::span(bytes)));
  file.Commit();
}

}  // namespace dmslam
