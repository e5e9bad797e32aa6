#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "dmslam/settings/settings.h"
#include "dmslam/wire/frontend_messages.h"

namespace dmslam {

/// Exit code of a process that cannot take part in a session as it is: another camera, other settings,
/// another vocabulary, other message types. Who starts it again would be refused again.
inline constexpr int kExitMisfit = 2;

/// Why a process with these settings and this vocabulary (if it has one) does not fit the frontend's
/// session, with the cure; empty where it fits.
std::string WhyMisfit(const SessionStart& start, const Settings& settings,
                      std::optional<uint64_t> vocabulary_checksum = std::nullopt);

}  // namespace dmslam
