#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "commands.h"
#include "dmslam/dataset/image.h"
#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/features/orb_extractor.h"
#include "dmslam/place_recognition/vocabulary_trainer.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

/// One line that overwrites itself on a terminal; silent elsewhere.
class ProgressLine {
 public:
  explicit ProgressLine(const char* what) : what_(what), shown_(isatty(STDERR_FILENO) != 0) {}
  ~ProgressLine() {
    if (last_percent_ >= 0) std::fputc('\n', stderr);
  }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void Show(double share) {
    const int percent = static_cast<int>(100.0 * share);
    if (!shown_ || percent == last_percent_) return;
    last_percent_ = percent;
    std::fprintf(stderr, "\r%s %3d %%", what_, percent);
    std::fflush(stderr);
  }

 private:
  const char* what_;
  bool shown_;
  int last_percent_ = -1;
};

bool IsImage(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  constexpr std::array<const char*, 6> kKnown = {".jpg", ".jpeg", ".png", ".pgm", ".bmp", ".tif"};
  return std::find(kKnown.begin(), kKnown.end(), extension) != kKnown.end();
}

std::vector<std::string> ImagesIn(const std::string& folder) {
  std::vector<std::string> images;
  if (fs::exists(fs::path(folder) / "rgb.txt")) {
    const TumSequence sequence(folder);
    for (const StampedFile& frame : sequence.frames()) images.push_back(frame.path);
    return images;
  }
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (it->is_regular_file() && IsImage(it->path())) images.push_back(it->path().string());
  }
  if (error) throw InputError(folder + ": folder cannot be read; check --images");
  if (images.empty())
    throw InputError(folder + ": no images (jpg, png, pgm, bmp, tif) in it; check --images");
  std::sort(images.begin(), images.end());
  return images;
}

TrainingSet ExtractAll(const std::vector<std::string>& images, const TrainCommand& command) {
  OrbExtractorOptions options;
  options.num_features = command.features;
  OrbExtractor extractor(options);
  ProgressLine progress("features");
  TrainingSet training;
  FeatureSet features;
  const auto step = static_cast<size_t>(command.every);
  for (size_t i = 0; i < images.size(); i += step) {
    const GrayImage image = LoadGray(images[i]);
    extractor.Extract({image.data.data(), image.width, image.height, image.width}, &features);
    training.AddImage(features.descriptors);
    progress.Show(static_cast<double>(i + 1) / static_cast<double>(images.size()));
  }
  return training;
}

Vocabulary Cluster(const TrainingSet& training, VocabularyTrainingOptions options) {
  ProgressLine progress("clusters");
  options.progress = [&progress](double share) { progress.Show(share); };
  return TrainVocabulary(training, options);
}

}  // namespace

void Train(const TrainCommand& command) {
  if (command.every < 1) throw InputError("--every must be at least 1");
  if (command.features < 1) throw InputError("--features must be at least 1");
  VocabularyTrainingOptions options;
  options.branching = command.branching;
  options.levels = command.levels;
  options.seed = command.seed;
  options.min_split = command.min_split;
  options.descriptor_id = OrbDescriptorId();
  options.Check();
  const TrainingSet training = ExtractAll(ImagesIn(command.images), command);
  const Vocabulary vocabulary = Cluster(training, options);
  vocabulary.Save(command.out);
  std::printf("%zu images, %zu features, %zu words, checksum %08x\n", training.num_images(),
              training.descriptors.size(), vocabulary.num_words(), vocabulary.checksum());
}

}  // namespace dmslam
