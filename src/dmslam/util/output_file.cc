#include "dmslam/util/output_file.h"

#include <unistd.h>

#include <string>
#include <system_error>
#include <utility>

#include "dmslam/util/check.h"

namespace dmslam {

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
  std::error_code error;
  std::filesystem::rename(temporary_, path_, error);
  if (error) Fail();
}

void OutputFile::Fail() const {
  throw InputError(path_.string() +
                   ": cannot be written; check that the folder exists, may be written and has room");
}

}  // namespace dmslam
