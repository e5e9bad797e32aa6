// dmslam-eval: the errors of a trajectory against its ground truth.
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>

#include "dmslam/console/command_line.h"
#include "dmslam/evaluation/report.h"
#include "dmslam/evaluation/trajectory_plot.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "nees_main.h"

namespace dmslam {
namespace {

struct Arguments {
  std::string ground_truth;
  std::string estimate;
  std::string align = "sim3";
  double max_difference_s = 0.02;
  std::vector<std::string> rpe_deltas = {"1f", "1s", "1m"};
  bool all_pairs = false;
  std::string frames;
  std::optional<int64_t> frame_count;
  std::string json;
  std::string plot;
  std::string title;
};

RpeOptions ParseDelta(const std::string& text, bool all_pairs) {
  RpeOptions options;
  options.all_pairs = all_pairs;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), options.delta);
  const std::string unit(end, text.data() + text.size());
  if (unit == "s") options.unit = RpeUnit::kSeconds;
  if (unit == "m") options.unit = RpeUnit::kMetres;
  const bool known = unit == "f" || unit == "s" || unit == "m";
  if (error != std::errc() || !known || !(options.delta > 0) || !std::isfinite(options.delta) ||
      (unit == "f" && options.delta != std::floor(options.delta)) || options.delta > kMaxRpeDelta) {
    throw InputError("--rpe-delta " + text +
                     ": write a positive number, up to 1e9, and f, s or m, as 1f, 0.5s or 1m");
  }
  return options;
}

EvaluationOptions ParseOptions(const Arguments& arguments) {
  EvaluationOptions options;
  const auto alignment = ParseAlignment(arguments.align);
  if (!alignment) throw InputError("--align " + arguments.align + ": choose sim3, se3, scale or none");
  options.alignment = *alignment;
  if (!(arguments.max_difference_s >= 0) || arguments.max_difference_s > 1e6) {
    throw InputError("--max-diff: write seconds, not less than 0");
  }
  options.max_difference_ns = std::llround(arguments.max_difference_s * 1e9);
  for (const std::string& delta : arguments.rpe_deltas) {
    options.rpe.push_back(ParseDelta(delta, arguments.all_pairs));
  }
  return options;
}

// The image list that is named, or whose folder is; empty where none is.
std::string FrameList(const Arguments& arguments) {
  const std::filesystem::path list = arguments.frames;
  return std::filesystem::is_directory(list) ? (list / "rgb.txt").string() : arguments.frames;
}

Coverage FindCoverage(const Arguments& arguments, const std::vector<StampedPose>& estimate) {
  if (arguments.frames.empty()) {
    const int64_t frames = arguments.frame_count.value_or(0);
    if (arguments.frame_count && frames < static_cast<int64_t>(estimate.size())) {
      throw InputError(
          "--frame-count " + std::to_string(frames) + ": " + arguments.estimate + " has " +
          std::to_string(estimate.size()) +
          " poses; write the number of all frames of the sequence, or give its list to --frames");
    }
    return ComputeCoverage(estimate, static_cast<size_t>(frames));
  }
  return ComputeCoverage(estimate, ReadFrameStamps(FrameList(arguments)));
}

std::string PlotPrefix(const std::string& named) {
  const std::filesystem::path path(named);
  const bool has_ending = path.extension() == ".png" || path.extension() == ".svg";
  return has_ending ? std::filesystem::path(path).replace_extension().string() : named;
}

// What is written must be none of what is read, and no folder.
void CheckOutput(const std::string& option, const std::string& output, const Arguments& arguments) {
  namespace fs = std::filesystem;
  const auto refuse = [&](const std::string& why) { throw InputError(option + " " + output + ": " + why); };
  if (fs::path(output).filename().empty() || fs::is_directory(output))
    refuse("is the name of a folder; write FOLDER/NAME");
  for (const std::string& input : {arguments.ground_truth, arguments.estimate, FrameList(arguments)}) {
    std::error_code error;
    if (!input.empty() && fs::equivalent(output, input, error))
      refuse("is read too, and would be lost; name another file");
  }
}

void CheckOutputs(const Arguments& arguments) {
  if (!arguments.json.empty()) CheckOutput("--json", arguments.json, arguments);
  if (arguments.plot.empty()) return;
  const std::string prefix = PlotPrefix(arguments.plot);
  if (std::filesystem::path(prefix).filename().empty())
    throw InputError("--plot " + prefix + ": is the name of a folder; write FOLDER/NAME");
  for (const char* ending : {".png", ".svg"}) CheckOutput("--plot", prefix + ending, arguments);
}

void WriteText(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.flush();
  if (!file) throw InputError(path + ": cannot be written; check that the folder exists and has space");
}

void Run(const Arguments& arguments) {
  const EvaluationOptions options = ParseOptions(arguments);
  CheckOutputs(arguments);
  const GroundTruth truth = ReadGroundTruth(arguments.ground_truth);
  for (const std::string& where : truth.repeated) {
    std::cerr << "dmslam-eval: " << where << " repeats the stamp before it and is left out\n";
  }
  const std::vector<StampedPose> estimate = ReadTrajectory(arguments.estimate);
  const Evaluation evaluation = Evaluate(truth.poses, estimate, options, FindCoverage(arguments, estimate));
  if (!evaluation.ate.usable()) {
    throw InputError(arguments.estimate + " against " + arguments.ground_truth + ": " +
                     evaluation.ate.reason);
  }
  std::cout << EvaluationTable(evaluation);
  if (!arguments.json.empty()) WriteText(arguments.json, EvaluationJson(evaluation));
  if (arguments.plot.empty()) return;
  const std::string title = arguments.title.empty()
                                ? std::filesystem::path(arguments.estimate).filename().string()
                                : arguments.title;
  const PlotFigure figure =
      TrajectoryFigure(truth.poses, estimate, evaluation.ate, title, EvaluationSummary(evaluation));
  const std::string prefix = PlotPrefix(arguments.plot);
  WritePng(figure, prefix + ".png");
  WriteSvg(figure, prefix + ".svg");
  std::cout << "\nwritten: " << prefix << ".png, " << prefix << ".svg\n";
}

void Declare(dmslam::CommandLine* app, Arguments* arguments) {
  app->AddOption("GT", arguments->ground_truth, "ground truth, TUM format").Required();
  app->AddOption("EST", arguments->estimate, "estimated trajectory, TUM format").Required();
  app->AddOption("--align", arguments->align,
                 "how the estimate is laid onto the ground truth: sim3, se3, scale, none")
      .ShowDefault();
  app->AddOption("--max-diff", arguments->max_difference_s, "poses further apart in time are no pair [s]")
      .ShowDefault();
  app->AddOption("--rpe-delta", arguments->rpe_deltas,
                 "lengths of the relative motions: a number and f (frames), s (seconds) or m (metres)")
      .ShowDefault();
  app->AddFlag("--rpe-all-pairs", arguments->all_pairs,
               "in frames and metres, motions from every pose instead of end to end");
  const dmslam::CommandLineOption frames = app->AddOption(
      "--frames", arguments->frames, "image list (rgb.txt) or its folder, for the share covered");
  app->AddOption("--frame-count", arguments->frame_count, "number of frames, where there is no list")
      .Excludes(frames);
  app->AddOption("--json", arguments->json, "write the figures to this file");
  app->AddOption("--plot", arguments->plot,
                 "draw PREFIX.png and PREFIX.svg: top and side view, error over time");
  app->AddOption("--title", arguments->title, "title of the plot (default: the estimate's file name)");
  app->SetVersion(BuildVersion());
}

}  // namespace
}  // namespace dmslam

int main(int argc, char** argv) {
  if (argc > 1 && std::string(argv[1]) == "nees") return dmslam::NeesMain(argc - 1, argv + 1);
  dmslam::CommandLine app(
      "Errors of a trajectory against its ground truth: ATE, RPE and coverage, as text, JSON and pictures. "
      "\"dmslam-eval nees\" judges covariances (see \"dmslam-eval nees --help\").",
      "dmslam-eval");
  dmslam::Arguments arguments;
  dmslam::Declare(&app, &arguments);
  return app.Run(argc, argv, [&] {
    dmslam::Run(arguments);
    std::cout.flush();
    if (!std::cout) throw dmslam::InputError("the standard output cannot be written; is its disk full?");
  });
}
