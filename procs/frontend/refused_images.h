#pragma once

#include <cstdint>
#include <string>

namespace dmslam {

/// Why a frame's image cannot be tracked.
struct ImageProblem {
  enum class Kind {
    kUnreadable,  ///< no image, damaged or truncated
    kOtherSize,   ///< than the camera's
  };
  Kind kind = Kind::kUnreadable;
  std::string text;  ///< names the frame, and what to do
};

/// Counts the frames that were refused. Where no frame has fitted before, the camera is another one than was
/// said. Later a frame is somebody else's, and costs its place alone.
class RefusedImages {
 public:
  enum class Consequence {
    kNone,         ///< it is counted
    kWarn,         ///< ... and the first one, of which is told
    kOtherCamera,  ///< nothing of this sequence will fit
  };
  /// `any_fitted`: whether a frame was tracked before.
  Consequence Count(const ImageProblem& problem, bool any_fitted);
  /// Those that cost their place alone.
  int64_t bad() const { return bad_; }

 private:
  int64_t bad_ = 0, of_other_size_ = 0;
};

}  // namespace dmslam
