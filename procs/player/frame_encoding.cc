#include "player/frame_encoding.h"

namespace dmslam {
namespace {

FrameEncoding ToFrameEncoding(ImageEncoding encoding) {
  switch (encoding) {
    case ImageEncoding::kPng:
      return FrameEncoding::kPng;
    case ImageEncoding::kGray8:
      return FrameEncoding::kGray8;
    case ImageEncoding::kRgb8:
      return FrameEncoding::kRgb8;
    case ImageEncoding::kBgr8:
      return FrameEncoding::kBgr8;
    default:
      return FrameEncoding::kJpeg;
  }
}

}  // namespace

FrameEncoding ParseFrameEncoding(const std::string& text) {
  if (text == "png") return FrameEncoding::kPng;
  return text == "raw" ? FrameEncoding::kGray8 : FrameEncoding::kJpeg;
}

void EncodeFrame(const EncodedImage& image, const std::string& name, const EncodingOptions& options,
                 bool keep_raw, Frame* frame) {
  const bool compressed = image.encoding == ImageEncoding::kJpeg || image.encoding == ImageEncoding::kPng;
  if ((compressed || keep_raw) && !options.reencode) {
    frame->encoding = ToFrameEncoding(image.encoding);
    frame->data = image.bytes;
    frame->width_px = image.width;
    frame->height_px = image.height;
    return;
  }
  const GrayImage gray = DecodeGray(image, name);
  frame->encoding = options.encoding;
  switch (options.encoding) {
    case FrameEncoding::kPng:
      frame->data = EncodePng(gray);
      break;
    case FrameEncoding::kGray8:
      frame->data = gray.data;
      frame->width_px = gray.width;
      frame->height_px = gray.height;
      break;
    default:
      frame->encoding = FrameEncoding::kJpeg;
      frame->data = EncodeJpeg(gray, options.jpeg_quality);
  }
}

}  // namespace dmslam
