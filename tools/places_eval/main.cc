#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <iostream>
#include <string>

#include "dmslam/util/version.h"
#include "evaluate.h"

namespace {

struct Outputs {
  std::string csv;
  std::string svg;
};

void AddOptions(CLI::App& app, dmslam::PlacesOptions& options, Outputs& outputs) {
  app.add_option("--sequence", options.sequence, "TUM RGB-D folder with groundtruth.txt")->required();
  app.add_option("--vocabulary", options.vocabulary, "Vocabulary, either format")->required();
  app.add_option("--fx", options.camera.fx_px, "Focal length [px]")->required();
  app.add_option("--fy", options.camera.fy_px, "Focal length [px]")->required();
  app.add_option("--cx", options.camera.cx_px, "Principal point [px]")->required();
  app.add_option("--cy", options.camera.cy_px, "Principal point [px]")->required();
  app.add_option("--features", options.features, "Features per image")->capture_default_str();
  app.add_option("--every", options.every, "Every n-th frame is a view")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--min-gap", options.min_gap_s, "Least time between compared views [s]")
      ->capture_default_str();
  app.add_option("--max-distance", options.max_distance, "Same view: distance [m]")->capture_default_str();
  app.add_option("--max-angle", options.max_angle_deg, "Same view: turn [deg]")->capture_default_str();
  app.add_option("--candidates", options.max_candidates, "Places verified per view")->capture_default_str();
  app.add_option("--seed", options.seed, "Seed of the verification")->capture_default_str();
  app.add_option("--csv", outputs.csv, "Write the curves as a table");
  app.add_option("--svg", outputs.svg, "Draw the curves");
}

void Print(const char* stage, const std::vector<dmslam::CurvePoint>& curve) {
  const auto best = dmslam::BestWithoutError(curve);
  const dmslam::CurvePoint all = curve.empty() ? dmslam::CurvePoint{} : curve.back();
  std::printf(
      "%-9s recall at 100 %% precision %.3f (threshold %.4g); all answers: precision %.3f, recall %.3f\n",
      stage, best ? best->recall : 0.0, best ? best->threshold : 0.0, all.precision, all.recall);
}

void Run(const dmslam::PlacesOptions& options, const Outputs& outputs) {
  const dmslam::PlacesResult result = dmslam::EvaluatePlaces(options);
  const auto by_score = dmslam::PrecisionRecall(result, dmslam::Confidence::kScore);
  const auto by_inliers = dmslam::PrecisionRecall(result, dmslam::Confidence::kInliers);
  std::printf("views     %zu, of which %zu were seen before; query %.3f ms\n", result.num_views,
              result.num_expected, result.query_ms);
  Print("score", by_score);
  Print("verified", by_inliers);
  if (!outputs.csv.empty()) dmslam::WriteCurvesCsv(outputs.csv, by_score, by_inliers);
  if (!outputs.svg.empty()) dmslam::WriteCurvesSvg(outputs.svg, by_score, by_inliers);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Place recognition alone, scored against ground-truth poses", "dmslam-places-eval");
  app.set_version_flag("--version", dmslam::kVersion);
  dmslam::PlacesOptions options;
  Outputs outputs;
  AddOptions(app, options, outputs);
  CLI11_PARSE(app, argc, argv);
  try {
    Run(options, outputs);
  } catch (const std::exception& error) {
    std::cerr << "dmslam-places-eval: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
