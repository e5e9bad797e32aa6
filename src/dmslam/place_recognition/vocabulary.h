#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "dmslam/features/types.h"
#include "dmslam/place_recognition/bow.h"
#include "dmslam/place_recognition/nearest_child.h"

namespace dmslam {

/// What a vocabulary is made of, breadth first: root, its children, their children. The children of a node
/// are consecutive, and nodes of one level stand in the order of their parents, so `child_counts` alone gives
/// the tree.
struct VocabularyTree {
  uint32_t branching = 0;               ///< most children of a node, 2..64
  uint32_t levels = 0;                  ///< most steps from the root to a leaf, 1..10
  uint32_t descriptor_id = 0;           ///< kind of descriptors it was trained on; 0 = unknown
  std::vector<uint8_t> child_counts;    ///< per node; 0 = leaf, which is a word
  std::vector<Descriptor> descriptors;  ///< per node; the root's is unused (zero)
  std::vector<float> weights;  ///< per word, breadth first: inverse document frequency, >= 0; 0 = ignored
};

/// A tree of visual words over 256-bit descriptors (Nister, Stewenius, "Scalable recognition with a
/// vocabulary tree", CVPR 2006; for binary descriptors: Galvez-Lopez, Tardos, T-RO 2012). Immutable and cheap
/// to copy (copies share it).
class Vocabulary {
 public:
  /// From a tree in memory. Throws InputError, beginning with `name`, when it is not a tree.
  explicit Vocabulary(VocabularyTree tree, const std::string& name = "vocabulary");

  /// Reads a vocabulary in either format, told by its first bytes. The binary one is mapped, not copied.
  /// Throws InputError (file, field, cure) when the file is absent, truncated, damaged or of another kind;
  /// nothing is ever half-loaded.
  static Vocabulary Load(const std::filesystem::path& path);

  /// Writes our binary format: see vocabulary_format.h. Throws InputError when the file cannot be written.
  void SaveBinary(const std::filesystem::path& path) const;

  /// Writes DBoW2's text format: "k L scoring weighting", then per node but the root "parent is_leaf 32-bytes
  /// weight". The format has no checksum and no count.
  void SaveText(const std::filesystem::path& path) const;

  /// Text for a path that ends in ".txt", binary for any other.
  void Save(const std::filesystem::path& path) const;

  /// Words (tf-idf, L1-normalised) and direct index of an image. `node_level`: the level, counted from the
  /// root, whose nodes the direct index names; leaves above that level stand for themselves. `counted`, when
  /// not empty, has one entry per descriptor: those with 0 (seen to move, say) do not enter the words.
  /// Neither do words of weight zero. The direct index has every feature.
  BowImage Transform(std::span<const Descriptor> descriptors, int node_level = kDirectIndexLevel,
                     std::span<const uint8_t> counted = {}) const;

  /// The word of each descriptor.
  std::vector<WordIndex> Quantize(std::span<const Descriptor> descriptors) const;

  /// Level of the direct index unless told otherwise: some 100 nodes with ten children each.
  static constexpr int kDirectIndexLevel = 2;

  size_t num_nodes() const { return shared_->descriptors.size(); }
  size_t num_words() const { return shared_->weights.size(); }
  uint32_t branching() const { return shared_->branching; }
  uint32_t levels() const { return shared_->levels; }
  float weight(WordIndex word) const { return shared_->weights[word]; }
  std::span<const Descriptor> descriptors() const { return shared_->descriptors; }
  std::span<const uint8_t> child_counts() const { return shared_->child_counts; }
  std::span<const float> weights() const { return shared_->weights; }
  /// First child of an inner node.
  NodeIndex first_child(NodeIndex node) const { return shared_->links[node]; }
  bool is_leaf(NodeIndex node) const { return shared_->child_counts[node] == 0; }
  /// Word of a leaf.
  WordIndex word_of_leaf(NodeIndex node) const { return shared_->links[node]; }

  /// CRC-32C over shape, descriptors and weights: the same for the same vocabulary, whichever format it came
  /// from.
  uint32_t checksum() const { return shared_->checksum; }

  /// Which kind of descriptors it was trained on; 0 where the file does not say (DBoW2's format). Not in the
  /// checksum.
  uint32_t descriptor_id() const { return shared_->descriptor_id; }

  /// The same vocabulary, descending with other instructions (for tests and measurements).
  Vocabulary WithPath(HammingPath path) const;

 private:
  class Mapping;
  struct Shared {
    uint32_t branching = 0;
    uint32_t levels = 0;
    uint32_t checksum = 0;
    uint32_t descriptor_id = 0;
    std::span<const uint8_t> child_counts;
    std::span<const Descriptor> descriptors;
    std::span<const float> weights;
    std::vector<uint32_t> links;             ///< inner node: its first child; leaf: its word
    VocabularyTree owned;                    ///< backs the spans, or
    std::shared_ptr<const Mapping> mapping;  ///< this does
  };

  explicit Vocabulary(std::shared_ptr<const Shared> shared);
  static Vocabulary FromMapping(const std::filesystem::path& path, std::shared_ptr<const Mapping> mapping);
  static void Link(Shared& shared, const std::string& name);
  static void CheckValues(const Shared& shared, const std::string& name);
  /// Leaf of each descriptor; when `at_level` is given, also the node at that level.
  void Descend(std::span<const Descriptor> descriptors, std::vector<NodeIndex>& leaves, int level,
               std::vector<NodeIndex>* at_level) const;

  std::shared_ptr<const Shared> shared_;
  NearestChildFunction nearest_child_;
};

/// Names the descriptors that OrbExtractor makes: a hash of its pattern of comparisons.
uint32_t OrbDescriptorId();

/// Vocabulary::Load, which also refuses a vocabulary that was trained on descriptors of another pattern: its
/// words would mean nothing.
Vocabulary LoadOrbVocabulary(const std::filesystem::path& path);

}  // namespace dmslam
