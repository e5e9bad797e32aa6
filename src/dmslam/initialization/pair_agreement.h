#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/motion_segmentation/static_selector.h"

namespace dmslam {

/// Matches of the reference frame with another one, and what the selector made of them. index0 is the feature
/// of the reference frame.
struct PairView {
  std::vector<Match> matches;  ///< sorted by index0
  StaticSelection selection;
};

/// Where nearly everything that is matched moves as one, it may be more compact: behind people the room shows
/// in a patch, and they themselves, whose limbs do not move as one, have no such share.
struct DominanceOptions {
  double min_share = 0.9;  ///< of the last pair's matches
  double min_distribution_share = 0.10;
};

/// Root of D (paper, Eq. 3) of a static set, by the image's diagonal: one that is more compact may be
/// somebody's.
inline constexpr double kMinDistributionShare = 0.175;

struct AgreementOptions {
  double min_agreement = 0.87;  ///< Jaccard index of two pairs' static sets, over features matched in both
  int min_common = 30;          ///< features matched in both pairs, for the index to mean anything
  double min_distribution_share = kMinDistributionShare;
  /// None: whatever its share, a compact set is refused.
  std::optional<DominanceOptions> dominance = DominanceOptions{};
  int min_static = 100;  ///< matches static in all pairs

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("initializer.min_agreement", min_agreement, 0, 1, "",
             "smallest Jaccard index of the pairs' static sets");
    v.Number("initializer.min_distribution_share", min_distribution_share, 0, 1, "",
             "root of the static matches' distribution D, as a share of the image's diagonal");
  }
};

enum class AgreementRefusal : uint8_t {
  kNone = 0,
  kSelectionRefused,      ///< the selector refused one of the pairs
  kTooFewCommon,          ///< the pairs have too few features in common
  kDisagreement,          ///< they call different features static
  kTooFewStatic,          ///< too few are static in all of them
  kDistributionTooSmall,  ///< what is static is too compact
};
std::string_view ToString(AgreementRefusal refusal);

/// What several pairs with the same reference frame say together.
struct Agreement {
  AgreementRefusal refusal = AgreementRefusal::kNone;
  std::string explanation;
  std::vector<uint8_t> is_static;  ///< parallel to the last pair's matches; computed also when refused
  int num_static = 0;
  double agreement = 1;  ///< smallest Jaccard index
  double distribution_px = 0;
  bool IsUsable() const { return refusal == AgreementRefusal::kNone; }
};

/// The last pair's matches are static that it calls static and none of the other pairs calls moving. What
/// moves along the epipolar lines of one pair seldom does so in all, and different samples do not fall for
/// the same mover.
Agreement Agree(std::span<const PairView* const> pairs, const Camera& camera,
                const AgreementOptions& options);

}  // namespace dmslam
