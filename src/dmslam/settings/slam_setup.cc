#include "dmslam/settings/slam_setup.h"

#include <utility>

namespace dmslam {

Slam::Setup SlamSetup(const Settings& settings, const Camera& camera,
                      std::shared_ptr<const Vocabulary> vocabulary) {
  Slam::Setup setup;
  setup.frontend.options = settings.frontend;
  setup.frontend.extractor = settings.extractor;
  setup.frontend.initializer = settings.initializer;
  setup.frontend.camera = camera;
  setup.frontend.pyramid = settings.pyramid();
  setup.frontend.seed = settings.seed;
  setup.frontend.vocabulary = std::move(vocabulary);
  setup.mapper = settings.mapper;
  setup.loop = settings.loop;
  return setup;
}

}  // namespace dmslam
