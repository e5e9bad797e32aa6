// Vocabularies in either format: read whole, or refused with an InputError.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "dmslam/place_recognition/vocabulary.h"
#include "fuzz_target.h"
#include "memory_file.h"

namespace {

dmslam::Vocabulary SmallVocabulary() {
  dmslam::VocabularyTree tree;
  tree.branching = 2;
  tree.levels = 2;
  tree.child_counts = {2, 2, 0, 0, 0};
  tree.descriptors.resize(5);
  for (size_t i = 1; i < 5; ++i) tree.descriptors[i].words[0] = i;
  tree.weights = {0.5F, 0.25F, 1.0F};
  return dmslam::Vocabulary(tree);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const dmslam::fuzz::MemoryFile file(data, size);
  try {
    const dmslam::Vocabulary vocabulary = dmslam::Vocabulary::Load(file.path());
    vocabulary.Transform(std::vector<dmslam::Descriptor>(3));
  } catch (const dmslam::InputError&) {
  }
  return 0;
}

namespace dmslam::fuzz {

std::vector<std::vector<uint8_t>> Seeds() {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("dmslam_fuzz_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  SmallVocabulary().SaveBinary(folder / "binary");
  SmallVocabulary().SaveText(folder / "text");
  std::vector<std::vector<uint8_t>> seeds;
  for (const char* name : {"binary", "text"}) {
    std::ifstream in(folder / name, std::ios::binary);
    seeds.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  std::filesystem::remove_all(folder);
  return seeds;
}

}  // namespace dmslam::fuzz
