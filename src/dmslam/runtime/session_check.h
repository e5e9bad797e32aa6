#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "dmslam/runtime/exit_codes.h"
#include "dmslam/settings/settings.h"
#include "dmslam/wire/frontend_messages.h"

namespace dmslam {

/// Why a process with these settings and this vocabulary (if it has one) does not fit the frontend's
/// session, with the cure; empty where it fits.
std::string WhyMisfit(const SessionStart& start, const Settings& settings,
                      std::optional<uint64_t> vocabulary_checksum = std::nullopt);

/// What is wrong with the camera files of a run of several cameras: that of the first one, by whose model all
/// are told, and those of the `others`; empty: nothing.
std::string WhyNotTheseCameras(const std::string& first_file, size_t others, size_t files_of_others);

}  // namespace dmslam
