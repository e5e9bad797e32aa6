#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "dmslam/initialization/initializer.h"

namespace dmslam {

struct TwoFrameOptions {
  MatchingOptions matching;
  int min_features = 100;  ///< per frame
  int min_matches = 100;   ///< with the reference frame; fewer: this frame becomes the reference
  double min_gap_s = 0;    ///< between the two frames
};

/// Pose and points of two frames from their matches; the number is the seed of what is random.
using ReconstructPair = std::function<TwoViewReconstruction(std::span<const Match>, uint64_t)>;

/// Homography or fundamental matrix by score, plain RANSAC (Mur-Artal, Montiel, Tardos, "ORB-SLAM", TRO 2015,
/// Sec. IV). Knows nothing of motion in the scene. `pyramid`: of the features, as it is set.
ReconstructPair ReconstructByRansac(const Camera& camera, const Pyramid& pyramid = {});

/// DLRSAC as the DM-SLAM paper has it (Lu et al., Appl. Sci. 2020, 10(12), 4252, Sec. 2.1) with the failure
/// tests of its Sec. 2.3.1: too few matches or cells, the distribution or the mean parallax too small.
/// `pyramid`: of the features, as it is set.
ReconstructPair ReconstructByPaper(const Camera& camera, const Pyramid& pyramid = {});

/// An initialiser of two frames: a reference frame is matched with every frame after it until a pair gives a
/// map, or until too few matches are left.
class TwoFrameInitializer {
 public:
  TwoFrameInitializer(const TwoFrameOptions& options, const Camera& camera, ReconstructPair reconstruct,
                      uint64_t seed)
      : options_(options), camera_(camera), reconstruct_(std::move(reconstruct)), seed_(seed) {}

  InitializerReport AddFrame(const InitializerFrame& frame);

 private:
  InitializerReport BeginWith(const InitializerFrame& frame, WaitReason wait, const char* reason);

  TwoFrameOptions options_;
  Camera camera_;
  ReconstructPair reconstruct_;
  uint64_t seed_;
  FeatureMatcher matcher_;
  std::optional<InitializerFrame> reference_;
};

}  // namespace dmslam
