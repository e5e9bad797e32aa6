#pragma once

#include <memory>

#include "dmslam/camera/camera.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/settings/settings.h"
#include "dmslam/slam/slam.h"

namespace dmslam {

/// The SLAM of these settings. Without a vocabulary no loop is closed, and a lost camera is looked for in the
/// newest places only.
Slam::Setup SlamSetup(const Settings& settings, const Camera& camera,
                      std::shared_ptr<const Vocabulary> vocabulary);

}  // namespace dmslam
