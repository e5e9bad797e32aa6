#pragma once

#include <cstdint>
#include <optional>

#include "dmslam/initialization/initializer.h"

namespace dmslam {

struct BaselineInitializerOptions {
  MatchingOptions matching;
  HomographyOrFundamentalOptions model;
  int min_features = 100;  ///< per frame
  int min_matches = 100;   ///< with the reference frame; fewer: this frame becomes the reference
};

/// The initialiser that `profile=baseline` stands for: two frames, plain RANSAC, homography or fundamental
/// matrix by score (Mur-Artal, Montiel, Tardos, "ORB-SLAM", TRO 2015, Sec. IV). Knows nothing of motion in
/// the scene.
class BaselineInitializer {
 public:
  BaselineInitializer(const BaselineInitializerOptions& options, const Camera& camera, uint64_t seed)
      : options_(options), camera_(camera), seed_(seed) {}

  InitializerReport AddFrame(const InitializerFrame& frame);

 private:
  InitializerReport BeginWith(const InitializerFrame& frame, WaitReason wait, const char* reason);

  BaselineInitializerOptions options_;
  Camera camera_;
  uint64_t seed_;
  FeatureMatcher matcher_;
  std::optional<InitializerFrame> reference_;
};

}  // namespace dmslam
