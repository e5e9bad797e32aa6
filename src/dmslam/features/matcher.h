#pragma once

#include <Eigen/Core>
#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "dmslam/features/feature_grid.h"
#include "dmslam/features/hamming.h"
#include "dmslam/features/types.h"

namespace dmslam {

/// One image of a pair to match. All lists have one entry per feature; none is copied.
struct MatchSide {
  std::span<const Keypoint> keypoints;
  std::span<const Descriptor> descriptors;
  std::span<const Eigen::Vector2d> uv_px{};  ///< undistorted pixels; only for matching by position
  std::span<const uint8_t> usable{};         ///< empty: all; else features with 0 are left out

  size_t size() const { return descriptors.size(); }
  bool Usable(size_t feature) const { return usable.empty() || usable[feature] != 0; }
};

/// Feature `index0` of the first image looks like feature `index1` of the second.
struct FeatureMatch {
  uint32_t index0 = 0;
  uint32_t index1 = 0;
  int distance = 0;  ///< [bits]
  auto operator<=>(const FeatureMatch&) const = default;
};

/// What makes two features a match.
struct MatchOptions {
  int max_distance = 50;   ///< largest Hamming distance [bits]
  double max_ratio = 0.9;  ///< the distance must be below this share of the second best's; 1 turns it off
  bool check_orientation = true;  ///< keep only matches whose turn of the keypoint agrees with most others
  bool mutual = true;             ///< also the best one seen from the second image (ratio not asked there)
};

/// Matching within a window around where the feature was, for two frames with little motion between.
struct WindowMatchOptions {
  MatchOptions match;
  double window_px = 100.0;  ///< radius around the predicted position
  int octave_slack = 1;      ///< largest difference of octaves
  int max_octave0 = 255;     ///< only features of the first image with octaves up to this
};

/// A feature and the group (node of a vocabulary, say) that it falls into.
struct GroupedFeature {
  uint32_t group = 0;
  uint32_t feature = 0;
  auto operator<=>(const GroupedFeature&) const = default;
};

/// Where to look for the feature that shows a projected point.
struct SearchArea {
  Eigen::Vector2d center_px = Eigen::Vector2d::Zero();  ///< undistorted pixel
  double radius_px = 0.0;
  int min_octave = 0;
  int max_octave = 255;
};

/// The two best features of a search area. The second one's distance is kNoDistance where there is none.
struct NearestFeatures {
  uint32_t index = 0;
  int distance = kNoDistance;  ///< [bits]
  int octave = 0;
  int second_distance = kNoDistance;  ///< [bits]
  int second_octave = 0;
};

/// Number of bins of the histogram of turns, and how many of the fullest are kept.
inline constexpr int kOrientationBins = 30;
inline constexpr int kOrientationBinsKept = 3;

/// Matches features of two images. Holds scratch memory, so that it allocates only while this and the
/// caller's results grow; one matcher serves one thread. Ties go to the smaller index, so results do not
/// depend on the order of a search. Every feature takes part in at most one match (two that want the same
/// one: the smaller distance wins, then the smaller index0), and matches are sorted by index0.
class FeatureMatcher {
 public:
  explicit FeatureMatcher(const HammingKernels& kernels = BestHammingKernels()) : kernels_(kernels) {}

  /// Features of b within the window around `predicted_px[i]` for each feature i of a; with an empty
  /// prediction around a.uv_px[i]. `grid_b` indexes b.
  void MatchWindow(const MatchSide& a, const MatchSide& b, const FeatureGrid& grid_b,
                   const WindowMatchOptions& options, std::vector<FeatureMatch>* matches,
                   std::span<const Eigen::Vector2d> predicted_px = {});

  /// Every feature of a with every one of b: no position, no octave asked.
  void MatchAll(const MatchSide& a, const MatchSide& b, const MatchOptions& options,
                std::vector<FeatureMatch>* matches);

  /// Features that fall into the same group. Both lists are sorted by group, then feature.
  void MatchGroups(const MatchSide& a, std::span<const GroupedFeature> groups_a, const MatchSide& b,
                   std::span<const GroupedFeature> groups_b, const MatchOptions& options,
                   std::vector<FeatureMatch>* matches);

  /// The features of `side` nearest to `descriptor` within an area; none when the area holds no usable
  /// feature.
  std::optional<NearestFeatures> FindNearest(const Descriptor& descriptor, const SearchArea& area,
                                             const MatchSide& side, const FeatureGrid& grid);

  /// FindNearest with the decision made: within `max_distance`, and clearly better than a second one of the
  /// same octave (one of another octave shows the same corner). `max_ratio` >= 1 turns the second test off.
  std::optional<FeatureMatch> FindMatch(const Descriptor& descriptor, const SearchArea& area,
                                        const MatchSide& side, const FeatureGrid& grid, int max_distance,
                                        double max_ratio);

 private:
  /// Distance (high 32 bits) and index of the two nearest candidates; distance kNoDistance where there are
  /// fewer.
  struct BestTwo {
    uint64_t best;
    uint64_t second;
  };

  void Start(const MatchSide& a, const MatchSide& b, std::vector<FeatureMatch>* matches);
  /// Compares feature `index0` with `candidates_` of b, whose distances are in `distances_`. Those that are
  /// too far to matter may be missing.
  void Propose(uint32_t index0, const MatchOptions& options, std::vector<FeatureMatch>* matches);
  BestTwo BestTwoOfCandidates() const;
  void NoteForSecondImage(uint32_t index1, int distance, uint32_t index0);
  /// Leaves each feature of b its nearest, checks turns, sorts.
  void Finish(const MatchSide& a, const MatchSide& b, const MatchOptions& options,
              std::vector<FeatureMatch>* matches);
  /// Usable features of the area into in_area_; returns how many.
  size_t FindInArea(const SearchArea& area, const MatchSide& side, const FeatureGrid& grid);
  /// FindNearest, to which what is farther than `limit` [bits] does not exist.
  std::optional<NearestFeatures> FindNearestWithin(int limit, const Descriptor& descriptor,
                                                   const SearchArea& area, const MatchSide& side,
                                                   const FeatureGrid& grid);
  /// Fills candidates_ and distances_ with those no farther than `limit` [bits].
  void CompareInArea(const Descriptor& descriptor, const SearchArea& area, const MatchSide& side,
                     const FeatureGrid& grid, int limit);
  /// Fills distances_ with those of candidates_.
  void CompareWithCandidates(const Descriptor& descriptor, const MatchSide& side);

  const HammingKernels& kernels_;
  std::vector<uint32_t> in_area_;
  std::vector<uint32_t> candidates_;
  std::vector<uint16_t> distances_;
  std::vector<uint64_t>
      nearest0_;  ///< per feature of b: distance (high 32 bits) and index of the nearest of a
};

/// Removes matches whose turn (difference of the keypoints' angles) is not among the most common: a histogram
/// of 30 bins, of which the fullest three are kept, the second and third only with a tenth of the first's.
/// Keeps the order.
void KeepConsistentTurns(std::span<const Keypoint> keypoints0, std::span<const Keypoint> keypoints1,
                         std::vector<FeatureMatch>* matches);

}  // namespace dmslam
