// A Video4Linux camera where there is none: preloaded, it makes the name in CAMERA_NAME open as a device that
// answers the requests of Video4Linux 2 by those of memory, and delivers the 640x480 grey pictures of the
// file CAMERA_FRAMES as YUYV, there and back, CAMERA_FPS a second.
//
//   c++ -std=c++20 -shared -fPIC v4l2_stand_in.cc -o v4l2_stand_in.so
//   LD_PRELOAD=./v4l2_stand_in.so CAMERA_NAME=/dev/video42 CAMERA_FRAMES=grey.raw CAMERA_FPS=10 PROGRAM...
//
// Its descriptor is a memory file in which the buffers lie, so mapping them and waiting for them are the
// kernel's own.
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fstream>
#include <iterator>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace {

constexpr int kWidth = 640, kHeight = 480, kPixels = kWidth * kHeight, kBytes = 2 * kPixels, kBuffers = 4;
using Clock = std::chrono::steady_clock;

std::string Variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

class Device {
 public:
  explicit Device(int fd) : fd_(fd), period_(1.0 / std::stod(Variable("CAMERA_FPS"))) {
    std::ifstream file(Variable("CAMERA_FRAMES"), std::ios::binary);
    grey_.assign(std::istreambuf_iterator<char>(file), {});
    if (ftruncate(fd_, static_cast<off_t>(kBuffers) * kBytes) == 0)
      memory_ = static_cast<unsigned char*>(
          mmap(nullptr, static_cast<size_t>(kBuffers) * kBytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0));
  }

  int fd() const { return fd_; }

  int Answer(unsigned long request, void* argument) {
    switch (request) {
      case VIDIOC_QUERYCAP:
        return QueryCapabilities(static_cast<v4l2_capability*>(argument));
      case VIDIOC_G_FMT:
      case VIDIOC_S_FMT:
      case VIDIOC_TRY_FMT:
        return Format(static_cast<v4l2_format*>(argument));
      case VIDIOC_G_PARM:
      case VIDIOC_S_PARM:
        return Rate(static_cast<v4l2_streamparm*>(argument));
      case VIDIOC_REQBUFS:
        queued_.clear();
        static_cast<v4l2_requestbuffers*>(argument)->count =
            std::min<unsigned>(kBuffers, static_cast<v4l2_requestbuffers*>(argument)->count);
        return 0;
      case VIDIOC_QUERYBUF:
        return QueryBuffer(static_cast<v4l2_buffer*>(argument));
      case VIDIOC_QBUF:
        queued_.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_DQBUF:
        return Deliver(static_cast<v4l2_buffer*>(argument));
      case VIDIOC_STREAMON:
        due_ = Clock::now();
        return 0;
      case VIDIOC_STREAMOFF:
        queued_.clear();
        return 0;
      default:
        errno = ENOTTY;  // as a driver without inputs, controls, ... answers
        return -1;
    }
  }

 private:
  static int QueryCapabilities(v4l2_capability* answer) {
    *answer = {};
    std::strcpy(reinterpret_cast<char*>(answer->card), "stand-in");
    answer->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    answer->capabilities = answer->device_caps | V4L2_CAP_DEVICE_CAPS;
    return 0;
  }

  // One size and one format, whatever is asked for.
  static int Format(v4l2_format* answer) {
    v4l2_pix_format& pixels = answer->fmt.pix;
    pixels = {};
    pixels.width = kWidth, pixels.height = kHeight;
    pixels.pixelformat = V4L2_PIX_FMT_YUYV, pixels.field = V4L2_FIELD_NONE;
    pixels.bytesperline = 2 * kWidth, pixels.sizeimage = kBytes;
    return 0;
  }

  int Rate(v4l2_streamparm* answer) const {
    answer->parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
    answer->parm.capture.timeperframe = {static_cast<unsigned>(1000 * period_.count()), 1000};
    return 0;
  }

  static int QueryBuffer(v4l2_buffer* answer) {
    if (answer->index >= kBuffers) {
      errno = EINVAL;
      return -1;
    }
    answer->length = kBytes;
    answer->m.offset = answer->index * static_cast<unsigned>(kBytes);
    return 0;
  }

  int Deliver(v4l2_buffer* answer) {
    if (queued_.empty() || Clock::now() < due_) {
      std::this_thread::sleep_until(due_);
      if (queued_.empty()) {
        errno = EAGAIN;
        return -1;
      }
    }
    due_ += std::chrono::duration_cast<Clock::duration>(period_);
    const size_t count = grey_.size() / kPixels, step = frame_++ % (2 * count);
    const char* grey = &grey_[(step < count ? step : 2 * count - 1 - step) * kPixels];
    answer->index = queued_.front();
    queued_.pop_front();
    unsigned char* yuyv = memory_ + static_cast<size_t>(answer->index) * kBytes;
    for (int i = 0; i < kPixels; ++i) {
      yuyv[2 * i] = static_cast<unsigned char>(grey[i]);
      yuyv[2 * i + 1] = 128;
    }
    answer->length = answer->bytesused = kBytes;
    answer->flags = V4L2_BUF_FLAG_MAPPED;
    answer->sequence = static_cast<unsigned>(frame_ - 1);
    return 0;
  }

  int fd_;
  std::chrono::duration<double> period_;
  std::vector<char> grey_;
  unsigned char* memory_ = nullptr;
  std::deque<unsigned> queued_;
  size_t frame_ = 0;
  Clock::time_point due_;
};

std::mutex lock;
Device* device = nullptr;  // lives as long as the program

int OpenStandIn(const char* name) {
  const std::lock_guard guard(lock);
  if (Variable("CAMERA_NAME") != name) return -1;
  if (!device) device = new Device(memfd_create("camera", 0));
  return dup(device->fd());
}

bool IsStandIn(int fd) {
  if (!device) return false;
  char a[64] = {}, b[64] = {};
  const auto link = [](int of, char* to) {
    return readlink(("/proc/self/fd/" + std::to_string(of)).c_str(), to, 63) > 0;
  };
  return link(fd, a) && link(device->fd(), b) && std::strcmp(a, b) == 0;
}

using OpenFunction = int (*)(const char*, int, ...);

int OpenOr(const char* next, const char* name, int flags, mode_t mode) {
  const int fd = OpenStandIn(name);
  return fd >= 0 ? fd : reinterpret_cast<OpenFunction>(dlsym(RTLD_NEXT, next))(name, flags, mode);
}

}  // namespace

extern "C" {

int open(const char* name, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = va_arg(arguments, mode_t);
  va_end(arguments);
  return OpenOr("open", name, flags, mode);
}

int open64(const char* name, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = va_arg(arguments, mode_t);
  va_end(arguments);
  return OpenOr("open64", name, flags, mode);
}

int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  {
    const std::lock_guard guard(lock);
    if (IsStandIn(fd)) return device->Answer(request, argument);
  }
  return reinterpret_cast<int (*)(int, unsigned long, ...)>(dlsym(RTLD_NEXT, "ioctl"))(fd, request, argument);
}
}
