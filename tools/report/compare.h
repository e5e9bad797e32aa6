#pragma once

#include <optional>
#include <string>
#include <vector>

#include "results.h"

namespace dmslam {

/// By how many percent the median of `after` is smaller than that of `before`; nothing where one has none.
std::optional<double> ImprovementPercent(const std::optional<Spread>& before,
                                         const std::optional<Spread>& after);

/// The paper's own, of the RMSE of ATE from ORB-SLAM2 to DM-SLAM, on the sequence or on the one it stands
/// for; nothing for a stand-in without its actors.
std::optional<double> PaperImprovementPercent(const SequenceInfo& info);

/// A rendered stand-in with actors, and the same without them. All pointers lead into the results.
struct StandIn {
  const PlannedSequence* sequence = nullptr;
  const Cell* baseline = nullptr;
  const Cell* dm = nullptr;
  const Cell* dm_without_actors = nullptr;  // null where that sequence is absent, or where there is none

  /// ATE of `dm` with actors by its ATE without them (medians of the RMSE).
  std::optional<double> Ratio() const;
};
std::vector<StandIn> StandIns(const Results& results, const Setting& setting);

/// How many runs say the same about where they come from; most first.
struct Origin {
  std::string text;
  size_t runs = 0;
};

/// The versions of the programs that made the runs of one setting, or of all (nullptr). A run without one
/// counts as "not recorded". Runs that failed left no summary and are not counted.
std::vector<Origin> Versions(const Results& results, const Setting* setting);

/// The machines on which all runs were made, as "AMD EPYC, 2 cores".
std::vector<Origin> Machines(const Results& results);
std::string MachineText(const Machine& machine);

}  // namespace dmslam
