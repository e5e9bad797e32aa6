#pragma once

#include <optional>
#include <string>

#include "run/run_options.h"

namespace dmslam {

/// Throws InputError where the map to begin in (`--map`) is none, is a log that lacks records of it, or does
/// not go with the camera and the settings of the run; MisfitError where it was made with another vocabulary.
/// Writes nothing. With programs from elsewhere (`--build-dir`) their mapper judges the vocabulary that ships
/// with them. What is to be said of a map that may be begun in, but is that of a run's middle.
std::optional<std::string> CheckMap(const RunArguments& arguments);

}  // namespace dmslam
