#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "paper.h"

namespace dmslam {

/// A sequence as it is on this machine.
struct PlannedSequence {
  SequenceInfo info;
  // Its folder; empty where it is absent.
  std::filesystem::path folder;
  // Runs of it lie in the output folder; where it is absent, they cannot be judged.
  bool has_runs = false;
  bool present() const { return !folder.empty(); }
};

/// A set of settings under which everything is run.
struct Setting {
  std::string name;      // a folder's name
  std::string title;     // as tables call it
  std::string argument;  // for `--set`; empty: defaults
};

/// What is to be run.
struct Plan {
  int seeds = 10;
  std::vector<PlannedSequence> sequences;
  std::vector<Setting> settings;
  std::vector<std::string> profiles;  // "baseline", "paper", "dm"
};

/// One run of it.
struct RunKey {
  std::string sequence;
  std::string setting;
  std::string profile;
  int seed = 1;

  /// Its folder under the output folder: runs/<sequence>/<setting>/<profile>/seed_<n>.
  std::filesystem::path Folder() const;
};

struct PlanOptions {
  std::vector<std::filesystem::path> roots;  // searched in this order for the sequences' folders
  int seeds = 10;
  std::vector<std::string> only;  // names of sequences; empty: all
};

/// Looks for the sequences under the roots (a folder of the sequence's name, in a root or one folder deeper,
/// that holds an rgb.txt). Throws InputError for a name that is not known, seeds below one, or a root that is
/// no folder.
Plan MakePlan(const PlanOptions& options);

/// All runs of the sequences that are present, seed by seed: stopped early, all tables have equally many.
std::vector<RunKey> Runs(const Plan& plan);

/// Both together: the larger number of seeds and all sequences, in the order of the tables, each in the
/// folder where `now` found it, else where `before` did.
Plan MergePlans(const Plan& before, const Plan& now);

/// Kept as plan.json in the output folder; SavePlan merges with the one that is there. LoadPlan throws
/// InputError that names the file.
void SavePlan(const Plan& plan, const std::filesystem::path& out);
Plan LoadPlan(const std::filesystem::path& out);

/// Everything that was planned or run in the output folder: its plan, and whatever lies in its folder `runs`
/// beyond that. Where there is no plan.json, that is all; throws InputError where there is no folder `runs`
/// either. A sequence that is found under `roots` is taken from there; one that is no longer where the plan
/// says is taken from the folder `synthetic`, or is absent.
Plan PlanOfFolder(const std::filesystem::path& out, const std::vector<std::filesystem::path>& roots = {});

}  // namespace dmslam
