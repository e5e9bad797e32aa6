#pragma once

#include <cstdint>
#include <string>

namespace dmslam {

/// The project's version. `--version` prints the commit behind it (build_version.h).
inline constexpr const char* kVersion = "0.2.0";

/// Version of what travels and of what is recorded: streams, message types, logs. Every beacon of a stream
/// and every session says it; another one is refused by name.
inline constexpr int32_t kProtocolVersion = 2;

/// For people: the version of the project that speaks a protocol, as "version 0.1".
inline std::string NameOfProtocol(int32_t protocol) {
  if (protocol == 1) return "version 0.1";
  if (protocol == kProtocolVersion) return "version 0.2";
  return "a version with protocol " + std::to_string(protocol);
}

}  // namespace dmslam
