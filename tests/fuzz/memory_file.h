#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "dmslam/util/check.h"

namespace dmslam::fuzz {

/// Bytes as a file with a path, for readers that want one. Lives in memory.
class MemoryFile {
 public:
  MemoryFile(const uint8_t* data, size_t size) : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
    DMSLAM_CHECK(descriptor_ >= 0 && write(descriptor_, data, size) == static_cast<ssize_t>(size),
                 "no memory file");
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

/// A text as the bytes of a seed.
inline std::vector<uint8_t> SeedOf(const std::string& text) { return {text.begin(), text.end()}; }

}  // namespace dmslam::fuzz
