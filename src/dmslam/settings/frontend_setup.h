#pragma once

#include <memory>
#include <utility>

#include "dmslam/camera/camera.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/settings/run_options.h"
#include "dmslam/settings/settings.h"
#include "dmslam/slam/frontend_core.h"

namespace dmslam {

/// The frontend of these settings. Without a vocabulary a lost camera is looked for in the newest places
/// only. In a header, so that the library of this room links none of the rooms that it sets: who includes it
/// links dmslam::slam, too.
inline FrontendCore::Setup FrontendSetup(const Settings& settings, const Camera& camera,
                                         std::shared_ptr<const Vocabulary> vocabulary) {
  FrontendCore::Setup setup;
  setup.options = settings.Read<FrontendOptions>();
  setup.extractor = settings.Read<OrbExtractorOptions>();
  setup.initializer = settings.Read<InitializerOptions>();
  setup.camera = camera;
  setup.pyramid = setup.extractor.pyramid;
  setup.seed = settings.Read<RunOptions>().seed;
  setup.vocabulary = std::move(vocabulary);
  return setup;
}

}  // namespace dmslam
