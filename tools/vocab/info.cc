#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "commands.h"
#include "dmslam/place_recognition/vocabulary.h"

namespace dmslam {

void PrintInfo(const std::string& path) {
  const Vocabulary vocabulary = Vocabulary::Load(path);
  std::vector<float> weights(vocabulary.weights().begin(), vocabulary.weights().end());
  std::sort(weights.begin(), weights.end());
  std::printf("file       %s (%.2f MiB)\n", path.c_str(),
              static_cast<double>(std::filesystem::file_size(path)) / (1024.0 * 1024.0));
  std::printf("words      %zu\n", vocabulary.num_words());
  std::printf("nodes      %zu\n", vocabulary.num_nodes());
  std::printf("tree       %u children, %u levels\n", vocabulary.branching(), vocabulary.levels());
  std::printf("weighting  tf-idf, L1 score\n");
  std::printf("idf        min %.3f, median %.3f, max %.3f\n", static_cast<double>(weights.front()),
              static_cast<double>(weights[weights.size() / 2]), static_cast<double>(weights.back()));
  const uint32_t descriptors = vocabulary.descriptor_id();
  const bool ours = descriptors == OrbDescriptorId();
  std::printf("made for   %s\n", ours               ? "this extractor"
                                 : descriptors == 0 ? "unknown descriptors"
                                                    : "other descriptors");
  std::printf("checksum   %08x\n", vocabulary.checksum());
}

}  // namespace dmslam
