#include "markdown.h"

#include <algorithm>
#include <cmath>

#include "compare.h"
#include "dmslam/util/format.h"

namespace dmslam {
namespace {

using State = RunResult::State;
constexpr const char* kNone = "–";
constexpr double kSameCoveragePercent = 1;

std::string Number(double value, int decimals) { return Format("%.*f", decimals, value); }

std::string Number(const std::optional<Spread>& spread, int decimals) {
  return spread ? Number(spread->median, decimals) : kNone;
}

std::string Number(const std::optional<double>& value, int decimals) {
  return value ? Number(*value, decimals) : kNone;
}

std::string Improvement(const std::optional<Spread>& before, const std::optional<Spread>& after) {
  return Number(ImprovementPercent(before, after), 1);
}

// Beside a comparison of two that did not track the same share of the sequence.
std::string CoverageMark(const Cell& baseline, const Cell& dm) {
  const auto before = baseline.TrackedPercent(), after = dm.TrackedPercent();
  const bool differ = before && after && std::abs(before->median - after->median) > kSameCoveragePercent;
  return differ ? " †" : "";
}

/// One of the paper's tables: a row per sequence with all systems and the improvement.
struct ErrorTable {
  std::string title;
  Metric metric;
  int decimals;
};

std::string ErrorTableHead() {
  std::string head = "| sequence |";
  std::string rule = "|---|";
  for (const char* system : {"baseline", "paper", "dm"}) {
    for (const char* column : {"RMSE", "mean", "median", "S.D.", "tracked %", "first map [s]", "runs"}) {
      head += Format(" %s %s |", system, column);
      rule += "---:|";
    }
  }
  for (const char* column : {"RMSE", "mean", "median", "S.D."}) {
    head += Format(" better by %% (%s) |", column);
    rule += "---:|";
  }
  return head + "\n" + rule + "\n";
}

std::string SystemCells(const Cell& cell, const ErrorTable& table) {
  const Metric metric = table.metric;
  return Format(" %s | %s | %s | %s | %s | %s | %s |", Number(cell.Rmse(metric), table.decimals).c_str(),
                Number(cell.Mean(metric), table.decimals).c_str(),
                Number(cell.Median(metric), table.decimals).c_str(),
                Number(cell.Std(metric), table.decimals).c_str(), Number(cell.TrackedPercent(), 1).c_str(),
                Number(cell.FirstMapSeconds(), 2).c_str(), RunsText(cell).c_str());
}

std::string PaperRow(const SequenceInfo& info) {
  const PaperFigures& paper = *info.paper;
  return Format(
      "| *the paper (its ORB-SLAM2; its DM-SLAM)* | *%.3f* | | | | *not given* | *not given* | *10* | *%.3f* "
      "| | | | *not given* | *not given* | *10* | | | | | | | | *%.1f* | | | |\n",
      paper.orb_slam2_ate_rmse_m, paper.dm_slam_ate_rmse_m, *PaperImprovementPercent(info));
}

std::string ErrorRow(const Cell& baseline, const Cell* paper, const Cell& dm, const ErrorTable& table) {
  const Metric metric = table.metric;
  const std::string mark = CoverageMark(baseline, dm);
  return "| " + baseline.sequence + " |" + SystemCells(baseline, table) +
         (paper != nullptr ? SystemCells(*paper, table) : " *not run* |" + std::string(6, '|')) +
         SystemCells(dm, table) + " " + Improvement(baseline.Rmse(metric), dm.Rmse(metric)) + mark + " | " +
         Improvement(baseline.Mean(metric), dm.Mean(metric)) + mark + " | " +
         Improvement(baseline.Median(metric), dm.Median(metric)) + mark + " | " +
         Improvement(baseline.Std(metric), dm.Std(metric)) + mark + " |\n";
}

std::string RenderErrorTable(const Results& results, const Setting& setting, const ErrorTable& table) {
  std::string text = "### " + table.title + "\n\n" + ErrorTableHead();
  for (const PlannedSequence& sequence : results.plan.sequences) {
    const std::string name(sequence.info.name);
    const Cell* baseline = results.Find(name, setting.name, "baseline");
    const Cell* dm = results.Find(name, setting.name, "dm");
    if (baseline != nullptr && dm != nullptr) {
      text += ErrorRow(*baseline, results.Find(name, setting.name, "paper"), *dm, table);
    } else {
      text += "| " + name + " | *absent* |" + std::string(24, '|') + "\n";
    }
    if (sequence.info.paper && table.metric == Metric::kAte) text += PaperRow(sequence.info);
  }
  return text + "\n";
}

std::string SpreadRow(const Cell& cell) {
  const std::string failed = Format("%zu of %zu", cell.Failed(), cell.Made());
  return Format("| %s | %s | %s | %s | %s | %s | %s | %s | %s | %s |\n", cell.sequence.c_str(),
                cell.profile.c_str(), RunsText(cell).c_str(), cell.Failed() == 0 ? "0" : failed.c_str(),
                WithEnds(cell.AteOnline(), 5).c_str(), WithEnds(cell.Rmse(Metric::kAte), 5).c_str(),
                WithEnds(cell.TrackedPercent(), 1).c_str(), WithEnds(cell.TrackedOnlinePercent(), 1).c_str(),
                WithEnds(cell.TrackedOnlineAfterFirstMapPercent(), 1).c_str(),
                WithEnds(cell.FirstMapSeconds(), 2).c_str());
}

std::string SpreadTable(const Results& results, const Setting& setting) {
  std::string text =
      "### Over the seeds: median (least–most)\n\n| sequence | profile | runs with a trajectory | failed | "
      "ATE RMSE as it came [m] | ATE RMSE in the end [m] | tracked % | tracked as it came % | the same after "
      "the first map % | first map [s] |\n"
      "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|\n";
  for (const Cell& cell : results.cells) {
    if (cell.setting == setting.name) text += SpreadRow(cell);
  }
  return text + "\n";
}

std::string StandInRow(const StandIn& one) {
  const auto with = one.dm->Rmse(Metric::kAte);
  const auto without =
      one.dm_without_actors == nullptr ? std::nullopt : one.dm_without_actors->Rmse(Metric::kAte);
  const auto baseline = one.baseline->Rmse(Metric::kAte);
  const SequenceInfo& info = one.sequence->info;
  return Format("| %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s |\n",
                std::string(info.name).c_str(), std::string(info.like).c_str(), Number(with, 5).c_str(),
                Number(without, 5).c_str(), Number(one.Ratio(), 2).c_str(),
                Number(one.dm->TrackedPercent(), 1).c_str(), Number(one.dm->FirstMapSeconds(), 2).c_str(),
                Number(one.dm->TrackedOnlineAfterFirstMapPercent(), 1).c_str(), Number(baseline, 5).c_str(),
                Number(one.baseline->TrackedPercent(), 1).c_str(),
                (Improvement(baseline, with) + CoverageMark(*one.baseline, *one.dm)).c_str(),
                Number(PaperImprovementPercent(info), 0).c_str());
}

// The rendered stand-ins: dm with actors against dm without, and its gain over the baseline beside the
// paper's.
std::string StandInTable(const Results& results, const Setting& setting) {
  std::string rows;
  for (const StandIn& one : StandIns(results, setting)) rows += StandInRow(one);
  if (rows.empty()) return {};
  return "### Rendered stand-ins: dm with actors against dm without\n\n"
         "Wanted: a ratio of 1.5 at most, 95 % tracked after the first map, and better than the baseline.\n\n"
         "| sequence | stands for | dm ATE [m] | dm ATE without actors [m] | ratio | dm tracked % "
         "| dm first map [s] | dm tracked after the first map % | baseline ATE [m] | baseline tracked % "
         "| dm better by % | the paper's gain on its sequence % |\n"
         "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n" +
         rows + "\n";
}

std::string Troubles(const Results& results) {
  std::string text;
  for (const Cell& cell : results.cells) {
    for (const RunResult& run : cell.runs) {
      if (run.state != State::kFailed && run.state != State::kNoTrajectory) continue;
      text += Format("| %s | %s | %s | %d | %s: %s |\n", cell.sequence.c_str(), cell.setting.c_str(),
                     cell.profile.c_str(), run.key.seed,
                     run.state == State::kFailed ? "the run failed" : "no trajectory", run.reason.c_str());
    }
  }
  if (text.empty()) return {};
  return "## Runs without a trajectory\n\n| sequence | settings | profile | seed | why "
         "|\n|---|---|---|---:|---|\n" +
         text + "\n";
}

const char* KindOf(const SequenceInfo& info) {
  if (info.group == SequenceGroup::kPaper) return "the paper's, real";
  if (info.group == SequenceGroup::kReal) return "real";
  const bool has_actors = info.group == SequenceGroup::kStandIn && info.like.starts_with("fr3_walking");
  return has_actors ? "rendered, two actors" : "rendered, nobody";
}

std::string WhetherHere(const PlannedSequence& sequence) {
  if (sequence.present()) return "yes";
  std::string absent = "**absent**: " + std::string(sequence.info.source);
  if (!sequence.has_runs) return absent;
  return absent + ". **Its runs are not shown**: give `scripts/reproduce.sh` its folder again";
}

std::string SequenceList(const Results& results) {
  std::string text = "## Sequences\n\n| sequence | kind | here |\n|---|---|---|\n";
  for (const PlannedSequence& sequence : results.plan.sequences) {
    text += Format("| %s | %s | %s |\n", std::string(sequence.info.name).c_str(), KindOf(sequence.info),
                   WhetherHere(sequence).c_str());
  }
  return text + "\n";
}

std::string TimesTable(const std::optional<IterationTimes>& times) {
  std::string text =
      "## Table 1. Time of 2000 iterations [ms]\n\n| | RANSAC | ARSAC | DLRSAC |\n|---|---:|---:|---:|\n";
  if (times) {
    text += Format("| here (%s) | %.1f | %.1f | %.1f |\n", times->machine.c_str(), times->ransac_ms,
                   times->arsac_ms, times->dlrsac_ms);
  } else {
    text += "| here | not measured | not measured | not measured |\n";
  }
  return text + Format("| *the paper (an i7)* | *%.1f* | *%.1f* | *%.1f* |\n\n", kPaperRansacMs,
                       kPaperArsacMs, kPaperDlrsacMs);
}

std::string HowManyRuns(const Results& results) {
  size_t planned = 0, made = 0, failed = 0;
  for (const Cell& cell : results.cells) {
    planned += cell.runs.size();
    made += cell.Made();
    failed += cell.Failed();
  }
  std::string text = Format("%zu of %zu runs are done (%d seeds)", made, planned, results.plan.seeds);
  if (failed == 0) return text + ".";
  return text +
         Format("; **%zu of %zu failed or gave no trajectory**: they count as 0 %% tracked.", failed, made);
}

// "" where it is one and the same: "A (30 runs), B (2 runs)".
std::string Mixture(const std::vector<Origin>& origins) {
  if (origins.size() < 2) return {};
  std::string text;
  for (const Origin& origin : origins) {
    text += (text.empty() ? "" : "; ") + origin.text + Format(" (%zu runs)", origin.runs);
  }
  return text;
}

std::string WhereRunsComeFrom(const Results& results) {
  std::string text;
  const std::vector<Origin> versions = Versions(results, nullptr), machines = Machines(results);
  if (versions.empty()) return text;
  const std::string mixed_versions = Mixture(versions), mixed_machines = Mixture(machines);
  if (mixed_versions.empty()) {
    text = "Version of the programs: " + versions.front().text + ".";
  } else {
    text = "**The runs are of several versions**: " + mixed_versions +
           ". Remove the folders of those of another version, and the same command runs them again.";
  }
  return text + " Machine: " + (mixed_machines.empty() ? machines.front().text : mixed_machines) + ".\n\n";
}

std::string Introduction(const Results& results) {
  return std::string(kReportHeading) +
         "\n\n"
         "Lu, Wang, Tang, Huang, Li: *DM-SLAM: Monocular SLAM in Dynamic Environments*, Appl. Sci. 2020, "
         "10(12), 4252. `baseline` stands where the paper has ORB-SLAM2, `paper` where it has DM-SLAM: its "
         "method and nothing that goes beyond it. `dm` is what goes beyond; it also joins the poses told at "
         "the end with the camera's motion (`tracking.smooth_at_end`). " +
         HowManyRuns(results) +
         " Each figure is the median over the seeds, of each column by itself; trajectories are aligned by "
         "Sim3, as monocular ones must be. Lengths are metres, angles degrees. *Tracked* is the share of the "
         "sequence's frames that have a pose in the final trajectory (none for a run without one): an error "
         "without it is no result. *Runs* are those with a trajectory, of those that were run. *Better by %* "
         "compares the medians of `baseline` and `dm` (in the paper's rows those of its two systems); † "
         "marks those of which one tracked over 1 % more of the frames than the "
         "other.\n\n" +
         WhereRunsComeFrom(results) +
         "Of the paper's figures only the RMSE of ATE and its Table 1 are recorded here; its other columns "
         "are left out rather than guessed, and it gives no coverage.\n\n";
}

std::string SettingSection(const Results& results, const Setting& setting) {
  static const std::vector<ErrorTable> kTables = {
      {"Table 2a. Rotational RPE per frame [deg]", Metric::kRpeRotationPerFrame, 4},
      {"Table 2b. Rotational RPE per second [deg]", Metric::kRpeRotationPerSecond, 4},
      {"Table 3a. Translational RPE per frame [m]", Metric::kRpeTranslationPerFrame, 5},
      {"Table 3b. Translational RPE per second [m]", Metric::kRpeTranslationPerSecond, 5},
      {"Table 4. ATE [m]", Metric::kAte, 5}};
  std::string text = "## With " + setting.title + "\n\n";
  if (const std::string mixed = Mixture(Versions(results, &setting)); !mixed.empty())
    text += "**These tables mix versions**: " + mixed + ".\n\n";
  for (const ErrorTable& table : kTables) text += RenderErrorTable(results, setting, table);
  return text + SpreadTable(results, setting) + StandInTable(results, setting);
}

/// What a section shows, and how its pictures are to be read.
struct SectionText {
  const char* title;
  const char* explanation;
};

SectionText TextOf(FigureSection section) {
  switch (section) {
    case FigureSection::kSelection:
      return {
          "Figures 2 to 5. Which matches are taken for static",
          "Left the cells, each with the matches that agree with its own motion and the kind of that motion; "
          "those that DLRSAC chose to begin with are framed. In the middle how the matches move: taken for "
          "static (green), left out (yellow). On the right how well the motion of one cell (row) explains "
          "the matches of another (column), the brighter the better. RANSAC knows no cells: it takes all "
          "matches at once."};
    case FigureSection::kFeatures:
      return {"Figure 6. Features as they are tracked",
              "Landmarks that the pose rests on (green), that disagree with it (yellow) or are taken for "
              "moving (red); features without a landmark are small and blue. Those on people are nearly all "
              "blue: they do not become landmarks. `dm`, default settings, seed 1."};
    case FigureSection::kTrajectories:
      return {
          "Figure 7. Trajectories over the ground truth, and relative errors",
          "Of each profile the run with the middle ATE (the lower of two); its coverage is its own, not the "
          "median of the tables."};
    case FigureSection::kSeeds:
      return {"All runs", "One point per run."};
  }
  return {"", ""};
}

std::string Image(const ReportPicture& picture) { return "![" + picture.title + "](" + picture.file + ")"; }

// Frames stand side by side, two to a row; figures one below the other.
std::string Pictures(const std::vector<ReportPicture>& pictures, FigureSection section) {
  std::string text;
  size_t column = 0;
  for (const ReportPicture& picture : pictures) {
    if (picture.section != section) continue;
    if (section != FigureSection::kFeatures) {
      text += "**" + picture.title + "**\n\n" + Image(picture) + "\n\n";
      continue;
    }
    if (text.empty()) text = "| | |\n|---|---|\n";
    text +=
        (column == 0 ? "| " : " ") + picture.title + "<br>" + Image(picture) + (column == 0 ? " |" : " |\n");
    column = 1 - column;
  }
  if (column == 1) text += " |\n";
  if (text.empty()) return text;
  const SectionText about = TextOf(section);
  return Format("## %s\n\n%s\n\n", about.title, about.explanation) + text + "\n";
}

// Sequences with runs but without a picture, as where a page must not show real images.
std::string WithoutPictures(const Results& results, const std::vector<ReportPicture>& pictures) {
  std::string names;
  for (const PlannedSequence& sequence : results.plan.sequences) {
    const auto is_of_it = [&](const ReportPicture& picture) {
      return picture.sequence == sequence.info.name;
    };
    if (!sequence.present() || pictures.empty() || std::ranges::any_of(pictures, is_of_it)) continue;
    names += (names.empty() ? "" : ", ") + std::string(sequence.info.name);
  }
  return names.empty() ? names : "Pictures of " + names + " are in the folder of the runs only.\n";
}

}  // namespace

std::string WithEnds(const std::optional<Spread>& spread, int decimals) {
  if (!spread) return kNone;
  if (spread->count < 2) return Number(spread->median, decimals);
  return Format("%.*f (%.*f–%.*f)", decimals, spread->median, decimals, spread->min, decimals, spread->max);
}

std::string RunsText(const Cell& cell) { return Format("%zu/%zu", cell.Count(State::kDone), cell.Made()); }

std::string ReportMarkdown(const Results& results, const std::optional<IterationTimes>& times,
                           const std::vector<ReportPicture>& pictures) {
  std::string text = Introduction(results) + SequenceList(results) + TimesTable(times);
  for (const Setting& setting : results.plan.settings) text += SettingSection(results, setting);
  text += Troubles(results);
  for (const FigureSection section : {FigureSection::kSelection, FigureSection::kFeatures,
                                      FigureSection::kTrajectories, FigureSection::kSeeds}) {
    text += Pictures(pictures, section);
  }
  return text + WithoutPictures(results, pictures);
}

}  // namespace dmslam
