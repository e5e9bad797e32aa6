#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/evaluation/run_verdict.h"

namespace dmslam {

/// One sequence of a population.
struct PopulationSequence {
  std::string half;              ///< "develop" or "report"
  std::string name;              ///< of the sequence, and of its folder among the runs
  std::string kind;              ///< "composited": limits in metres; "rendered": in shares of the path
  std::filesystem::path folder;  ///< rgb.txt, groundtruth.txt, coverage.txt
};

/// Reads lines of "half, name, kind, folder", separated by tabs. Throws InputError that names file and line.
std::vector<PopulationSequence> ReadPopulation(const std::filesystem::path& list);

/// Where a system's runs are: one folder per sequence.
struct PopulationSystem {
  std::string name;
  std::filesystem::path runs;
};

/// "dm=FOLDER"; throws InputError for anything else.
PopulationSystem ParsePopulationSystem(const std::string& text);

/// What one system made of one sequence.
struct PopulationRun {
  PopulationSequence sequence;
  std::string system;
  double path_m = 0;              ///< length of the camera's path
  double mean_covered_share = 0;  ///< of the image
  double max_covered_share = 0;
  enum class State { kMissing, kFailed, kDone } state = State::kMissing;
  std::string reason;  ///< why it failed
  std::string version;
  RunVerdict verdict;  ///< of a failed run: no success
  /// What ATE is told in: 1 for metres, the path's length for percent of it.
  double AteUnit() const { return sequence.kind == "rendered" ? 0.01 * path_m : 1.0; }
};

/// Sequences with this mean share of the image covered: [from, to).
struct CoverageClass {
  double from = 0;
  double to = 1;
  std::string title;
};
const std::vector<CoverageClass>& CoverageClasses();

/// A number over the sequences of a class; infinite where a run has none.
struct MedianAndWorst {
  double median = 0;
  double worst = 0;
};

/// One system on the sequences of one class. ATE as PopulationRun::AteUnit says.
struct PopulationRow {
  std::string title;
  std::string system;
  size_t sequences = 0;  ///< that were run
  size_t missing = 0;
  size_t successes = 0;
  MedianAndWorst online_ate, final_ate, wrong_poses_s, first_map_s;
  double most_wrong_poses_in_success_s = 0;
  size_t loops = 0, false_loops = 0, unknown_loops = 0;
  size_t wrong_first_maps = 0;
};

/// Reads the runs of all systems, sequence by sequence. Throws InputError for damaged sequences.
std::vector<PopulationRun> ReadPopulationRuns(const std::vector<PopulationSequence>& sequences,
                                              const std::vector<PopulationSystem>& systems);

/// Rows for runs of one kind: class by class, then all; in each, system by system.
std::vector<PopulationRow> PopulationRows(const std::vector<PopulationRun>& runs);

/// Tables by kind. Single sequences of the report half are shown only with `details`.
std::string PopulationMarkdown(const std::vector<PopulationRun>& runs, bool details);
std::string PopulationJson(const std::vector<PopulationRun>& runs, bool details);

}  // namespace dmslam
