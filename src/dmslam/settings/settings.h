#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "dmslam/features/orb_extractor.h"
#include "dmslam/initialization/initializer.h"
#include "dmslam/loops/loopcloser_core.h"
#include "dmslam/mapping/mapper_options.h"
#include "dmslam/slam/frontend_options.h"

namespace dmslam {

/// With which map a run begins.
struct StartOptions {
  bool saved_map = false;  ///< the mapper has loaded one: the frontend waits for it and finds itself in it
  bool localize_only = false;  ///< ... and nothing changes it
};

/// Everything that can be set and that changes results: the same file and the same `--set`s go to every
/// process.
struct Settings {
  Settings() { extractor.num_features = 2000; }

  uint64_t seed = 1;
  std::string profile = "dm";
  OrbExtractorOptions extractor;
  InitializerOptions initializer;
  FrontendOptions frontend;
  MapperOptions mapper;
  LoopcloserOptions loop;
  StartOptions start;

  const Pyramid& pyramid() const { return extractor.pyramid; }
};

/// One setting as people see it.
struct SettingInfo {
  std::string key;    ///< "tracking.motion_belief"
  std::string value;  ///< as it is set
  std::string help;
};

/// Sets one value. Throws InputError that names the key (and the nearest one that exists) or what the value
/// should be. "profile=baseline" sets several at once: plain RANSAC initialisation, no mutual exclusion, no
/// motion belief.
void ApplySetting(std::string_view key, std::string_view value, Settings* settings);

/// Reads a configuration file (YAML: sections of keys) and then the overrides "key=value". Throws InputError
/// that names file, key and cure.
Settings LoadSettings(const std::string& path, const std::vector<std::string>& overrides);

/// All settings with their values.
std::vector<SettingInfo> ListSettings(const Settings& settings);

/// Hash over all values: two processes with the same hash agree.
uint64_t SettingsHash(const Settings& settings);

}  // namespace dmslam
