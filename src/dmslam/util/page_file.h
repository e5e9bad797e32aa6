#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace dmslam {

/// Memory that lies in a file: the kernel writes it to the disk and takes the memory back when it is short of
/// it, or when it is told to with `LetGo`. For much that is kept and seldom read. Who reads it notes nothing
/// of that. The file has no name, so it is gone with the process, however that ends.
///
/// Its room on the disk is taken before the memory is handed out: a full disk shows in `Take`, and nowhere
/// else. One thread at a time; a piece may be dropped on any thread.
class PageFile {
 public:
  /// `folder`: on a disk. Nothing is made there before the first `Take`.
  explicit PageFile(std::string folder);
  ~PageFile();
  PageFile(const PageFile&) = delete;
  PageFile& operator=(const PageFile&) = delete;

  /// So much memory, zeros, at the beginning of a page; it may outlive the PageFile. Its room on the disk is
  /// free again when nobody holds it any more. Null where the disk has no room, or cannot promise it:
  /// `problem` says why. It may have room later.
  std::shared_ptr<std::byte> Take(size_t bytes);
  /// Why the last `Take` gave nothing; empty: it gave.
  const std::string& problem() const { return problem_; }
  /// Whether there is anything in the file.
  bool used() const { return !chunks_.empty(); }
  /// Takes what lies in the file out of this process's memory, written or not. It is read again from the
  /// file, a page at a time, when it is used.
  void LetGo();

 private:
  class File;
  class Chunk;

  bool AddChunk(size_t at_least);

  std::string folder_;
  std::string problem_;
  std::shared_ptr<File> file_;
  size_t file_bytes_ = 0;
  std::shared_ptr<Chunk> newest_;             ///< from which pieces are taken
  std::vector<std::weak_ptr<Chunk>> chunks_;  ///< all of which pieces are left
};

/// Where files belong that are large and of no use to the next process: TMPDIR, or else /var/tmp, which is on
/// a disk where /tmp may not be.
std::string FolderForPages();

}  // namespace dmslam
