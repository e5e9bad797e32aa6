#pragma once

#include <functional>
#include <string>

#include "dmslam/synthetic/world.h"

namespace dmslam {

struct SequenceOptions {
  WorldOptions world;
  RenderOptions render;
  Camera camera = SyntheticCamera();
  int frames = 300;
  int64_t first_stamp_ns = 1'700'000'000'000'000'000;
  bool png = false;  ///< Images as PNG instead of JPEG.
  int jpeg_quality = 95;
  bool gray = false;  ///< Grey images instead of colour.
  bool masks = true;  ///< mask/ and mask.txt; without actors there is nothing to mask, and they are left out.
};

/// What a written sequence amounts to.
struct SequenceReport {
  int frames = 0;
  double path_m = 0;         ///< Length of the camera's path.
  double mean_coverage = 0;  ///< Share of the image that people cover, moving or not, mean over frames.
  double mean_moving_coverage = 0;  ///< Share that people cover while they move.
  size_t revisits = 0;
};

/// How many frames a tour or a ring takes for 1.15 rounds, 1500 at least.
int DefaultRoundFrames(const SequenceOptions& options);

/// Renders a sequence into a folder in the format of the TUM RGB-D benchmark: rgb/, rgb.txt, groundtruth.txt
/// (exact, at the middle of each exposure), mask/ and mask.txt, coverage.txt (share of the image covered by
/// people, a line per frame), camera.yaml, loops.json (revisits), synthetic.json (what it was made of).
/// `progress` is called after each frame; when it returns false, writing ends. Throws InputError when files
/// cannot be written or options do not fit together.
SequenceReport WriteSequence(const SequenceOptions& options, const std::string& folder,
                             const std::function<bool(int frames_done)>& progress);

}  // namespace dmslam
