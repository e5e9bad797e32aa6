// Trajectories and lists of images as the TUM RGB-D benchmark writes them: read, or refused with an
// InputError.
#include "dmslam/dataset/trajectory.h"
#include "dmslam/dataset/tum_sequence.h"
#include "fuzz_target.h"
#include "memory_file.h"

namespace {

template <typename Read>
void ReadOrRefuse(const Read& read) {
  try {
    read();
  } catch (const dmslam::InputError&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const dmslam::fuzz::MemoryFile file(data, size);
  ReadOrRefuse([&] { dmslam::ReadTrajectory(file.path()); });
  ReadOrRefuse([&] { dmslam::ReadGroundTruth(file.path()); });
  ReadOrRefuse([&] { dmslam::ReadStampedFiles(file.path()); });
  return 0;
}

namespace dmslam::fuzz {

std::vector<std::vector<uint8_t>> Seeds() {
  return {SeedOf("# ground truth\n1305031102.175304 1.0 -2.5e-3 0 0 0 0 1\n1305031102.211214 1 2 3 0.5 0.5 "
                 "0.5 0.5\n"),
          SeedOf("# color images\n1305031102.175304 rgb/1305031102.175304.png\n1305031102.211214 "
                 "rgb/1305031102.211214.png\n"),
          SeedOf("1,1,1,1,0,0,0,1\r\n2,1,1,1,0,0,0,1\r\n")};
}

}  // namespace dmslam::fuzz
