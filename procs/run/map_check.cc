#include "run/map_check.h"

#include <optional>
#include <string>

#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/recording/map_file.h"
#include "dmslam/runtime/load_vocabulary.h"
#include "run/source_check.h"

namespace dmslam {
namespace {

/// Nothing of what a log has recorded of a map may be missing. Says where its run went on.
std::optional<std::string> CheckWhole(const std::string& path, const std::optional<BusKey>& key) {
  const LogIndex log(path, key);
  if (log.Session().IsSavedMap()) return std::nullopt;
  const RebuiltMap rebuilt = RebuildMap(log, log.Session());
  if (rebuilt.missing > 0) {
    throw InputError(path + ": is not whole: " + std::to_string(rebuilt.missing) +
                     " map records are missing; what is there is saved with dmslam-map --log " + path +
                     " --save FILE");
  }
  if (rebuilt.ended) return std::nullopt;
  return path + ": the log ends before its run did; the map has the " +
         std::to_string(rebuilt.map.keyframes().size()) + " keyframes of that time";
}

}  // namespace

std::optional<std::string> CheckMap(const RunArguments& a) {
  const std::string& path = a.map.begin;
  if (path.empty()) return std::nullopt;
  const SessionStart made = MadeWith(path);
  CheckFits(path, made, CameraThatPlays(a), SettingsOf(a).Read<Pyramid>());
  const std::string& vocabulary = a.settings.vocabulary;
  if (a.build_folder.empty() || !vocabulary.empty())
    CheckVocabulary(path, made, LoadVocabulary(vocabulary)->checksum());
  return CheckWhole(path, BusKey::LoadIfWanted(a.bus.key));
}

}  // namespace dmslam
