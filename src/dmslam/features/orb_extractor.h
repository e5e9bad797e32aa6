#pragma once

#include <vector>

#include "dmslam/features/brief_pattern.h"
#include "dmslam/features/corner_detector.h"
#include "dmslam/features/image_kernels.h"
#include "dmslam/features/image_pyramid.h"
#include "dmslam/features/types.h"

namespace dmslam {

struct OrbExtractorOptions {
  int num_features = 2000;  ///< most keypoints of an image; fewer where there are too few corners
  Pyramid pyramid;          ///< levels 1..16, scale factor in [1.05, 2]
  int fast_threshold = 20;  ///< a corner's least difference to its circle [grey values], 1..254
  int min_fast_threshold =
      7;                  ///< the same for cells without any corner above `fast_threshold`, 1..fast_threshold
  int cell_size_px = 32;  ///< side of the cells over which keypoints are spread [px of the level], >= 8
  double rank_decay =
      0.8;             ///< worth of a cell's next corner relative to the one before, 0..1; see CornerSelector
  int border_px = 16;  ///< keypoints keep this far from the edges of their level [px of the level], >= 16
  SimdPath simd_path = SimdPath::kBest;

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("features.count", num_features, 50, 10000, "", "features per frame");
    pyramid.Describe(v);
    v.Number("features.fast_threshold", fast_threshold, 1, 254, "grey values", "least contrast of a corner");
    v.Number("features.min_fast_threshold", min_fast_threshold, 1, 254, "grey values",
             "the same where there is no such corner");
  }

  /// Throws InputError that names the field and its range.
  void Check() const;
};

/// Extracts ORB features: FAST corners of a pyramid over the image, enlarged where it is small, spread over
/// the image, oriented by the intensity centroid and described by 256 comparisons turned along (Rublee,
/// Rabaud, Konolige, Bradski: ORB: an efficient alternative to SIFT or SURF, ICCV 2011). Positions are
/// refined below the pixel by the peak of the FAST score (see subpixel.h).
///
/// The same image and options give the same features on every machine and SIMD path. Keeps its buffers: once
/// it has seen an image of a size, further ones of this size allocate nothing (given that `features` keeps
/// its memory too). One extractor serves one thread.
class OrbExtractor {
 public:
  explicit OrbExtractor(const OrbExtractorOptions& options = {});

  /// Features of `image`, by level from the finest, within a level in reading order. Empty for images too
  /// small to have any. Throws InvariantError for images wider or higher than 4095 px, which keypoints cannot
  /// name.
  void Extract(const GrayView& image, FeatureSet* features);

  const OrbExtractorOptions& options() const { return options_; }

 private:
  void SetUp(int width, int height);
  void SetQuotas();
  void Describe(size_t octave, FeatureSet* features);

  OrbExtractorOptions options_;
  const ImageKernels& kernels_;
  SteeredPattern pattern_;
  ImagePyramid pyramid_;
  std::vector<int> quotas_;  ///< keypoints asked of each level
  CornerDetector detector_;
  CornerSelector selector_;
  ImageSmoother smoother_;
  PaddedImage smooth_;
  std::vector<Corner> corners_;
  std::vector<Corner> chosen_;
};

}  // namespace dmslam
