#include <fstream>

#include "dmslam/util/check.h"
#include "evaluate.h"

namespace dmslam {
namespace {

std::ofstream Open(const std::string& path) {
  std::ofstream file(path);
  if (!file) throw InputError(path + ": cannot be written; check that the folder exists");
  return file;
}

void WriteRows(std::ofstream& file, const char* stage, const std::vector<CurvePoint>& curve) {
  for (const CurvePoint& point : curve) {
    file << stage << ',' << point.threshold << ',' << point.precision << ',' << point.recall << '\n';
  }
}

constexpr double kPlotPx = 400;
constexpr double kMarginPx = 50;

void DrawCurve(std::ofstream& file, const std::vector<CurvePoint>& curve, const char* colour) {
  file << "<polyline fill='none' stroke='" << colour << "' stroke-width='2' points='";
  for (const CurvePoint& point : curve) {
    file << kMarginPx + kPlotPx * point.recall << ',' << kMarginPx + kPlotPx * (1.0 - point.precision) << ' ';
  }
  file << "'/>\n";
}

void DrawText(std::ofstream& file, double x, double y, const char* colour, const std::string& text) {
  file << "<text x='" << x << "' y='" << y << "' fill='" << colour << "'>" << text << "</text>\n";
}

}  // namespace

void WriteCurvesCsv(const std::string& path, const std::vector<CurvePoint>& by_score,
                    const std::vector<CurvePoint>& by_inliers) {
  std::ofstream file = Open(path);
  file << "stage,threshold,precision,recall\n";
  WriteRows(file, "score", by_score);
  WriteRows(file, "verified", by_inliers);
}

void WriteCurvesSvg(const std::string& path, const std::vector<CurvePoint>& by_score,
                    const std::vector<CurvePoint>& by_inliers) {
  std::ofstream file = Open(path);
  const double side = kPlotPx + 2 * kMarginPx;
  const double end = kMarginPx + kPlotPx;
  file << "<svg xmlns='http://www.w3.org/2000/svg' width='" << side << "' height='" << side
       << "' font-family='sans-serif' font-size='13'>\n<rect width='100%' height='100%' fill='white'/>\n"
       << "<rect x='" << kMarginPx << "' y='" << kMarginPx << "' width='" << kPlotPx << "' height='"
       << kPlotPx << "' fill='none' stroke='#888'/>\n";
  DrawCurve(file, by_score, "#c60");
  DrawCurve(file, by_inliers, "#06c");
  DrawText(file, kMarginPx, end + 18, "#444", "0");
  DrawText(file, end - 8, end + 18, "#444", "1");
  DrawText(file, kMarginPx + kPlotPx / 2 - 20, end + 30, "#444", "recall");
  DrawText(file, 4, kMarginPx - 10, "#444", "precision 1");
  DrawText(file, 30, end, "#444", "0");
  DrawText(file, kMarginPx + 15, end - 35, "#c60", "by score alone");
  DrawText(file, kMarginPx + 15, end - 15, "#06c", "by verified matches");
  file << "</svg>\n";
}

}  // namespace dmslam
