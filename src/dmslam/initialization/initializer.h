#pragma once

#include <memory>
#include <optional>
#include <string>

#include "dmslam/camera/camera.h"
#include "dmslam/initialization/first_map.h"
#include "dmslam/initialization/initializer_options.h"

namespace dmslam {

/// What AddFrame answers.
struct InitializerReport {
  WaitReason wait = WaitReason::kTooFewFrames;
  std::string reason;              ///< the same in a sentence, with the numbers
  std::optional<FirstMap> result;  ///< set exactly when wait is kNone
  int num_matches = 0;             ///< between the reference and this frame
  double parallax_rad = 0;         ///< median, of the map or of one that had too little
};

/// Makes the first map out of a stream of frames. Several reference frames are kept side by side. Of each,
/// the selector says which matches with frames after it are static; where several pairs agree, the map that
/// they determine is made at once. Where they do not, every motion that the newest pair shows is carried
/// through all views, and the one whose support is widest (paper Eq. 3, times its number) over all of them
/// must win again and again for a while, and by far. A wrong start is worse than a late one. Same frames,
/// options, seed and selector: same answers.
class Initializer {
 public:
  Initializer(const InitializerOptions& options, const Camera& camera, uint64_t seed,
              AdjustFunction adjust = {}, SelectorMethod method = SelectorMethod::kDlrsac);
  ~Initializer();

  /// Frames come in order, each once. After a result the initialiser starts over with the next frame.
  InitializerReport AddFrame(const InitializerFrame& frame);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dmslam
