#include "dmslam/runtime/load_vocabulary.h"

#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/runtime/process_main.h"

namespace dmslam {

std::shared_ptr<const Vocabulary> LoadVocabulary(const std::string& path) {
  const std::string file = path.empty() ? FindDataFolder("data") + "/vocabulary.dmv" : path;
  return std::make_shared<const Vocabulary>(LoadOrbVocabulary(file));
}

}  // namespace dmslam
