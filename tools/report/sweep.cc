#include "sweep.h"

#include <array>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "dmslam/dataset/text_table.h"
#include "dmslam/util/check.h"
#include "dmslam/util/format.h"
#include "markdown.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using State = RunResult::State;

constexpr std::array<int, 9> kShares = {0, 10, 20, 30, 40, 50, 60, 70, 80};
constexpr const char* kBegin = "<!-- written by scripts/sweep.sh -->";
constexpr const char* kEnd = "<!-- end of what scripts/sweep.sh writes -->";

const std::vector<SweepKind>& Kinds() {
  static const std::vector<SweepKind> kinds = {{"walk", "people walk"},
                                               {"stop-and-go", "people walk and stop"}};
  return kinds;
}

struct Variant {
  const char* name;
  const char* profile;
  const char* title;
};
constexpr std::array<Variant, 7> kVariants = {{{"dm", "dm", "`dm`, everything on"},
                                               {"no_exclusion", "dm", "`mapping.mutual_exclusion=off`"},
                                               {"no_belief", "dm", "`tracking.motion_belief=off`"},
                                               {"no_seen_through", "dm", "`mapping.seen_through=off`"},
                                               {"arsac", "dm", "`initializer.method=arsac`"},
                                               {"ransac", "dm", "`initializer.method=ransac`"},
                                               {"baseline", "baseline", "`--profile baseline`"}}};

// Nobody is there: the same sequence for all kinds.
std::string SequenceName(const SweepKind& kind, int share_percent) {
  return share_percent == 0 ? "synth_0" : "synth_" + kind.name + "_" + std::to_string(share_percent);
}

double NumberOf(const fs::path& file, const char* key) {
  const Json json = Json::parse(ReadTextFile(file.string()), nullptr, false);
  if (!json.is_object() || !json.contains(key) || !json[key].is_number())
    throw InputError(file.string() + ": has no number '" + key +
                     "'; remove its folder, so that it is made again");
  return json[key].get<double>();
}

Cell ReadCell(const std::string& sequence, const std::string& setting, const std::string& profile, int seeds,
              const fs::path& out, const fs::path& folder) {
  Cell cell{sequence, setting, profile, {}};
  for (int seed = 1; seed <= seeds; ++seed)
    cell.runs.push_back(ReadRun({sequence, setting, profile, seed}, out, folder));
  return cell;
}

std::vector<SweepPoint> ReadPoints(const fs::path& out, int seeds) {
  std::vector<SweepPoint> points;
  for (const SweepKind& kind : Kinds()) {
    for (const int share : kShares) {
      const std::string name = SequenceName(kind, share);
      const fs::path folder = out / "sequences" / name;
      if (!fs::exists(folder / "synthetic.json")) continue;
      SweepPoint point{kind, share, 0, 0, {}, {}};
      point.coverage_percent = 100 * NumberOf(folder / "synthetic.json", "mean_coverage");
      point.moving_percent = 100 * NumberOf(folder / "synthetic.json", "mean_moving_coverage");
      point.dm = ReadCell(name, "sweep", "dm", seeds, out, folder);
      point.baseline = ReadCell(name, "sweep", "baseline", seeds, out, folder);
      points.push_back(std::move(point));
    }
  }
  return points;
}

std::vector<AblationRow> ReadAblation(const fs::path& out, const fs::path& data, int seeds) {
  std::vector<AblationRow> rows;
  for (const char* sequence : {"kitchen_walk1", "kitchen_walk2"}) {
    if (!fs::exists(out / "runs" / sequence) || !fs::exists(data / sequence / "rgb.txt")) continue;
    for (const Variant& variant : kVariants) {
      AblationRow row;
      row.title = variant.title;
      row.cell = ReadCell(sequence, variant.name, variant.profile, seeds, out, data / sequence);
      std::vector<double> on_people;
      for (const RunResult& run : row.cell.runs) {
        const fs::path judged = out / run.key.Folder() / "map.json";
        if (fs::exists(judged)) on_people.push_back(NumberOf(judged, "on_people_percent"));
      }
      row.on_people_percent = SpreadOf(std::move(on_people));
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

size_t RunsDone(const Cell& cell) { return cell.runs.size() - cell.Count(State::kMissing); }

std::string CellColumns(const Cell& cell) {
  if (RunsDone(cell) == 0) return " not run | | | |";
  return Format(" %s | %s | %s | %s |", RunsText(cell).c_str(), WithEnds(cell.Rmse(Metric::kAte), 4).c_str(),
                WithEnds(cell.TrackedPercent(), 1).c_str(),
                WithEnds(cell.TrackedOnlineAfterFirstMapPercent(), 1).c_str());
}

std::string SweepTable(const Sweep& sweep, const SweepKind& kind) {
  std::string rows;
  for (const SweepPoint& point : sweep.points) {
    if (point.kind.name != kind.name) continue;
    rows +=
        Format("| %d | %.1f / %.1f |", point.share_percent, point.coverage_percent, point.moving_percent) +
        CellColumns(point.dm) + CellColumns(point.baseline) + "\n";
  }
  if (rows.empty()) return {};
  std::string head = "| asked % | covered / moving % |", rule = "|---:|---:|";
  for (const char* profile : {"dm", "baseline"}) {
    for (const char* column : {"runs", "ATE [m]", "tracked %", "online after the first map %"}) {
      head += Format(" %s %s |", profile, column);
      rule += "---:|";
    }
  }
  return "### Sweep: " + kind.title + "\n\n" + head + "\n" + rule + "\n" + rows + "\n";
}

std::string AblationTable(const Sweep& sweep) {
  std::string text, sequence;
  for (const AblationRow& row : sweep.ablation) {
    if (row.cell.sequence != sequence) {
      sequence = row.cell.sequence;
      text += (text.empty() ? "### Ablation: " : "\n### Ablation: ") + sequence +
              "\n\n| | runs | ATE [m] | tracked online % | tracked % | landmarks on people % |\n"
              "|---|---:|---:|---:|---:|---:|\n";
    }
    text +=
        Format("| %s | %s | %s | %s | %s | %s |\n", row.title.c_str(), RunsText(row.cell).c_str(),
               WithEnds(row.cell.Rmse(Metric::kAte), 4).c_str(),
               WithEnds(row.cell.TrackedOnlinePercent(), 1).c_str(),
               WithEnds(row.cell.TrackedPercent(), 1).c_str(), WithEnds(row.on_people_percent, 2).c_str());
  }
  return text.empty() ? text : text + "\n";
}

using NumberOfRun = std::function<std::optional<double>(const RunResult&)>;

PlotSeries SeriesOf(const Sweep& sweep, const SweepKind& kind, Cell SweepPoint::*profile,
                    const NumberOfRun& number) {
  PlotSeries series;
  series.marker_radius_px = 3;
  for (const SweepPoint& point : sweep.points) {
    if (point.kind.name != kind.name) continue;
    std::vector<double> values;
    for (const RunResult& run : (point.*profile).runs) {
      if (const auto value = number(run)) values.push_back(*value);
    }
    const std::optional<Spread> spread = SpreadOf(std::move(values));
    constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
    series.x.push_back(point.coverage_percent);
    series.y.push_back(spread ? spread->median : kNothing);
    series.y_low.push_back(spread ? spread->min : kNothing);
    series.y_high.push_back(spread ? spread->max : kNothing);
  }
  return series;
}

PlotPanel PanelOf(const Sweep& sweep, const SweepKind& kind, const NumberOfRun& number) {
  PlotPanel panel;
  panel.x_label = "image covered by people, mean [%]";
  panel.x_range = PlotRange{-2, 75};
  panel.series.push_back(SeriesOf(sweep, kind, &SweepPoint::dm, number));
  panel.series.back().label = "dm";
  panel.series.push_back(SeriesOf(sweep, kind, &SweepPoint::baseline, number));
  panel.series.back().label = "baseline";
  panel.series.back().color = kPlotPalette[1];
  return panel;
}

}  // namespace

Sweep ReadSweep(const fs::path& out, const fs::path& data, int seeds) {
  return {seeds, ReadPoints(out, seeds), ReadAblation(out, data, seeds)};
}

PlotFigure SweepFigure(const Sweep& sweep) {
  PlotFigure figure;
  figure.title = "People in the picture";
  figure.subtitle =
      "rendered room, median over the seeds, least to most shaded; a run without a trajectory has no ATE "
      "and tracks nothing";
  figure.columns = Kinds().size();
  for (const SweepKind& kind : Kinds()) {
    figure.panels.push_back(PanelOf(sweep, kind, [](const RunResult& run) -> std::optional<double> {
      return run.evaluation ? std::optional<double>(run.evaluation->ate.rmse()) : std::nullopt;
    }));
    figure.panels.back().title = "Accuracy: " + kind.title;
    figure.panels.back().y_label = "ATE RMSE [m]";
    figure.panels.back().y_log = true;
  }
  // One legend serves all panels; in the others it would hide a band.
  for (PlotSeries& series : figure.panels.front().series) series.label.clear();
  for (const SweepKind& kind : Kinds()) {
    figure.panels.push_back(PanelOf(sweep, kind, [](const RunResult& run) { return run.tracked_percent; }));
    for (PlotSeries& series : figure.panels.back().series) series.label.clear();
    figure.panels.back().title = "Coverage: " + kind.title;
    figure.panels.back().y_label = "tracked [%]";
    figure.panels.back().y_range = PlotRange{0, 105};
  }
  return figure;
}

std::string SweepMarkdown(const Sweep& sweep, const std::string& picture) {
  size_t planned = 0, done = 0;
  const auto count = [&](const Cell& cell) {
    planned += cell.runs.size();
    done += RunsDone(cell);
  };
  for (const SweepPoint& point : sweep.points) {
    if (point.share_percent == 0 && point.kind.name != Kinds().front().name) continue;
    count(point.dm);
    count(point.baseline);
  }
  for (const AblationRow& row : sweep.ablation) count(row.cell);
  std::string text = Format(
      "%zu of %zu runs are done (%d seeds). Each figure is the median over the seeds, with least and most "
      "where there are "
      "several. *Runs* are those with a trajectory, of those that were run.\n\n",
      done, planned, sweep.seeds);
  if (!picture.empty()) text += "![ATE and coverage over the share of people](" + picture + ")\n\n";
  for (const SweepKind& kind : Kinds()) text += SweepTable(sweep, kind);
  text += AblationTable(sweep);
  return text;
}

std::string ReplaceBetweenMarks(const std::string& page, const std::string& text) {
  const size_t begin = page.find(kBegin), end = page.find(kEnd);
  if (begin == std::string::npos || end == std::string::npos || end < begin)
    throw InputError(std::string("the page to publish on needs the lines '") + kBegin + "' and '" + kEnd +
                     "'");
  return page.substr(0, begin) + kBegin + "\n\n" + text + page.substr(end);
}

}  // namespace dmslam
