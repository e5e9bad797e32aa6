#pragma once

#include <cstdio>
#include <filesystem>
#include <span>
#include <string_view>

namespace dmslam {

/// A file that appears under its name only when it is complete: written beside it and renamed by Commit.
/// Dropped without Commit it leaves nothing. Throws InputError naming the file when it cannot be written.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void Write(std::span<const std::byte> bytes);
  void Write(std::string_view text) { Write(std::as_bytes(std::span(text))); }
  void Commit();

 private:
  [[noreturn]] void Fail() const;

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  std::FILE* file_ = nullptr;
};

}  // namespace dmslam
