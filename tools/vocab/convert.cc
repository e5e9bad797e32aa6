#include <filesystem>

#include "commands.h"
#include "dmslam/place_recognition/vocabulary.h"

namespace dmslam {

void Convert(const std::string& from, const std::string& to) { Vocabulary::Load(from).Save(to); }

}  // namespace dmslam
