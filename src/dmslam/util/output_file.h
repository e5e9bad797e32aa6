#pragma once

#include <cstdio>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace dmslam {

/// A file that appears under its name only when it is complete and on the disk: written beside it, synced and
/// renamed by Commit. Dropped without Commit it leaves nothing. Throws InputError naming the file and the
/// reason when it cannot be written.
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

/// Throws InputError where a file of this name cannot be written since it is the name of a folder.
void CheckNoFolder(const std::filesystem::path& file);

/// Throws InputError that names the folder of a file where nothing can be written into it: it is not there,
/// is none, or may not be written to. One that names the file where it is a folder itself.
void CheckFolderOf(const std::filesystem::path& file);

/// Writes a whole file: the former one stays until the new one is complete.
void WriteFile(const std::filesystem::path& path, std::string_view text);

/// Renames a file that is complete, so that a power cut leaves either the former one or all of this one: its
/// content is synced first, and then the folder. False where that fails; errno says why.
bool RenameDurably(const std::filesystem::path& from, const std::filesystem::path& to);

/// Makes sure that a power cut does not take the file's name, as of one that was just made. False where that
/// fails.
bool SyncFolderOf(const std::filesystem::path& path);

}  // namespace dmslam
