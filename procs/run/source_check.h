#pragma once

#include "dmslam/camera/camera.h"
#include "dmslam/settings/settings.h"
#include "run/run_options.h"

namespace dmslam {

/// That of the first camera, by which the frames of all others are told. Throws InputError where it is not
/// known.
Camera CameraThatPlays(const RunArguments& arguments);

/// What all processes of the run are told. Throws InputError that names what does not fit.
Settings SettingsOf(const RunArguments& arguments);

/// Throws InputError where a process of the run would refuse the settings, or what is to be played: each
/// recording is opened as its player will, with its camera. MisfitError where its frames, or another
/// camera's, are not of the model that they are to be told by. A camera may come later: it is not looked for.
/// Writes nothing, so that what an earlier run has left in the folder stays as it is.
void CheckSources(const RunArguments& arguments);

}  // namespace dmslam
