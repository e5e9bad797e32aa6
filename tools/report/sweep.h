#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "dmslam/evaluation/plot.h"
#include "results.h"

namespace dmslam {

/// How people move in the sweep's sequences.
struct SweepKind {
  std::string name;   // as `dmslam-synth --behaviour` calls it
  std::string title;  // as tables call it
};

/// Runs on one of scripts/sweep.sh's sequences.
struct SweepPoint {
  SweepKind kind;
  int share_percent = 0;        // of the image that people were asked to cover
  double coverage_percent = 0;  // that they do cover, mean over the frames
  double moving_percent = 0;    // of the image that is covered by those who move in the frame
  Cell dm;
  Cell baseline;
};

/// One variant of the ablation on one sequence.
struct AblationRow {
  std::string title;
  Cell cell;
  std::optional<Spread> on_people_percent;  // landmarks of the final map seen mostly on people
};

/// What scripts/sweep.sh has run so far.
struct Sweep {
  int seeds = 0;
  std::vector<SweepPoint> points;     // by kind, then by share; only sequences that were rendered
  std::vector<AblationRow> ablation;  // by sequence, then by variant
};

/// Reads the results in `out`; `data` holds the kitchen sequences. Throws InputError for what is damaged.
Sweep ReadSweep(const std::filesystem::path& out, const std::filesystem::path& data, int seeds);

/// ATE and share tracked over the share of the image that people cover: median, and least to most as a band.
PlotFigure SweepFigure(const Sweep& sweep);

/// The tables, and the picture under `picture` (empty: none).
std::string SweepMarkdown(const Sweep& sweep, const std::string& picture);

/// `page` with what stands between its marks replaced by `text`. Throws InputError where there are none.
std::string ReplaceBetweenMarks(const std::string& page, const std::string& text);

}  // namespace dmslam
