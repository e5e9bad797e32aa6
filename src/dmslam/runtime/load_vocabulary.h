#pragma once

#include <memory>
#include <string>

#include "dmslam/place_recognition/vocabulary.h"

namespace dmslam {

/// The vocabulary at `path`, or where that is empty the one that ships with the programs. Throws InputError.
std::shared_ptr<const Vocabulary> LoadVocabulary(const std::string& path);

}  // namespace dmslam
