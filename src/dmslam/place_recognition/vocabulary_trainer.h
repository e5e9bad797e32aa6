#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "dmslam/features/types.h"
#include "dmslam/place_recognition/vocabulary.h"

namespace dmslam {

/// How a vocabulary is trained.
struct VocabularyTrainingOptions {
  int branching = 10;          ///< children per node, 2..64
  int levels = 5;              ///< steps from the root to a word, 1..10; up to branching^levels words
  uint64_t seed = 1;           ///< same descriptors, options and seed: same vocabulary
  int max_iterations = 10;     ///< rounds of k-medians per node
  int min_split = 4;           ///< a node with fewer training descriptors stays a word
  uint32_t descriptor_id = 0;  ///< kind of the descriptors (see OrbDescriptorId); 0 = unknown
  /// Called now and then with the share of the work that is done, 0..1.
  std::function<void(double)> progress;

  /// Throws InputError naming the field.
  void Check() const;
};

/// Descriptors of training images, one image after the other.
struct TrainingSet {
  std::vector<Descriptor> descriptors;
  std::vector<size_t> image_ends;  ///< per image: one past its last descriptor

  void AddImage(std::span<const Descriptor> image);
  size_t num_images() const { return image_ends.size(); }
};

/// Clusters the descriptors hierarchically by k-medians: seeds as in k-means++ (Arthur, Vassilvitskii, SODA
/// 2007) on Hamming distances, the median of a cluster by majority of each bit. Words are weighed by
/// log(images / images with the word). Throws InputError when there are fewer than two different descriptors.
Vocabulary TrainVocabulary(const TrainingSet& training, const VocabularyTrainingOptions& options);

}  // namespace dmslam
