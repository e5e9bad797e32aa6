#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/frame_source.h"
#include "dmslam/dataset/image.h"

namespace dmslam {

/// Makes of an image that one camera took the one that another camera would have taken from the same place:
/// cameras that work on one map must be of one model. Where the other camera is coarser, pixels are averaged;
/// beyond the image's rim its pixels are repeated.
class Resampler {
 public:
  Resampler(const Camera& from, const Camera& as);

  /// Share of the other camera's image that this one sees.
  double covered() const { return covered_; }
  /// Throws InputError where the image is not of the first camera's size; `name`: what to call it.
  GrayImage Resample(const GrayImage& image, const std::string& name) const;

 private:
  Eigen::Vector2d At(int x, int y) const {
    return at_[static_cast<size_t>(y) * static_cast<size_t>(as_.width_px) + static_cast<size_t>(x)];
  }

  Camera from_, as_;
  int samples_;                      ///< in each direction of a pixel
  std::vector<Eigen::Vector2d> at_;  ///< for each pixel, row by row: where it is in the first camera's image
  double covered_ = 0;
};

/// The frames of `source`, taken by camera `from`, as `as` would have taken them; those of a camera that sees
/// the same are left as they are. Throws InputError where `from` does not see what `as` does, or much less
/// sharply; `name`: what to call the frames.
std::unique_ptr<FrameSource> SeenAs(std::unique_ptr<FrameSource> source, const Camera& from, const Camera& as,
                                    const std::string& name);

}  // namespace dmslam
