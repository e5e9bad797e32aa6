#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/motion_segmentation/match.h"

namespace dmslam {

struct TimingOptions {
  int iterations = 2000;  ///< in total; DLRSAC shares them among its cells
  int rounds = 15;        ///< the methods take turns
};

/// Times of the paper's Table 1 [ms]: fundamental matrices from eight points, no early stop, no refits,
/// DLRSAC as the paper writes it; one thread, medians.
struct MethodTimes {
  double ransac_ms = 0;
  double arsac_ms = 0;
  double dlrsac_ms = 0;
  std::map<std::string, int> iterations;  ///< that each really made
};

MethodTimes TimeMethods(const std::vector<Match>& matches, const Camera& camera,
                        const TimingOptions& options);

}  // namespace dmslam
