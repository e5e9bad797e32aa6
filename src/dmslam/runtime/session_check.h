#pragma once

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

}  // namespace dmslam
