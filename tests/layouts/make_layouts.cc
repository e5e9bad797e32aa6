// The same frames in all layouts that are read: make_layouts SEQUENCE OUT FRAMES writes the first frames of a
// TUM folder, in grey and without loss, as OUT/tum, OUT/euroc, OUT/numbered and OUT/video.avi, 30 a second
// from time zero.
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>

#include "dmslam/dataset/image.h"
#include "dmslam/dataset/tum_sequence.h"

namespace {

namespace fs = std::filesystem;

constexpr double kFps = 30.0;

int64_t StampNs(int i) { return std::llround(i * 1e9 / kFps); }

std::string Number(const char* form, int64_t a, int64_t b = 0) {
  char text[64];
  std::snprintf(text, sizeof(text), form, static_cast<long long>(a), static_cast<long long>(b));
  return text;
}

cv::Mat ToBgr(const dmslam::GrayImage& gray) {
  cv::Mat bgr(gray.height, gray.width, CV_8UC3);
  for (int y = 0; y < gray.height; ++y)
    for (int x = 0; x < gray.width; ++x) bgr.at<cv::Vec3b>(y, x) = cv::Vec3b::all(gray.at(x, y));
  return bgr;
}

void MakeLayouts(const std::string& sequence, const fs::path& out, int frames) {
  for (const char* folder : {"tum/rgb", "euroc/mav0/cam0/data", "numbered"})
    fs::create_directories(out / folder);
  std::ofstream tum(out / "tum/rgb.txt"), euroc(out / "euroc/mav0/cam0/data.csv");
  euroc << "#timestamp [ns],filename\n";
  dmslam::TumSequence source(sequence);
  cv::VideoWriter video;
  for (int i = 0; i < frames; ++i) {
    const auto index = static_cast<size_t>(i);
    const dmslam::GrayImage gray = dmslam::DecodeGray(source.Read(index), source.Name(index));
    const std::vector<uint8_t> png = dmslam::EncodePng(gray);
    const int64_t stamp_ns = StampNs(i);
    const std::string stamp_s = Number("%lld.%09lld", stamp_ns / 1'000'000'000, stamp_ns % 1'000'000'000);
    const std::string stamp = std::to_string(stamp_ns);
    tum << stamp_s << " rgb/" << stamp_s << ".png\n";
    euroc << stamp << "," << stamp << ".png\n";
    dmslam::WriteFileBytes((out / "tum/rgb" / (stamp_s + ".png")).string(), png);
    dmslam::WriteFileBytes((out / "euroc/mav0/cam0/data" / (stamp + ".png")).string(), png);
    dmslam::WriteFileBytes((out / "numbered" / ("frame" + std::to_string(i) + ".png")).string(), png);
    if (i == 0) {
      video.open((out / "video.avi").string(), cv::CAP_FFMPEG, cv::VideoWriter::fourcc('F', 'F', 'V', '1'),
                 kFps, {gray.width, gray.height});
      if (!video.isOpened()) throw std::runtime_error("OpenCV writes no FFV1 video here");
    }
    video.write(ToBgr(gray));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "Usage: make_layouts SEQUENCE OUT FRAMES\n");
    return 2;
  }
  try {
    const std::string_view text = argv[3];
    int frames = 0;
    std::from_chars(text.data(), text.data() + text.size(), frames);
    MakeLayouts(argv[1], argv[2], frames);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_layouts: %s\n", error.what());
    return 1;
  }
  return 0;
}
