#include "dmslam/dataset/video_source.h"

#include "dmslam/dataset/bgr_frame.h"
#include "dmslam/util/check.h"

#ifdef DMSLAM_HAVE_VIDEOIO

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>

namespace dmslam {
namespace {

class VideoSource : public FrameSource {
 public:
  VideoSource(const std::string& path, double fallback_fps) : path_(path) {
    Open();
    const double stated_fps = capture_.get(cv::CAP_PROP_FPS);
    fps_ = stated_fps > 0 && stated_fps <= 1000 ? stated_fps : fallback_fps;
    // The number that containers state is often an estimate; counting decodes the file once.
    while (capture_.grab()) ++count_;
    if (count_ == 0) throw InputError(path + ": no frame can be decoded; is it a video?");
    Open();
  }
  size_t size() const override { return count_; }
  int64_t StampNs(size_t index) const override {
    return std::llround(static_cast<double>(index) * 1e9 / fps_);
  }
  std::string Name(size_t index) const override { return path_ + " frame " + std::to_string(index); }

  EncodedImage Read(size_t index) override {
    if (index < next_) Open();
    cv::Mat frame;
    for (; next_ <= index; ++next_) {
      if (!capture_.grab()) throw InputError(Name(next_) + ": cannot be decoded; is the file complete?");
    }
    if (!capture_.retrieve(frame) || frame.type() != CV_8UC3) {
      throw InputError(Name(index) + ": cannot be decoded to 8-bit colour; convert the video");
    }
    return ToEncoded(frame);
  }

 private:
  void Open() {
    if (!capture_.open(path_, cv::CAP_FFMPEG))
      throw InputError(path_ + ": cannot be opened as a video; check the file and its codec");
    next_ = 0;
  }

  std::string path_;
  cv::VideoCapture capture_;
  double fps_ = 30.0;
  size_t count_ = 0;
  size_t next_ = 0;  ///< The frame that the next grab gives.
};

}  // namespace

std::unique_ptr<FrameSource> OpenVideo(const std::string& path, double fallback_fps) {
  return std::make_unique<VideoSource>(path, fallback_fps);
}

}  // namespace dmslam

#else

namespace dmslam {

std::unique_ptr<FrameSource> OpenVideo(const std::string& path, double) {
  throw InputError(path + ": this build reads no video; install libopencv-videoio-dev and build again");
}

}  // namespace dmslam

#endif
