#include "dmslam/dataset/bgr_frame.h"

#include <cstring>

namespace dmslam {

EncodedImage ToEncoded(const cv::Mat& frame) {
  EncodedImage image{ImageEncoding::kBgr8, frame.cols, frame.rows, {}};
  const size_t row_bytes = static_cast<size_t>(frame.cols) * 3;
  image.bytes.resize(row_bytes * static_cast<size_t>(frame.rows));
  for (int y = 0; y < frame.rows; ++y) {
    std::memcpy(image.bytes.data() + static_cast<size_t>(y) * row_bytes, frame.ptr(y), row_bytes);
  }
  return image;
}

}  // namespace dmslam
