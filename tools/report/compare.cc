#include "compare.h"

#include <algorithm>
#include <functional>
#include <map>

namespace dmslam {
namespace {

constexpr const char* kNotRecorded = "not recorded";

const Cell* DmWithoutActors(const Results& results, const SequenceInfo& info, const Setting& setting) {
  for (const PlannedSequence& sequence : results.plan.sequences) {
    if (sequence.info.group == SequenceGroup::kStandInStill && sequence.info.like == info.like)
      return results.Find(std::string(sequence.info.name), setting.name, "dm");
  }
  return nullptr;
}

std::vector<Origin> CountOrigins(const Results& results, const Setting* setting,
                                 const std::function<std::string(const RunResult&)>& text) {
  std::map<std::string, size_t> counts;
  for (const Cell& cell : results.cells) {
    if (setting != nullptr && cell.setting != setting->name) continue;
    for (const RunResult& run : cell.runs) {
      const bool has_summary =
          run.state == RunResult::State::kDone || run.state == RunResult::State::kNoTrajectory;
      if (has_summary) ++counts[text(run)];
    }
  }
  std::vector<Origin> origins;
  origins.reserve(counts.size());
  for (const auto& [name, runs] : counts) origins.push_back({name, runs});
  std::stable_sort(origins.begin(), origins.end(),
                   [](const Origin& a, const Origin& b) { return a.runs > b.runs; });
  return origins;
}

std::string VersionText(const RunResult& run) {
  if (!run.version) return kNotRecorded;
  const bool names_commit = run.version->find('+') != std::string::npos;
  return names_commit ? *run.version : *run.version + ", commit not recorded";
}

}  // namespace

std::optional<double> ImprovementPercent(const std::optional<Spread>& before,
                                         const std::optional<Spread>& after) {
  if (!before || !after || !(before->median > 0)) return std::nullopt;
  return 100 * (1 - after->median / before->median);
}

std::optional<double> PaperImprovementPercent(const SequenceInfo& info) {
  if (info.group == SequenceGroup::kStandInStill) return std::nullopt;
  const std::optional<PaperFigures>& paper = info.like.empty() ? info.paper : FindSequence(info.like).paper;
  if (!paper) return std::nullopt;
  return 100 * (1 - paper->dm_slam_ate_rmse_m / paper->orb_slam2_ate_rmse_m);
}

std::optional<double> StandIn::Ratio() const {
  const auto with = dm->Rmse(Metric::kAte);
  const auto without = dm_without_actors == nullptr ? std::nullopt : dm_without_actors->Rmse(Metric::kAte);
  if (!with || !without || !(without->median > 0)) return std::nullopt;
  return with->median / without->median;
}

std::vector<StandIn> StandIns(const Results& results, const Setting& setting) {
  std::vector<StandIn> stand_ins;
  for (const PlannedSequence& sequence : results.plan.sequences) {
    if (sequence.info.group != SequenceGroup::kStandIn || !sequence.present()) continue;
    const std::string name(sequence.info.name);
    const StandIn one{&sequence, results.Find(name, setting.name, "baseline"),
                      results.Find(name, setting.name, "dm"),
                      DmWithoutActors(results, sequence.info, setting)};
    if (one.baseline != nullptr && one.dm != nullptr) stand_ins.push_back(one);
  }
  return stand_ins;
}

std::vector<Origin> Versions(const Results& results, const Setting* setting) {
  return CountOrigins(results, setting, VersionText);
}

std::string MachineText(const Machine& machine) {
  return machine.processor + ", " + std::to_string(machine.cores) + (machine.cores == 1 ? " core" : " cores");
}

std::vector<Origin> Machines(const Results& results) {
  return CountOrigins(results, nullptr, [](const RunResult& run) {
    return run.machine ? MachineText(*run.machine) : std::string(kNotRecorded);
  });
}

}  // namespace dmslam
