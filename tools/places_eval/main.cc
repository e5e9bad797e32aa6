#include <cstdio>
#include <string>

#include "dmslam/console/command_line.h"
#include "dmslam/util/build_version.h"
#include "evaluate.h"

namespace {

struct Outputs {
  std::string csv;
  std::string svg;
};

void AddOptions(dmslam::CommandLine& app, dmslam::PlacesOptions& options, Outputs& outputs) {
  app.AddOption("--sequence", options.sequence, "TUM RGB-D folder with groundtruth.txt").Required();
  app.AddOption("--vocabulary", options.vocabulary, "Vocabulary, either format").Required();
  app.AddOption("--fx", options.camera.fx_px, "Focal length [px]").Required();
  app.AddOption("--fy", options.camera.fy_px, "Focal length [px]").Required();
  app.AddOption("--cx", options.camera.cx_px, "Principal point [px]").Required();
  app.AddOption("--cy", options.camera.cy_px, "Principal point [px]").Required();
  app.AddOption("--features", options.features, "Features per image").ShowDefault();
  app.AddOption("--every", options.every, "Every n-th frame is a view").ShowDefault().Positive();
  app.AddOption("--min-gap", options.min_gap_s, "Least time between compared views [s]").ShowDefault();
  app.AddOption("--max-distance", options.max_distance, "Same view: distance [m]").ShowDefault();
  app.AddOption("--max-angle", options.max_angle_deg, "Same view: turn [deg]").ShowDefault();
  app.AddOption("--accept-margin", options.accept_margin, "An estimated pose must be closer by this share")
      .ShowDefault();
  app.AddOption("--candidates", options.max_candidates, "Places verified per view").ShowDefault();
  app.AddOption("--seed", options.seed, "Seed of the verification").ShowDefault();
  app.AddOption("--csv", outputs.csv, "Write the curves as a table");
  app.AddOption("--svg", outputs.svg, "Draw the curves");
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
  dmslam::CommandLine app("Place recognition alone, scored against ground-truth poses", "dmslam-places-eval");
  app.SetVersion(dmslam::BuildVersion());
  dmslam::PlacesOptions options;
  Outputs outputs;
  AddOptions(app, options, outputs);
  return app.Run(argc, argv, [&] { Run(options, outputs); });
}
