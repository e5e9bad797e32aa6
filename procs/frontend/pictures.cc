#include "frontend/pictures.h"

#include <cstdio>
#include <opencv2/imgproc.hpp>

namespace dmslam {
namespace {

cv::Scalar ColorOf(FeatureClass kind) {  // RGB
  switch (kind) {
    case FeatureClass::kUsed:
      return {0, 210, 60};
    case FeatureClass::kRejected:
      return {250, 210, 0};
    case FeatureClass::kMoving:
      return {240, 30, 30};
    case FeatureClass::kNone:
      break;
  }
  return {90, 110, 140};
}

}  // namespace

void WritePicture(const std::string& dir, const GrayImage& image, const TrackedFrame& frame,
                  const FramePose& pose) {
  const cv::Mat gray(image.height, image.width, CV_8UC1, const_cast<uint8_t*>(image.data.data()));
  ColorImage color;
  color.width = image.width;
  color.height = image.height;
  color.data.resize(static_cast<size_t>(image.width) * static_cast<size_t>(image.height) * 3);
  cv::Mat canvas(image.height, image.width, CV_8UC3, color.data.data());
  cv::cvtColor(gray, canvas, cv::COLOR_GRAY2RGB);
  for (size_t i = 0; i < frame.classes.size(); ++i) {
    const Keypoint& keypoint = frame.features->set.keypoints[i];
    const cv::Point at(keypoint.x_q4 / 16, keypoint.y_q4 / 16);
    const bool matched = frame.classes[i] != FeatureClass::kNone;
    cv::circle(canvas, at, matched ? 3 : 1, ColorOf(frame.classes[i]), 1, cv::LINE_AA);
  }
  char text[160];
  std::snprintf(text, sizeof(text), "frame %u  static %u  moving %u  unknown %u", pose.frame_index,
                pose.num_static, pose.num_moving, pose.num_unknown);
  cv::rectangle(canvas, cv::Rect(0, image.height - 22, image.width, 22), cv::Scalar(0, 0, 0), cv::FILLED);
  cv::putText(canvas, text, cv::Point(6, image.height - 6), cv::FONT_HERSHEY_SIMPLEX, 0.5,
              cv::Scalar(255, 255, 255), 1, cv::LINE_AA);
  char name[64];
  std::snprintf(name, sizeof(name), "/frame_%06u.png", pose.frame_index);
  WriteFileBytes(dir + name, EncodePng(color));
}

}  // namespace dmslam
