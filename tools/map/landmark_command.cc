#include "landmark_command.h"

#include <cstdio>
#include <map>
#include <vector>

#include "dmslam/console/log.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"
#include "landmark_json.h"
#include "landmark_text.h"

namespace dmslam {
namespace {

std::optional<LandmarkId> IdOf(const LandmarkArguments& a) {
  if (a.all && !a.id.empty()) throw InputError("give a landmark or --all, not both");
  if (a.all && a.json.empty()) throw InputError("--all: give --json FILE, which they are written to");
  if (a.all) return std::nullopt;
  if (a.id.empty()) throw InputError("give a landmark, such as 1:217, or --all --json FILE");
  const std::optional<LandmarkId> id = ParseLandmarkId(a.id);
  if (!id) {
    throw InputError("landmark '" + a.id +
                     "': is no landmark's name; give ORDINAL:NUMBER, such as 1:217, or the one number that "
                     "messages carry");
  }
  return id;
}

/// What the file lacks of the whole story.
void Warn(const LandmarkProofs& proofs) {
  if (proofs.read.missing > 0) {
    LogWarning("{}: {} map records are missing; what they said of landmarks is not told", proofs.path,
               proofs.read.missing);
  }
  const ProvenRun* run = proofs.RunOf(proofs.session);
  if (proofs.of_log && run != nullptr && !run->settings_known) {
    LogWarning(
        "{}: the run had other settings than profile {} has: give its own --config and --set, since the "
        "rules "
        "by which landmarks were removed are those of the settings given here",
        proofs.path, run->start.profile);
  }
}

[[noreturn]] void RefuseUnknown(const LandmarkProofs& proofs, LandmarkId id) {
  std::map<uint16_t, uint64_t> highest;  // number by ordinal
  size_t there = 0;
  for (const auto& [known, history] : proofs.histories.landmarks()) {
    highest[known.epoch_ordinal()] = known.number();
    there += history.end ? 0 : 1;
  }
  const size_t all = proofs.histories.landmarks().size();
  std::string text = proofs.path + ": knows no landmark " + NameOf(id) + ": it holds " +
                     std::to_string(there) + " and knows of " + std::to_string(all - there) +
                     " that are gone";
  for (const auto& [ordinal, number] : highest)
    text += ", the last one of ordinal " + std::to_string(ordinal) + " is " +
            NameOf(LandmarkId::Make(ordinal, number));
  text += "; --all --json FILE lists them";
  if (!proofs.of_log) text += ", and of one that went long before the map was saved only the run's log tells";
  throw InputError(text);
}

}  // namespace

int TellLandmark(const LandmarkArguments& arguments, const std::optional<BusKey>& key) {
  const std::optional<LandmarkId> id = IdOf(arguments);
  if (!arguments.json.empty()) CheckFolderOf(arguments.json);
  const LandmarkProofs proofs = ReadProofs(arguments.source, id, key);
  Warn(proofs);
  const std::map<LandmarkId, LandmarkHistory>& all = proofs.histories.landmarks();
  std::vector<const LandmarkHistory*> wanted;
  if (id) {
    const auto history = all.find(*id);
    if (history == all.end()) RefuseUnknown(proofs, *id);
    wanted = {&history->second};
    std::fputs(ProofText(proofs, history->second).c_str(), stdout);
  } else {
    for (const auto& [known, history] : all) wanted.push_back(&history);
    std::printf("%s%zu landmarks, %zu in the map\n", RunsText(proofs).c_str(), all.size(),
                proofs.map().num_landmarks());
  }
  if (!arguments.json.empty()) WriteProofJson(arguments.json, proofs, wanted);
  return 0;
}

}  // namespace dmslam
