#include "simulated_disk.h"

#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <mutex>
#include <utility>

namespace {

using FileId = std::pair<dev_t, ino_t>;

std::mutex mutex;

/// How long each file was when it was synced.
std::map<FileId, off_t>& Synced() {
  static std::map<FileId, off_t> synced;
  return synced;
}

void NoteSync(int fd) {
  struct stat file {};
  if (fstat(fd, &file) != 0) return;
  const std::lock_guard<std::mutex> lock(mutex);
  Synced()[{file.st_dev, file.st_ino}] = file.st_size;
}

off_t SyncedSize(const std::string& path) {
  struct stat file {};
  if (stat(path.c_str(), &file) != 0) return 0;
  const std::lock_guard<std::mutex> lock(mutex);
  const auto synced = Synced().find({file.st_dev, file.st_ino});
  return synced == Synced().end() ? 0 : synced->second;
}

}  // namespace

extern "C" {
int fsync(int fd) {
  NoteSync(fd);
  return static_cast<int>(syscall(SYS_fsync, fd));
}
int fdatasync(int fd) {
  NoteSync(fd);
  return static_cast<int>(syscall(SYS_fdatasync, fd));
}
}

namespace dmslam::simulation {

void LoseUnsynced(const std::string& path, Random* random) {
  std::error_code error;
  const auto size = static_cast<int64_t>(std::filesystem::file_size(path, error));
  const auto synced = static_cast<int64_t>(SyncedSize(path));
  if (error || size <= synced) return;
  const auto kept = static_cast<int64_t>(random->Uniform() * static_cast<double>(size - synced));
  std::filesystem::resize_file(path, static_cast<uintmax_t>(synced + kept), error);
}

}  // namespace dmslam::simulation
