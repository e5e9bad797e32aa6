#pragma once

#include <memory>
#include <utility>

#include "dmslam/settings/frontend_setup.h"
#include "dmslam/slam/slam.h"

namespace dmslam {

/// The SLAM of these settings. Without a vocabulary no loop is closed, and a lost camera is looked for in the
/// newest places only. In a header as FrontendSetup: who includes it links dmslam::slam, too.
inline Slam::Setup SlamSetup(const Settings& settings, const Camera& camera,
                             std::shared_ptr<const Vocabulary> vocabulary) {
  Slam::Setup setup;
  setup.frontend = FrontendSetup(settings, camera, std::move(vocabulary));
  setup.mapper = settings.Read<MapperOptions>();
  setup.loop = settings.Read<LoopcloserOptions>();
  return setup;
}

}  // namespace dmslam
