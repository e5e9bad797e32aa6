#include "dmslam/runtime/session_check.h"

#include <array>
#include <cstdio>

#include "dmslam/util/version.h"

namespace dmslam {
namespace {

std::string Hex(uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

std::string Describe(const std::string& profile, const std::string& seed, uint64_t hash) {
  return "profile " + profile + ", seed " + seed + ", hash " + Hex(hash);
}

}  // namespace

std::string WhyMisfit(const SessionStart& start, const Settings& settings,
                      std::optional<uint64_t> vocabulary_checksum) {
  const std::string frontend = "the frontend of session " + std::to_string(start.session) + " (version " +
                               start.software + ", this is " + kVersion + ") has ";
  if (start.configuration_hash != settings.Hash()) {
    return frontend + "other settings (" +
           Describe(start.profile, std::to_string(start.seed), start.configuration_hash) +
           ") than this process (" + Describe(settings.profile(), settings.Value("seed"), settings.Hash()) +
           "); give every process the same --config and --set";
  }
  const bool compared = start.vocabulary_checksum && vocabulary_checksum;
  if (compared && *start.vocabulary_checksum != *vocabulary_checksum) {
    return frontend + "another vocabulary (checksum " + Hex(*start.vocabulary_checksum) +
           ") than this process (" + Hex(*vocabulary_checksum) + "); give both the same --vocabulary";
  }
  return "";
}

std::string WhyNotTheseCameras(const std::string& first_file, size_t others, size_t files_of_others) {
  if (files_of_others == 0) return "";
  if (files_of_others != others) {
    return "--also-camera: give one for each --also, or none (" + std::to_string(files_of_others) + " for " +
           std::to_string(others) + ")";
  }
  return first_file.empty() ? "--also-camera goes with --camera, by whose model all frames are told" : "";
}

}  // namespace dmslam
