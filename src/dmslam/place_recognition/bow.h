#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/features/matcher.h"
#include "dmslam/features/types.h"

namespace dmslam {

/// A leaf of the vocabulary tree: 0 .. num_words - 1, breadth first.
using WordIndex = uint32_t;
/// A node of the vocabulary tree: 0 is the root, breadth first, the children of a node are consecutive.
using NodeIndex = uint32_t;

/// One word of an image with its share of the image's weight.
struct WordWeight {
  WordIndex word = 0;
  float weight = 0.0F;
  auto operator<=>(const WordWeight&) const = default;
};

/// The words of an image: sorted by word, each once, weights positive with sum one. Empty for an image
/// without features.
using BowVector = std::vector<WordWeight>;

/// The direct index of an image: every feature once with the inner node of the vocabulary that it falls
/// under, sorted by node (`group`), then by feature. Features under the same node are alike, so that only
/// these need be compared when two images are matched (Galvez-Lopez, Tardos, section IV-D).
using FeatureVector = std::vector<GroupedFeature>;

/// Both sides of an image in terms of a vocabulary.
struct BowImage {
  BowVector words;
  FeatureVector nodes;
};

/// Likeness of two images, 0 (no word in common) to 1 (equal vectors): 1 - |a - b|_1 / 2, which for vectors
/// of sum one is the sum of min(a_i, b_i) over common words (Galvez-Lopez, Tardos, "Bags of binary words for
/// fast place recognition in image sequences", T-RO 2012, eq. 2). Symmetric to the bit.
double L1Score(const BowVector& a, const BowVector& b);

/// Feature `a` of the first image looks like feature `b` of the second.
struct BowMatch {
  uint32_t a = 0;
  uint32_t b = 0;
  int distance = 0;  ///< [bits]
  auto operator<=>(const BowMatch&) const = default;
};

/// One image of a pair to match. `usable`, when not empty, has one entry per feature; features with 0 are
/// left out.
struct BowMatchSide {
  const FeatureSet* features = nullptr;
  const FeatureVector* nodes = nullptr;
  std::span<const uint8_t> usable{};
};

/// How MatchByNodes decides unless told otherwise.
inline constexpr MatchOptions kBowMatchOptions = {.max_ratio = 0.75};

/// Matches features that fall under the same node, as FeatureMatcher::MatchGroups does. Every feature takes
/// part in at most one match. Sorted by `a`.
std::vector<BowMatch> MatchByNodes(const BowMatchSide& a, const BowMatchSide& b,
                                   const MatchOptions& options = kBowMatchOptions);

}  // namespace dmslam
