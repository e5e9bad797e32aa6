#pragma once

#include <string>
#include <vector>

#include "results.h"

namespace dmslam {

/// The sections of the report's figures, in their order.
enum class FigureSection {
  kSelection,     // which matches are taken for static: the paper's Figures 2 to 5
  kFeatures,      // features of frames as they are tracked: its Figure 6
  kTrajectories,  // trajectories and relative errors: its Figure 7
  kSeeds          // every run's error and coverage
};

/// A picture of the report.
struct ReportPicture {
  FigureSection section;
  std::string sequence;  // empty: about all of them
  std::string title;
  std::string file;  // relative to the report
};

/// Times of 2000 iterations [ms], as the paper's Table 1 has them, measured on this machine.
struct IterationTimes {
  double ransac_ms = 0;
  double arsac_ms = 0;
  double dlrsac_ms = 0;
  std::string machine;
};

/// The first line of the report.
inline constexpr const char* kReportHeading = "# Results beside the DM-SLAM paper's";

/// The paper's Tables 1 to 4 with the paper's own figures beside ours, coverage beside every error, and what
/// is absent.
std::string ReportMarkdown(const Results& results, const std::optional<IterationTimes>& times,
                           const std::vector<ReportPicture>& pictures);

/// The same numbers as a JSON document, with those of every run.
std::string ReportJson(const Results& results, const std::optional<IterationTimes>& times);

/// Table cells: the median, and least and most where there are several values; runs with a trajectory of
/// those done.
std::string WithEnds(const std::optional<Spread>& spread, int decimals);
std::string RunsText(const Cell& cell);

}  // namespace dmslam
