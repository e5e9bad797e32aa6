#include "nees_main.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "dmslam/console/command_line.h"
#include "dmslam/evaluation/nees.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

struct Arguments {
  std::vector<std::string> runs;
  std::string plot;
  NeesOptions options;
  bool details = false;
};

/// A sequence's folder and the folder of a run on it.
struct Run {
  std::filesystem::path sequence, results;
};

struct Interval {
  double after_s = 1.0;
  std::vector<std::vector<NeesPair>> of_runs;

  std::vector<NeesPair> All() const {
    std::vector<NeesPair> all;
    for (const auto& pairs : of_runs) all.insert(all.end(), pairs.begin(), pairs.end());
    return all;
  }
};

Run ParseRun(const std::string& text) {
  const size_t at = text.find('=');
  if (at == std::string::npos)
    throw InputError(text + ": write SEQUENCE=RUN, the folder of a sequence and that of a run on it");
  return {text.substr(0, at), text.substr(at + 1)};
}

/// By frame; none where there is no such file.
std::vector<double> ReadCoverage(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<double> shares;
  for (double share = 0; file >> share;) shares.push_back(share);
  return shares;
}

void Print(const std::string& name, const NeesSummary& s) {
  std::printf("| %s | %zu | %.2f | %.1f | %.2f | %.1f | %.1f |\n", name.c_str(), s.count, s.position,
              100 * s.position_beyond, s.rotation, 100 * s.rotation_beyond, 100 * s.outside);
}

void PrintInterval(const Interval& interval, const std::vector<Run>& runs, bool details) {
  char name[40];
  std::snprintf(name, sizeof(name), "%g s", interval.after_s);
  Print(name, Summarize(interval.All()));
  constexpr const char* kThirds[] = {"least covered third", "middle third", "most covered third"};
  for (int third = 0; third < 3; ++third) {
    Print(std::string(name) + ", " + kThirds[third], Summarize(ThirdByCoverage(interval.All(), third)));
  }
  for (size_t i = 0; details && i < runs.size(); ++i)
    Print(std::string(name) + ", " + runs[i].results.filename().string(), Summarize(interval.of_runs[i]));
}

void Evaluate(const Arguments& arguments) {
  std::vector<Run> runs;
  for (const std::string& text : arguments.runs) runs.push_back(ParseRun(text));
  std::vector<Interval> intervals = {{1.0, {}}, {10.0, {}}};
  for (const Run& run : runs) {
    const GroundTruth truth = ReadGroundTruth((run.sequence / "groundtruth.txt").string());
    const std::vector<ToldPose> told = ReadToldPoses((run.results / "poses_online.csv").string());
    const std::vector<double> coverage = ReadCoverage(run.sequence / "coverage.txt");
    for (Interval& interval : intervals) {
      interval.of_runs.push_back(
          ComputeNees(truth.poses, told, coverage, interval.after_s, arguments.options));
    }
  }
  std::printf(
      "Normalised error squared of relative poses, over its dimension (right: 1).\n\n"
      "| over | pairs | position | beyond 99.9 %% [%%] | rotation | beyond 99.9 %% [%%] | outside 3 sigma + "
      "%g mm [%%] |\n|---|---|---|---|---|---|---|\n",
      arguments.options.slack_m * 1e3);
  for (const Interval& interval : intervals) PrintInterval(interval, runs, arguments.details);
  if (arguments.plot.empty()) return;
  std::vector<NeesCurve> curves;
  for (const Interval& interval : intervals) {
    if (!interval.of_runs.front().empty()) curves.push_back({interval.after_s, interval.of_runs.front()});
  }
  if (curves.empty()) throw InputError("--plot: the first run has no relative poses to show");
  const PlotFigure figure = NeesFigure(curves, "Errors and what was told of them");
  WritePng(figure, arguments.plot + ".png");
  WriteSvg(figure, arguments.plot + ".svg");
}

}  // namespace

int NeesMain(int argc, char** argv) {
  CommandLine app(
      "How the errors of relative poses compare with their covariances: normalised errors squared over 1 s "
      "and 10 s, "
      "overall and by how much of the image moving things cover.",
      "dmslam-eval nees");
  Arguments arguments;
  app.AddOption("SEQUENCE=RUN", arguments.runs,
                "folder of a sequence (groundtruth.txt, coverage.txt) and of a run on it (poses_online.csv)")
      .Required();
  app.AddOption("--gauge", arguments.options.gauge_s, "the scale is that of the first seconds [s]")
      .ShowDefault();
  app.AddOption("--model-error", arguments.options.model.model_error, "of the poses, as a share of the depth")
      .ShowDefault();
  app.AddOption("--drift", arguments.options.model.drift,
                "of the map between two poses, as a share of the depth")
      .ShowDefault();
  app.AddOption("--slack", arguments.options.slack_m, "a truth may be wrong by so much [m]").ShowDefault();
  app.AddFlag("--details", arguments.details, "also each run");
  app.AddOption("--plot", arguments.plot, "draw PREFIX.png and PREFIX.svg of the first run");
  app.SetVersion(BuildVersion());
  if (const auto code = app.Parse(argc, argv)) return *code;
  try {
    Evaluate(arguments);
  } catch (const std::exception& error) {
    std::cerr << "dmslam-eval: " << error.what() << "\n";
    return 1;
  }
  return 0;
}

}  // namespace dmslam
