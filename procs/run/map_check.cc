#include "run/map_check.h"

#include <memory>
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

}  // namespace

void CheckMap(const RunArguments& a) {
  const std::string& path = a.map.begin;
  if (path.empty()) return;
  const SessionStart made = MadeWith(path);
  CheckFits(path, made, CameraThatPlays(a), SettingsOf(a.settings).Read<Pyramid>());
  if (a.build_folder.empty()) CheckVocabulary(path, made, LoadVocabulary("")->checksum());
}

}  // namespace dmslam
