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
  app.add_option("--accept-margin", options.accept_margin, "An estimated pose must be closer by this share")
      ->capture_default_str();
  app.add_option("--candidates", options.max_candidates, "Places verified per view")->capture_default_str();
  app.add_option("--seed", options.seed, "Seed of the verification")->capture_default_str();
  app.add_option("--csv", outputs.csv, "Write the curves as a table");
  app.add_option("--svg", outputs.svg, "Draw the curves");
}

void Print(dmslam::Stage stage, const std::vector<dmslam::CurvePoint>& curve) {
  const auto strict = dmslam::BestWithoutError(curve, false);
  const auto place = dmslam::BestWithoutError(curve, true);
  const dmslam::CurvePoint all = curve.empty() ? dmslam::CurvePoint{} : curve.back();
  std::printf("%-10s %10.3f (>= %5.4g) %10.3f (>= %5.4g) %10.3f %8.3f %8.3f\n", dmslam::StageName(stage),
              strict.recall, strict.threshold, place.recall, place.threshold, all.precision,
              all.place_precision, all.recall);
}

void Run(const dmslam::PlacesOptions& options, const Outputs& outputs) {
  const dmslam::PlacesResult result = dmslam::EvaluatePlaces(options);
  std::printf("%zu views, of which %zu were seen before; query %.3f ms\n", result.queries.size(),
              result.num_expected, result.query_ms);
  std::printf(
      "           recall without a wrong answer ...  or a false place        all: precision  (place)  "
      "recall\n");
  dmslam::Curves curves;
  for (size_t i = 0; i < dmslam::kNumStages; ++i) {
    curves[i] = dmslam::PrecisionRecall(result, static_cast<dmslam::Stage>(i));
    Print(static_cast<dmslam::Stage>(i), curves[i]);
  }
  if (!outputs.csv.empty()) dmslam::WriteCurvesCsv(outputs.csv, curves);
  if (!outputs.svg.empty()) dmslam::WriteCurvesSvg(outputs.svg, curves);
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
