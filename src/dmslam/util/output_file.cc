#include "dmslam/util/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

bool Sync(const std::filesystem::path& path, int how) {
  const int fd = open(path.c_str(), how | O_CLOEXEC);
  if (fd < 0) return false;
  // What knows no sync (a pipe, some network disks) has no more to offer.
  const bool synced = fsync(fd) == 0 || errno == EINVAL || errno == EROFS;
  const int reason = errno;
  close(fd);
  errno = reason;
  return synced;
}

std::filesystem::path FolderOf(const std::filesystem::path& file) {
  return file.parent_path().empty() ? "." : file.parent_path();
}

}  // namespace

OutputFile::OutputFile(std::filesystem::path path)
    : path_(std::move(path)), temporary_(path_.string() + ".part" + std::to_string(getpid())) {
  file_ = std::fopen(temporary_.c_str(), "wb");
  if (file_ == nullptr) Fail();
}

OutputFile::~OutputFile() {
  if (file_ != nullptr) std::fclose(file_);
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void OutputFile::Write(std::span<const std::byte> bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) Fail();
}

void OutputFile::Commit() {
  if (std::fclose(std::exchange(file_, nullptr)) != 0) Fail();
  if (!RenameDurably(temporary_, path_)) Fail();
}

void OutputFile::Fail() const {
  const int reason = errno;
  throw InputError(path_.string() + ": cannot be written (" + std::strerror(reason) +
                   "); check that the folder exists, may be written and has room");
}

void WriteFile(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.Write(text);
  file.Commit();
}

bool RenameDurably(const std::filesystem::path& from, const std::filesystem::path& to) {
  return Sync(from, O_RDONLY) && std::rename(from.c_str(), to.c_str()) == 0 && SyncFolderOf(to);
}

bool SyncFolderOf(const std::filesystem::path& path) { return Sync(FolderOf(path), O_RDONLY | O_DIRECTORY); }

void CheckNoFolder(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored) || (!file.empty() && file.filename().empty()))
    throw InputError(file.string() + ": is a folder; give the name of a file");
}

void CheckFolderOf(const std::filesystem::path& file) {
  CheckNoFolder(file);
  const std::filesystem::path folder = FolderOf(file);
  const auto refuse = [&](const std::string& why, const std::string& cure) {
    throw InputError(folder.string() + ": " + why + ", so " + file.filename().string() +
                     " cannot be written there; " + cure + ", or choose another folder");
  };
  std::error_code ignored;
  if (!std::filesystem::exists(folder, ignored)) refuse("no such folder", "make it");
  if (!std::filesystem::is_directory(folder, ignored)) refuse("is no folder", "move it away");
  if (access(folder.c_str(), W_OK) != 0) refuse("may not be written to", "change its rights");
}

}  // namespace dmslam
