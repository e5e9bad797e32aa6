#pragma once

namespace dmslam {

/// The project's version, as `--version` prints it.
inline constexpr const char* kVersion = "0.1.0";

}  // namespace dmslam
