#pragma once

#include <opencv2/core.hpp>

#include "dmslam/dataset/image.h"

namespace dmslam {

/// A frame as OpenCV's videoio delivers it (BGR, 8 bits a channel), row after row without gaps.
EncodedImage ToEncoded(const cv::Mat& frame);

}  // namespace dmslam
