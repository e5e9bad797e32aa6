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

constexpr std::array<const char*, kNumStages> kColours = {"#c60", "#06c", "#083"};

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

const char* StageName(Stage stage) {
  constexpr std::array<const char*, kNumStages> kNames = {"score", "essential", "pose"};
  return kNames[static_cast<size_t>(stage)];
}

void WriteCurvesCsv(const std::string& path, const Curves& curves) {
  std::ofstream file = Open(path);
  file << "stage,threshold,precision,place_precision,recall\n";
  for (size_t stage = 0; stage < kNumStages; ++stage) {
    for (const CurvePoint& point : curves[stage]) {
      file << StageName(static_cast<Stage>(stage)) << ',' << point.threshold << ',' << point.precision << ','
           << point.place_precision << ',' << point.recall << '\n';
    }
  }
}

void WriteCurvesSvg(const std::string& path, const Curves& curves) {
  std::ofstream file = Open(path);
  const double side = kPlotPx + 2 * kMarginPx;
  const double end = kMarginPx + kPlotPx;
  file << "<svg xmlns='http://www.w3.org/2000/svg' width='" << side << "' height='" << side
       << "' font-family='sans-serif' font-size='13'>\n<rect width='100%' height='100%' fill='white'/>\n"
       << "<rect x='" << kMarginPx << "' y='" << kMarginPx << "' width='" << kPlotPx << "' height='"
       << kPlotPx << "' fill='none' stroke='#888'/>\n";
  DrawText(file, kMarginPx, end + 18, "#444", "0");
  DrawText(file, end - 8, end + 18, "#444", "1");
  DrawText(file, kMarginPx + kPlotPx / 2 - 20, end + 30, "#444", "recall");
  DrawText(file, 4, kMarginPx - 10, "#444", "precision 1");
  DrawText(file, 30, end, "#444", "0");
  for (size_t stage = 0; stage < kNumStages; ++stage) {
    DrawCurve(file, curves[stage], kColours[stage]);
    const double y = end - 55 + 20 * static_cast<double>(stage);
    DrawText(file, kMarginPx + 15, y, kColours[stage],
             std::string("by ") + StageName(static_cast<Stage>(stage)));
  }
  file << "</svg>\n";
}

}  // namespace dmslam
