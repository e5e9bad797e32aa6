#pragma once

namespace dmslam {

/// The project's version, as `--version` prints it; the programs of a run name the commit too
/// (build_version.h).
inline constexpr const char* kVersion = "0.1.0";

}  // namespace dmslam
