#include "draw.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <string>

namespace dmslam {
namespace {

const cv::Scalar kGreen(0, 210, 0), kYellow(255, 220, 0), kGrey(120, 120, 120), kWhite(255, 255, 255),
    kBlack(0, 0, 0);
constexpr int kMatrixPx = 480;
constexpr int kTitlePx = 24;
constexpr double kSmallest = 0.33;  // size of text that can still be read

cv::Mat AsMat(const ColorImage& image) {
  return cv::Mat(image.height, image.width, CV_8UC3, const_cast<uint8_t*>(image.data.data())).clone();
}

cv::Point Pixel(const Eigen::Vector2d& uv) { return {cvRound(uv.x()), cvRound(uv.y())}; }

void Text(cv::Mat& canvas, const std::string& text, cv::Point at, const cv::Scalar& color,
          double size = 0.4) {
  cv::putText(canvas, text, at, cv::FONT_HERSHEY_SIMPLEX, size, kBlack, 3, cv::LINE_AA);
  cv::putText(canvas, text, at, cv::FONT_HERSHEY_SIMPLEX, size, color, 1, cv::LINE_AA);
}

int WidthOf(const std::string& text, double size) {
  int below = 0;
  return cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, size, 1, &below).width;
}

/// Text that ends after `width_px` at the latest: smaller where it is too long, and cut where that does not
/// do.
void TextWithin(cv::Mat& canvas, std::string text, cv::Point at, int width_px, const cv::Scalar& color,
                double size) {
  while (size > kSmallest && WidthOf(text, size) > width_px) size -= 0.01;
  if (WidthOf(text, size) > width_px) {
    while (!text.empty() && WidthOf(text + "...", size) > width_px) text.pop_back();
    text += "...";
  }
  Text(canvas, text, at, color, size);
}

void DrawFeatures(cv::Mat& canvas, std::span<const Match> matches, const StaticSelection& selection,
                  bool second) {
  for (size_t i = 0; i < matches.size(); ++i) {
    const bool is_static = selection.is_static[i] != 0;
    const cv::Point from = Pixel(matches[i].uv0_px), to = Pixel(matches[i].uv1_px);
    if (second) cv::line(canvas, from, to, is_static ? kGreen : kYellow, 1, cv::LINE_AA);
    cv::circle(canvas, second ? to : from, 2, is_static ? kGreen : kYellow, cv::FILLED, cv::LINE_AA);
  }
}

void DrawCells(cv::Mat& canvas, const StaticSelection& selection) {
  for (const bool chosen : {false, true}) {
    for (size_t k = 0; k < selection.cells.size(); ++k) {
      const CellReport& cell = selection.cells[k];
      if (cell.chosen != chosen) continue;
      const cv::Point low(cell.column * canvas.cols / selection.columns,
                          cell.row * canvas.rows / selection.rows);
      const cv::Point high((cell.column + 1) * canvas.cols / selection.columns - 1,
                           (cell.row + 1) * canvas.rows / selection.rows - 1);
      cv::rectangle(canvas, low, high, chosen ? kGreen : kGrey, chosen ? 2 : 1);
      const std::string state(cell.state == CellState::kPureRotation ? "rotation" : ToString(cell.state));
      const std::string label = std::to_string(k) + ": " + std::to_string(cell.num_inliers) + "/" +
                                std::to_string(cell.num_matches) + " " + state;
      TextWithin(canvas, label, low + cv::Point(4, 13), high.x - low.x - 8,
                 static_cast<int>(k) == selection.leading_cell ? kGreen : kWhite, 0.4);
    }
  }
}

cv::Mat DrawCoupleMatrix(const StaticSelection& selection) {
  const auto n = static_cast<int>(selection.cells.size());
  cv::Mat panel(kMatrixPx, kMatrixPx, CV_8UC3, cv::Scalar(30, 30, 30));
  const int margin = 26, step = (kMatrixPx - margin - 4) / std::max(1, n);
  for (int i = 0; i < n; ++i) {
    const bool chosen = selection.cells[static_cast<size_t>(i)].chosen;
    Text(panel, std::to_string(i), {4, margin + i * step + step / 2 + 4}, chosen ? kGreen : kWhite);
    Text(panel, std::to_string(i), {margin + i * step + step / 2 - 6, 16}, chosen ? kGreen : kWhite);
    for (int j = 0; j < n; ++j) {
      const double degree = selection.couple(i, j);
      const cv::Rect box(margin + j * step, margin + i * step, step - 1, step - 1);
      const int shade = cvRound(255 * degree);
      cv::rectangle(panel, box, cv::Scalar(shade, shade, 40 + shade * 3 / 4), cv::FILLED);
      if (i == selection.leading_cell && selection.cells[static_cast<size_t>(j)].chosen) {
        cv::rectangle(panel, box, kGreen, 2);
      }
    }
  }
  return panel;
}

void Paste(const cv::Mat& part, cv::Point at, const std::string& title, cv::Mat& canvas) {
  part.copyTo(canvas(cv::Rect(at.x, at.y + kTitlePx, part.cols, part.rows)));
  TextWithin(canvas, title, at + cv::Point(6, 16), part.cols - 12, kWhite, 0.45);
}

}  // namespace

ColorImage DrawSelection(const ColorImage& frame0, const ColorImage& frame1, std::span<const Match> matches,
                         const StaticSelection& selection) {
  cv::Mat first = AsMat(frame0), second = AsMat(frame1);
  DrawFeatures(first, matches, selection, false);
  DrawFeatures(second, matches, selection, true);
  const bool has_cells = !selection.cells.empty();
  if (has_cells) DrawCells(first, selection);
  const bool has_matrix = selection.couple.rows() > 0;
  const int width = first.cols + second.cols + (has_matrix ? kMatrixPx : 0);
  const int height = std::max({first.rows, second.rows, has_matrix ? kMatrixPx : 0}) + kTitlePx;
  cv::Mat canvas(height, width, CV_8UC3, kBlack);
  const std::string count =
      std::to_string(selection.num_static) + " static of " + std::to_string(matches.size());
  Paste(first, {0, 0},
        has_cells ? "first frame: cells, their own inliers, state; the chosen set framed" : "first frame",
        canvas);
  Paste(second, {first.cols, 0},
        selection.IsUsable() ? "second frame: " + count : "refused: " + selection.explanation, canvas);
  if (has_matrix) Paste(DrawCoupleMatrix(selection), {first.cols + second.cols, 0}, "couple matrix", canvas);
  ColorImage image;
  image.width = canvas.cols;
  image.height = canvas.rows;
  image.data.assign(canvas.datastart, canvas.dataend);
  return image;
}

}  // namespace dmslam
