// Camera files: read, or refused with an InputError.
#include "dmslam/camera/camera.h"
#include "fuzz_target.h"
#include "memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const dmslam::fuzz::MemoryFile file(data, size);
  try {
    const dmslam::Camera camera = dmslam::LoadCamera(file.path());
    dmslam::fuzz::Require(!camera.Problem().has_value(), "a camera that was accepted has no problem");
  } catch (const dmslam::InputError&) {
  }
  return 0;
}

namespace dmslam::fuzz {

std::vector<std::vector<uint8_t>> Seeds() {
  return {SeedOf("model: pinhole\nwidth: 640\nheight: 480\nfx: 517.3\nfy: 516.5\ncx: 318.6\ncy: 255.3\n"
                 "distortion: [0.2624, -0.9531, -0.0054, 0.0026, 1.1633]\nfps: 30\n"),
          SeedOf("{width: 640, height: 480, fx: 5.25e2, fy: 525, cx: 319.5, cy: 239.5}\n")};
}

}  // namespace dmslam::fuzz
