#pragma once

#include "dmslam/features/orb_extractor.h"

namespace dmslam {

/// From the image to its features: more of them while a first map is looked for.
class FeatureStage {
 public:
  FeatureStage(const OrbExtractorOptions& options, double first_map_factor);

  FeatureSet Extract(const GrayView& image, bool for_first_map);
  /// How many features a frame is to have, once there is a map.
  int wanted() const { return wanted_; }
  double last_ms() const { return last_ms_; }

 private:
  OrbExtractor extractor_;
  OrbExtractor first_map_extractor_;
  int wanted_;
  double last_ms_ = 0;
};

}  // namespace dmslam
