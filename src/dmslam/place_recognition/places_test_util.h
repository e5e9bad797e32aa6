#pragma once

#include <vector>

#include "dmslam/features/types.h"
#include "dmslam/place_recognition/vocabulary_trainer.h"
#include "dmslam/util/random.h"

namespace dmslam::places_test {

inline Descriptor RandomDescriptor(Random& random) {
  return Descriptor{{random.Next(), random.Next(), random.Next(), random.Next()}};
}

/// `clean` with `bits` draws of a bit to flip.
inline Descriptor Disturbed(const Descriptor& clean, int bits, Random& random) {
  Descriptor descriptor = clean;
  for (int i = 0; i < bits; ++i) {
    const uint32_t bit = random.Below(256);
    descriptor.words[bit / 64] ^= uint64_t{1} << (bit % 64);
  }
  return descriptor;
}

/// Kinds of corner: images draw from them, and what they draw is disturbed, as by a change of view.
class SyntheticWorld {
 public:
  SyntheticWorld(size_t num_kinds, uint64_t seed) : random_(seed) {
    for (size_t i = 0; i < num_kinds; ++i) kinds_.push_back(RandomDescriptor(random_));
  }

  /// An image of kinds first .. first + count - 1, each once, in order.
  std::vector<Descriptor> Image(size_t first, size_t count, int disturbance) {
    std::vector<Descriptor> image;
    for (size_t i = 0; i < count; ++i) {
      image.push_back(Disturbed(kinds_[(first + i) % kinds_.size()], disturbance, random_));
    }
    return image;
  }

  TrainingSet Training(size_t num_images, size_t features) {
    TrainingSet training;
    for (size_t i = 0; i < num_images; ++i) {
      training.AddImage(Image(random_.Below(static_cast<uint32_t>(kinds_.size())), features, 12));
    }
    return training;
  }

 private:
  Random random_;
  std::vector<Descriptor> kinds_;
};

/// A small vocabulary: branching 6, three levels, some 200 words.
inline Vocabulary SmallVocabulary(uint64_t seed = 1) {
  SyntheticWorld world(400, 7);
  VocabularyTrainingOptions options;
  options.branching = 6;
  options.levels = 3;
  options.seed = seed;
  return TrainVocabulary(world.Training(60, 80), options);
}

}  // namespace dmslam::places_test
