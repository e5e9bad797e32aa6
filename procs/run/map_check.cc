#include "run/map_check.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/dataset/frame_source.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/recording/map_file.h"
#include "dmslam/recording/recorded_frames.h"
#include "dmslam/runtime/load_vocabulary.h"
#include "dmslam/runtime/process_main.h"
#include "dmslam/settings/settings.h"

namespace dmslam {
namespace {

/// That of the first camera, which all others are told as.
Camera CameraThatPlays(const RunArguments& a) {
  const std::string& log = a.source.log.empty() ? a.source.replay : a.source.log;
  if (!a.camera.file.empty()) return LoadCamera(a.camera.file);
  if (log.empty()) return KnownCamera(a.source.sequence, FindDataFolder("config"));
  const auto index = std::make_shared<const LogIndex>(log, BusKey::LoadIfWanted(a.bus.key));
  return RecordedFrames(index, 0).camera_info().camera;
}

Settings SettingsOf(const RunArguments::Settings& settings) {
  std::vector<std::string> overrides;
  if (!settings.profile.empty()) overrides.push_back("profile=" + settings.profile);
  overrides.insert(overrides.end(), settings.sets.begin(), settings.sets.end());
  return LoadSettings(settings.config, overrides);
}

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
  CheckFits(path, made, CameraThatPlays(a), SettingsOf(a.settings).Read<Pyramid>());
  if (a.build_folder.empty()) CheckVocabulary(path, made, LoadVocabulary("")->checksum());
  return CheckWhole(path, BusKey::LoadIfWanted(a.bus.key));
}

}  // namespace dmslam
