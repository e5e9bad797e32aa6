#pragma once

#include <cstdint>
#include <vector>

#include "dmslam/features/brief_pattern.h"
#include "dmslam/features/orb_extractor.h"

namespace dmslam {

/// The smoothed surroundings of a keypoint: 31 rows of 32 bytes, and its orientation.
struct KeypointPatch {
  uint8_t pixels[31 * 32] = {};
  uint8_t angle = 0;
};

/// The same corner seen in an image and in a changed version of it.
struct PatchPair {
  KeypointPatch first;
  KeypointPatch second;
};

struct PatternLearnerOptions {
  int num_candidates = 8000;  ///< random tests to choose from
  double sigma_px = 20.0;     ///< their points are normally distributed around the keypoint
  uint64_t seed = 1;
};

/// Finds where each keypoint of `features` lies and cuts its patch out of the smoothed level, for an image
/// and a pyramid. Keypoints are in the order of the features.
std::vector<KeypointPatch> CutPatches(const GrayView& image, const FeatureSet& features,
                                      const Pyramid& pyramid);

/// Chooses 256 tests out of random ones, one after the other, each so that the descriptors made so far tell
/// the same corner from another one best. (Rublee et al., ORB, ICCV 2011, section 4.3, choose balanced tests
/// with little correlation; here these come out by themselves, and tests are preferred that stay the same
/// when the view changes.) Throws InputError for fewer than 1000 pairs.
std::vector<BriefTest> LearnPattern(const std::vector<PatchPair>& pairs,
                                    const PatternLearnerOptions& options);

}  // namespace dmslam
