#pragma once

#include <memory>
#include <string>

namespace dmslam {

class Vocabulary;

/// The vocabulary at `path`, or where that is empty the one that ships with the programs. Throws InputError.
std::shared_ptr<const Vocabulary> LoadVocabulary(const std::string& path);

}  // namespace dmslam
