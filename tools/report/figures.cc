#include "figures.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>

#include "dmslam/evaluation/plot.h"
#include "dmslam/evaluation/trajectory_plot.h"
#include "dmslam/util/check.h"
#include "dmslam/util/format.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;
constexpr double kNoPoint = std::numeric_limits<double>::quiet_NaN();

PlotColor ColorOfProfile(const std::string& profile) {
  if (profile == "dm") return kPlotPalette[0];
  return profile == "paper" ? kPlotPalette[2] : kPlotPalette[1];
}

/// A run with the trajectories it is about.
struct Drawn {
  const RunResult* run;
  std::vector<StampedPose> ground_truth;
  std::vector<StampedPose> estimate;
};

std::optional<Drawn> Load(const Cell* cell, const PlannedSequence& sequence, const fs::path& out) {
  const RunResult* run = cell == nullptr ? nullptr : cell->MedianRun();
  if (run == nullptr) return std::nullopt;
  return Drawn{run, ReadGroundTruth((sequence.folder / "groundtruth.txt").string()).poses,
               ReadTrajectory((out / run->key.Folder() / "trajectory.txt").string())};
}

// From every few poses of the estimate to where the ground truth has them.
PlotSeries Differences(const PlotSeries& ground_truth, const PlotSeries& estimate, const AteReport& ate) {
  PlotSeries series;
  series.label = "difference";
  series.color = {200, 40, 60};
  series.line_width_px = 1;
  const size_t step = std::max<size_t>(1, ate.pairs.size() / 200);
  size_t pair = 0;
  for (size_t i = 0; i < estimate.x.size(); ++i) {
    if (std::isnan(estimate.x[i])) continue;
    const size_t truth = ate.pairs[pair].ground_truth;
    if (pair++ % step != 0) continue;
    series.x.insert(series.x.end(), {estimate.x[i], ground_truth.x[truth], kNoPoint});
    series.y.insert(series.y.end(), {estimate.y[i], ground_truth.y[truth], kNoPoint});
  }
  return series;
}

// Ground truth, estimate and, every few poses, the line between the two.
PlotPanel OverlayPanel(const Drawn& drawn) {
  const AteReport& ate = drawn.run->evaluation->ate;
  PlotFigure figure = TrajectoryFigure(drawn.ground_truth, drawn.estimate, ate, "");
  PlotPanel panel = figure.panels[0];
  panel.title = Format("%s: ATE RMSE %.4f m, tracked %.1f %%", drawn.run->key.profile.c_str(), ate.rmse(),
                       drawn.run->tracked_percent.value_or(kNoPoint));
  panel.color_bar.reset();
  PlotSeries& estimate = panel.series[1];
  estimate.values.clear();
  estimate.color = ColorOfProfile(drawn.run->key.profile);
  estimate.label = drawn.run->key.profile;
  estimate.marker_radius_px = 0;
  panel.series.pop_back();  // the first pose
  panel.series.insert(panel.series.begin() + 1, Differences(panel.series[0], panel.series[1], ate));
  return panel;
}

// The errors of relative motions over one second, at the moment they begin.
PlotSeries RelativeErrors(const Drawn& drawn, bool rotation) {
  const RpeReport& rpe = drawn.run->evaluation->rpe[1];
  PlotSeries series;
  series.label = drawn.run->key.profile;
  series.color = ColorOfProfile(drawn.run->key.profile);
  series.line_width_px = 1.4;
  double last_s = -1e9;
  for (size_t i = 0; i < rpe.motions.size(); ++i) {
    const int64_t stamp_ns = drawn.ground_truth[rpe.pairs[rpe.motions[i].from].ground_truth].stamp_ns;
    const double seconds = 1e-9 * static_cast<double>(stamp_ns - drawn.ground_truth.front().stamp_ns);
    if (seconds - last_s > 1) {
      series.x.push_back(kNoPoint);
      series.y.push_back(kNoPoint);
    }
    last_s = seconds;
    series.x.push_back(seconds);
    series.y.push_back(rotation ? rpe.rotation_errors_deg[i] : rpe.translation_errors[i]);
  }
  return series;
}

PlotPanel RelativePanel(const std::vector<Drawn>& drawn, bool rotation) {
  PlotPanel panel;
  panel.title = rotation ? "Rotational RPE per second" : "Translational RPE per second";
  panel.x_label = "time since the first ground truth [s]";
  panel.y_label = rotation ? "rotation error [deg]" : "translation error [m]";
  panel.y_from_zero = true;
  for (const Drawn& one : drawn) {
    if (one.run->evaluation->rpe[1].usable()) panel.series.push_back(RelativeErrors(one, rotation));
  }
  return panel;
}

ReportPicture Save(const PlotFigure& figure, FigureSection section, const std::string& sequence,
                   const std::string& name, const fs::path& out) {
  const std::string file = "pictures/" + name + ".png";
  WritePng(figure, (out / file).string());
  WriteSvg(figure, (out / ("pictures/" + name + ".svg")).string());
  return {section, sequence, figure.title, file};
}

void DrawSequence(const Results& results, const PlannedSequence& sequence, const Setting& setting,
                  const fs::path& out, std::vector<ReportPicture>* pictures) {
  const std::string name(sequence.info.name);
  std::vector<Drawn> drawn;
  for (const std::string& profile : results.plan.profiles) {
    if (auto one = Load(results.Find(name, setting.name, profile), sequence, out))
      drawn.push_back(std::move(*one));
  }
  if (drawn.empty()) return;
  PlotFigure figure;
  figure.title = name + ", " + setting.title;
  figure.subtitle =
      "runs with the middle ATE, seen from the top, over the ground truth (grey); relative errors over one "
      "second";
  figure.columns = 2;
  for (const Drawn& one : drawn) figure.panels.push_back(OverlayPanel(one));
  if (drawn.size() == 1) figure.panels[0].column_span = 2;
  for (const bool rotation : {false, true}) figure.panels.push_back(RelativePanel(drawn, rotation));
  pictures->push_back(Save(figure, FigureSection::kTrajectories, name, name + "_" + setting.name, out));
}

/// One point per seed, the profiles side by side above each sequence's name.
PlotPanel SeedsPanel(const Results& results, const Setting& setting, const std::vector<std::string>& names,
                     const std::function<std::optional<double>(const RunResult&)>& number) {
  PlotPanel panel;
  panel.column_span = 1;
  panel.x_categories = names;
  const double middle = 0.5 * (static_cast<double>(results.plan.profiles.size()) - 1);
  for (size_t p = 0; p < results.plan.profiles.size(); ++p) {
    const std::string& profile = results.plan.profiles[p];
    PlotSeries series;
    series.label = profile;
    series.color = ColorOfProfile(profile);
    series.color.alpha = 0.75;
    series.line_width_px = 0;
    series.marker_radius_px = 3.5;
    for (size_t i = 0; i < names.size(); ++i) {
      const Cell* cell = results.Find(names[i], setting.name, profile);
      for (const RunResult& run : cell == nullptr ? std::vector<RunResult>() : cell->runs) {
        const std::optional<double> value = number(run);
        if (!value) continue;
        series.x.push_back(static_cast<double>(i) + 0.2 * (static_cast<double>(p) - middle));
        series.y.push_back(*value);
      }
    }
    panel.series.push_back(std::move(series));
  }
  return panel;
}

void DrawSeeds(const Results& results, const Setting& setting, const fs::path& out,
               std::vector<ReportPicture>* pictures) {
  std::vector<std::string> names;
  bool any = false;
  for (const PlannedSequence& sequence : results.plan.sequences) {
    if (sequence.present()) names.emplace_back(sequence.info.name);
  }
  for (const Cell& cell : results.cells)
    any = any || (cell.setting == setting.name && cell.MedianRun() != nullptr);
  if (!any) return;
  PlotFigure figure;
  figure.title = "All seeds, " + setting.title;
  figure.subtitle = "one point per run; a run without a trajectory has no error and tracks nothing";
  figure.panel_width_px = std::max(620.0, 150.0 * static_cast<double>(names.size()));
  figure.panel_height_px = 330;
  figure.panels.push_back(
      SeedsPanel(results, setting, names, [](const RunResult& run) -> std::optional<double> {
        return run.evaluation ? std::optional<double>(run.evaluation->ate.rmse()) : std::nullopt;
      }));
  figure.panels.back().title = "Accuracy";
  figure.panels.back().y_label = "ATE RMSE [m]";
  figure.panels.back().y_log = true;
  figure.panels.push_back(
      SeedsPanel(results, setting, names, [](const RunResult& run) { return run.tracked_percent; }));
  figure.panels.back().title = "Coverage";
  figure.panels.back().y_label = "tracked [%]";
  figure.panels.back().y_range = PlotRange{0, 105};
  pictures->push_back(Save(figure, FigureSection::kSeeds, "", "all_" + setting.name, out));
}

std::vector<fs::path> PicturesIn(const fs::path& folder) {
  std::vector<fs::path> files;
  if (!fs::is_directory(folder)) return files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".png") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// The number at the end of a name such as frame_000215; nothing where there is none.
std::optional<size_t> NumberAtEnd(const std::string& name) {
  const std::string digits = name.substr(name.find_last_not_of("0123456789") + 1);
  return digits.empty() || digits.size() > 9 ? std::nullopt : std::optional<size_t>(std::stoul(digits));
}

// Frames with their features, that the first seed's run of `dm` with default settings left; before the first
// map there is nothing to see on them.
void AddFramePictures(const Results& results, const PlannedSequence& sequence, const fs::path& out,
                      std::vector<ReportPicture>* pictures) {
  const std::string name(sequence.info.name);
  const Cell* cell = results.Find(name, "defaults", "dm");
  if (cell == nullptr || cell->runs.empty()) return;
  const RunResult& run = cell->runs.front();
  const auto stamps_ns = ReadFrameStamps((sequence.folder / "rgb.txt").string());
  for (const fs::path& file : PicturesIn(out / run.key.Folder() / "pictures")) {
    const auto frame = NumberAtEnd(file.stem().string());
    if (!frame || *frame >= stamps_ns.size()) continue;
    const double seconds = 1e-9 * static_cast<double>(stamps_ns[*frame] - stamps_ns.front());
    if (seconds <= run.first_map_s.value_or(0)) continue;
    pictures->push_back({FigureSection::kFeatures, name, Format("%s, frame %zu", name.c_str(), *frame),
                         file.lexically_relative(out).string()});
  }
}

// "pair_0_5_dlrsac" as "frames 0 and 5, DLRSAC"; other names as they are.
std::string PairTitle(const std::string& stem) {
  size_t first = 0, second = 0;
  std::array<char, 16> method{};
  if (std::sscanf(stem.c_str(), "pair_%zu_%zu_%15s", &first, &second, method.data()) != 3) return stem;
  std::string upper(method.data());
  std::ranges::transform(upper, upper.begin(), [](unsigned char c) { return std::toupper(c); });
  return Format("frames %zu and %zu, %s", first, second, upper.c_str());
}

void AddSelectionPictures(const std::string& sequence, const fs::path& out,
                          std::vector<ReportPicture>* pictures) {
  for (const fs::path& file : PicturesIn(out / "figures" / sequence)) {
    pictures->push_back({FigureSection::kSelection, sequence,
                         sequence + ", " + PairTitle(file.stem().string()),
                         file.lexically_relative(out).string()});
  }
}

}  // namespace

std::vector<ReportPicture> DrawPictures(const Results& results, const fs::path& out) {
  std::error_code error;
  fs::create_directories(out / "pictures", error);
  if (error) throw InputError((out / "pictures").string() + ": cannot be made; check --out");
  std::vector<ReportPicture> pictures;
  for (const PlannedSequence& sequence : results.plan.sequences) {
    if (!sequence.present()) continue;
    AddSelectionPictures(std::string(sequence.info.name), out, &pictures);
    AddFramePictures(results, sequence, out, &pictures);
  }
  for (const Setting& setting : results.plan.settings) {
    DrawSeeds(results, setting, out, &pictures);
    for (const PlannedSequence& sequence : results.plan.sequences) {
      if (sequence.present()) DrawSequence(results, sequence, setting, out, &pictures);
    }
  }
  return pictures;
}

}  // namespace dmslam
