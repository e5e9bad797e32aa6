#pragma once

#include "run/run_options.h"

namespace dmslam {

/// Throws InputError where the map to begin in (`--map`) is none, or does not go with the camera and the
/// settings of the run; MisfitError where it was made with another vocabulary. Writes nothing. With programs
/// from elsewhere (`--build-dir`) their mapper judges the vocabulary.
void CheckMap(const RunArguments& arguments);

}  // namespace dmslam
