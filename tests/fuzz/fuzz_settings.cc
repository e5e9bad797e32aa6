// Configuration files: read, or refused with an InputError.
#include "dmslam/settings/registry.h"
#include "dmslam/settings/settings.h"
#include "fuzz_target.h"
#include "memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const dmslam::fuzz::MemoryFile file(data, size);
  try {
    dmslam::LoadSettings(file.path(), {}).Hash();
  } catch (const dmslam::InputError&) {
  }
  return 0;
}

namespace dmslam::fuzz {

std::vector<std::vector<uint8_t>> Seeds() {
  std::string all, section;
  for (const SettingInfo& setting : AllSettings()) {
    const size_t dot = setting.key.find('.');
    const std::string of = dot == std::string::npos ? "" : setting.key.substr(0, dot);
    if (of != section) all += of + ":\n";
    section = of;
    all += (of.empty() ? "" : "  ") + setting.key.substr(dot == std::string::npos ? 0 : dot + 1) + ": " +
           setting.value + "\n";
  }
  return {SeedOf(all), SeedOf("initializer: {method: ransac}\n"), SeedOf("seed: 3\n")};
}

}  // namespace dmslam::fuzz
