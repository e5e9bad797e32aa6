#pragma once

#include <opencv2/core.hpp>

#include "dmslam/features/gray_pixels.h"
#include "dmslam/util/check.h"

namespace dmslam {

/// The pixels of an 8-bit single-channel matrix, not copied: `image` must outlive the view.
inline GrayView ViewOf(const cv::Mat& image) {
  DMSLAM_CHECK(image.type() == CV_8UC1, "a grey view needs a matrix of type CV_8UC1");
  return {image.ptr<uint8_t>(), image.cols, image.rows, static_cast<ptrdiff_t>(image.step[0])};
}

/// A copy of a view as a matrix of type CV_8UC1.
inline cv::Mat MatOf(const GrayView& view) {
  cv::Mat matrix(view.height, view.width, CV_8UC1);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) matrix.at<uint8_t>(y, x) = view.row(y)[x];
  }
  return matrix;
}

}  // namespace dmslam
