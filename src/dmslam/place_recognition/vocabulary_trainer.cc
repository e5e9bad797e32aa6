#include "dmslam/place_recognition/vocabulary_trainer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>

#include "dmslam/place_recognition/nearest_child.h"
#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

/// Spreads the bits of a byte over the bytes of a word, lowest first.
constexpr std::array<uint64_t, 256> MakeSpread() {
  std::array<uint64_t, 256> spread{};
  for (uint64_t value = 0; value < 256; ++value) {
    for (uint64_t bit = 0; bit < 8; ++bit) spread[value] |= ((value >> bit) & 1U) << (8 * bit);
  }
  return spread;
}
constexpr std::array<uint64_t, 256> kSpread = MakeSpread();

/// Counts how often each of 256 bits is set.
class BitCounter {
 public:
  void Add(const Descriptor& descriptor) {
    for (size_t word = 0; word < 4; ++word) {
      for (size_t byte = 0; byte < 8; ++byte) {
        packed_[8 * word + byte] += kSpread[(descriptor.words[word] >> (8 * byte)) & 0xffU];
      }
    }
    ++total_;
    if (++unflushed_ == 255) Flush();
  }

  /// Each bit as most descriptors have it; where it is a draw, as `draw` has it.
  Descriptor Majority(const Descriptor& draw) {
    Flush();
    Descriptor median;
    for (size_t bit = 0; bit < 256; ++bit) {
      const uint64_t twice = 2 * uint64_t{counts_[bit]};
      const uint64_t own = (draw.words[bit / 64] >> (bit % 64)) & 1U;
      const uint64_t value = twice == total_ ? own : static_cast<uint64_t>(twice > total_);
      median.words[bit / 64] |= value << (bit % 64);
    }
    return median;
  }

  uint64_t total() const { return total_; }

 private:
  void Flush() {
    for (size_t i = 0; i < 32; ++i) {
      for (size_t bit = 0; bit < 8; ++bit) {
        counts_[8 * i + bit] += static_cast<uint32_t>((packed_[i] >> (8 * bit)) & 0xffU);
      }
      packed_[i] = 0;
    }
    unflushed_ = 0;
  }

  std::array<uint64_t, 32> packed_{};
  std::array<uint32_t, 256> counts_{};
  uint64_t total_ = 0;
  int unflushed_ = 0;
};

/// Seeds of k-medians: the first at random, each further one with probability by the squared distance to the
/// nearest of those before. Fewer than `most` when there are not that many different descriptors.
std::vector<Descriptor> ChooseSeeds(std::span<const Descriptor> points, size_t most, Random& random) {
  std::vector<Descriptor> seeds = {points[random.Below(static_cast<uint32_t>(points.size()))]};
  std::vector<uint32_t> squared(points.size(), UINT32_MAX);
  while (seeds.size() < most) {
    uint64_t sum = 0;
    for (size_t i = 0; i < points.size(); ++i) {
      const auto distance = static_cast<uint32_t>(HammingDistance(points[i], seeds.back()));
      squared[i] = std::min(squared[i], distance * distance);
      sum += squared[i];
    }
    if (sum == 0) break;
    uint64_t left = std::min(sum - 1, static_cast<uint64_t>(random.Uniform() * static_cast<double>(sum)));
    size_t chosen = 0;
    while (left >= squared[chosen]) left -= squared[chosen++];
    seeds.push_back(points[chosen]);
  }
  return seeds;
}

/// Clusters of one node's descriptors.
struct Clusters {
  std::vector<Descriptor> medians;
  std::vector<uint8_t> of_point;
};

/// One round: every point to its nearest median. True when a point moved.
bool Assign(std::span<const Descriptor> points, NearestChildFunction nearest, Clusters& clusters) {
  bool moved = false;
  for (size_t i = 0; i < points.size(); ++i) {
    const auto cluster = static_cast<uint8_t>(
        nearest(points[i], clusters.medians.data(), static_cast<int>(clusters.medians.size())));
    moved |= cluster != clusters.of_point[i];
    clusters.of_point[i] = cluster;
  }
  return moved;
}

/// Moves every median to the middle of its points. A cluster without points keeps its median.
void MoveMedians(std::span<const Descriptor> points, Clusters& clusters) {
  std::vector<BitCounter> counters(clusters.medians.size());
  for (size_t i = 0; i < points.size(); ++i) counters[clusters.of_point[i]].Add(points[i]);
  for (size_t c = 0; c < counters.size(); ++c) {
    if (counters[c].total() > 0) clusters.medians[c] = counters[c].Majority(clusters.medians[c]);
  }
}

/// Drops clusters without points, and renumbers.
void DropEmpty(Clusters& clusters) {
  std::vector<size_t> counts(clusters.medians.size(), 0);
  for (const uint8_t cluster : clusters.of_point) ++counts[cluster];
  std::vector<uint8_t> renumbered(counts.size());
  std::vector<Descriptor> kept;
  for (size_t c = 0; c < counts.size(); ++c) {
    renumbered[c] = static_cast<uint8_t>(kept.size());
    if (counts[c] > 0) kept.push_back(clusters.medians[c]);
  }
  for (uint8_t& cluster : clusters.of_point) cluster = renumbered[cluster];
  clusters.medians = std::move(kept);
}

Clusters KMedians(std::span<const Descriptor> points, const VocabularyTrainingOptions& options,
                  Random random) {
  const NearestChildFunction nearest = NearestChildOn(HammingPath::kBest);
  Clusters clusters;
  clusters.of_point.assign(points.size(), 0xff);
  clusters.medians = ChooseSeeds(points, static_cast<size_t>(options.branching), random);
  for (int round = 0; round < options.max_iterations; ++round) {
    if (!Assign(points, nearest, clusters)) break;
    MoveMedians(points, clusters);
  }
  Assign(points, nearest, clusters);
  DropEmpty(clusters);
  return clusters;
}

/// Points [begin, end) of the shuffled array belong to a node of the level at work.
struct Range {
  size_t begin = 0;
  size_t end = 0;
};

/// Grows the tree level by level over an array of descriptors that it sorts into nodes.
class TreeBuilder {
 public:
  TreeBuilder(const TrainingSet& training, const VocabularyTrainingOptions& options)
      : options_(options), points_(training.descriptors) {}

  VocabularyTree Build() {
    tree_.branching = static_cast<uint32_t>(options_.branching);
    tree_.levels = static_cast<uint32_t>(options_.levels);
    tree_.descriptors.emplace_back();
    std::vector<Range> level = {{0, points_.size()}};
    for (int depth = 0; depth <= options_.levels; ++depth) {
      std::vector<Range> below;
      for (const Range& range : level) Split(range, depth, below);
      level = std::move(below);
    }
    const auto words = std::count(tree_.child_counts.begin(), tree_.child_counts.end(), 0);
    tree_.weights.assign(static_cast<size_t>(words), 1.0F);
    return std::move(tree_);
  }

 private:
  void Split(const Range& range, int depth, std::vector<Range>& below) {
    const size_t count = range.end - range.begin;
    const bool leaf = depth == options_.levels || count < static_cast<size_t>(options_.min_split);
    const Clusters clusters = leaf ? Clusters{} : ClustersOf(range);
    if (leaf || clusters.medians.size() < 2) {
      tree_.child_counts.push_back(0);
      Report(count * static_cast<size_t>(options_.levels - depth));
      return;
    }
    tree_.child_counts.push_back(static_cast<uint8_t>(clusters.medians.size()));
    tree_.descriptors.insert(tree_.descriptors.end(), clusters.medians.begin(), clusters.medians.end());
    Sort(range, clusters, below);
    Report(count);
  }

  Clusters ClustersOf(const Range& range) const {
    const uint64_t node = tree_.child_counts.size();
    return KMedians(std::span(points_).subspan(range.begin, range.end - range.begin), options_,
                    Random(DeriveSeed(options_.seed, node, "vocabulary k-medians")));
  }

  /// Brings the points of each cluster together, keeping their order, and appends the clusters' ranges.
  void Sort(const Range& range, const Clusters& clusters, std::vector<Range>& below) {
    std::vector<size_t> next(clusters.medians.size() + 1, range.begin);
    for (const uint8_t cluster : clusters.of_point) ++next[cluster + 1U];
    for (size_t c = 1; c < next.size(); ++c) next[c] += next[c - 1] - range.begin;
    for (size_t c = 0; c + 1 < next.size(); ++c) below.push_back({next[c], next[c + 1]});
    std::vector<Descriptor> sorted(clusters.of_point.size());
    for (size_t i = 0; i < sorted.size(); ++i) {
      sorted[next[clusters.of_point[i]]++ - range.begin] = points_[range.begin + i];
    }
    std::copy(sorted.begin(), sorted.end(), points_.begin() + static_cast<ptrdiff_t>(range.begin));
  }

  void Report(size_t done) {
    done_ += done;
    if (!options_.progress) return;
    const double all = static_cast<double>(points_.size()) * options_.levels;
    options_.progress(std::min(1.0, static_cast<double>(done_) / all));
  }

  const VocabularyTrainingOptions& options_;
  std::vector<Descriptor> points_;
  VocabularyTree tree_;
  size_t done_ = 0;
};

/// Number of images in which each word occurs.
std::vector<uint32_t> CountImages(const Vocabulary& vocabulary, const TrainingSet& training) {
  std::vector<uint32_t> images(vocabulary.num_words(), 0);
  size_t begin = 0;
  for (const size_t end : training.image_ends) {
    auto words = vocabulary.Quantize(std::span(training.descriptors).subspan(begin, end - begin));
    std::sort(words.begin(), words.end());
    words.erase(std::unique(words.begin(), words.end()), words.end());
    for (const WordIndex word : words) ++images[word];
    begin = end;
  }
  return images;
}

}  // namespace

void VocabularyTrainingOptions::Check() const {
  if (branching < 2 || branching > 64) throw InputError("vocabulary training: branching must lie in 2..64");
  if (levels < 1 || levels > 10) throw InputError("vocabulary training: levels must lie in 1..10");
  if (max_iterations < 1) throw InputError("vocabulary training: max_iterations must be at least 1");
  if (min_split < 2) throw InputError("vocabulary training: min_split must be at least 2");
}

void TrainingSet::AddImage(std::span<const Descriptor> image) {
  descriptors.insert(descriptors.end(), image.begin(), image.end());
  image_ends.push_back(descriptors.size());
}

Vocabulary TrainVocabulary(const TrainingSet& training, const VocabularyTrainingOptions& options) {
  options.Check();
  if (training.descriptors.empty())
    throw InputError("vocabulary training: no descriptors; give images with texture");
  VocabularyTree tree = TreeBuilder(training, options).Build();
  if (tree.descriptors.size() < 3) {
    throw InputError("vocabulary training: fewer than two different descriptors; give more images");
  }
  tree.descriptor_id = options.descriptor_id;
  const Vocabulary unweighted(tree);
  const std::vector<uint32_t> images = CountImages(unweighted, training);
  const auto total = static_cast<double>(training.num_images());
  for (size_t word = 0; word < images.size(); ++word) {
    tree.weights[word] = static_cast<float>(std::log(total / std::max(1U, images[word])));
  }
  return Vocabulary(std::move(tree));
}

}  // namespace dmslam
