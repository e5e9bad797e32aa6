#include "dmslam/util/page_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace dmslam {
namespace {

/// What is taken from the disk at a time.
constexpr size_t kChunkBytes = size_t{16} << 20;

size_t PageBytes() {
  static const auto bytes = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  return bytes;
}

size_t WholePages(size_t bytes) { return (bytes + PageBytes() - 1) / PageBytes() * PageBytes(); }

/// Open, and without a name; -1: errno says why not.
int OpenNameless(const std::string& folder) {
  const int made = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (made >= 0) return made;
  std::string name = folder + "/dmslam-pages-XXXXXX";  // where the file system knows no such files
  const int named = mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) unlink(name.c_str());
  return named;
}

}  // namespace

class PageFile::File {
 public:
  explicit File(int descriptor) : descriptor_(descriptor) {}
  ~File() { close(descriptor_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  int descriptor() const { return descriptor_; }
  /// Gives the room of a part back to the disk. Where that fails it stays taken, which harms nobody else.
  void Free(size_t offset, size_t bytes) const {
    static_cast<void>(fallocate(descriptor_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE,
                                static_cast<off_t>(offset), static_cast<off_t>(bytes)));
  }

 private:
  int descriptor_;
};

/// A part of the file that is mapped as a whole.
class PageFile::Chunk {
 public:
  Chunk(std::shared_ptr<File> file, size_t offset, std::byte* data, size_t bytes)
      : file_(std::move(file)), offset_(offset), data_(data), bytes_(bytes) {}
  ~Chunk() {
    munmap(data_, bytes_);
    file_->Free(offset_, bytes_);
  }
  Chunk(const Chunk&) = delete;
  Chunk& operator=(const Chunk&) = delete;

  size_t left() const { return bytes_ - taken_; }
  std::byte* Take(size_t bytes) { return data_ + std::exchange(taken_, taken_ + bytes); }
  void Free(const std::byte* piece, size_t bytes) const {
    file_->Free(offset_ + static_cast<size_t>(piece - data_), bytes);
  }
  void LetGo() const { madvise(data_, bytes_, MADV_DONTNEED); }

 private:
  std::shared_ptr<File> file_;
  size_t offset_;
  std::byte* data_;
  size_t bytes_;
  size_t taken_ = 0;
};

PageFile::PageFile(std::string folder) : folder_(std::move(folder)) {}
PageFile::~PageFile() = default;

std::shared_ptr<std::byte> PageFile::Take(size_t bytes) {
  problem_.clear();
  const size_t whole = WholePages(std::max<size_t>(bytes, 1));
  if ((newest_ == nullptr || newest_->left() < whole) && !AddChunk(whole)) return nullptr;
  return {newest_->Take(whole), [chunk = newest_, whole](std::byte* piece) { chunk->Free(piece, whole); }};
}

bool PageFile::AddChunk(size_t at_least) {
  const auto fail = [this] {
    problem_ = folder_ + ": " + std::strerror(errno);
    return false;
  };
  if (file_ == nullptr) {
    const int descriptor = OpenNameless(folder_);
    if (descriptor < 0) return fail();
    file_ = std::make_shared<File>(descriptor);
  }
  const size_t bytes = std::max(kChunkBytes, at_least), offset = file_bytes_;
  // Not posix_fallocate, which writes where the file system cannot promise room, and so promises nothing.
  if (fallocate(file_->descriptor(), 0, static_cast<off_t>(offset), static_cast<off_t>(bytes)) != 0) {
    const int reason = std::exchange(errno, 0);
    file_->Free(offset, bytes);  // some file systems take what there is before they refuse
    errno = reason;
    return fail();
  }
  void* data = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file_->descriptor(),
                    static_cast<off_t>(offset));
  if (data == MAP_FAILED) {
    const int reason = errno;
    file_->Free(offset, bytes);
    errno = reason;
    return fail();
  }
  file_bytes_ += bytes;
  newest_ = std::make_shared<Chunk>(file_, offset, static_cast<std::byte*>(data), bytes);
  chunks_.push_back(newest_);
  return true;
}

void PageFile::LetGo() {
  std::erase_if(chunks_, [](const std::weak_ptr<Chunk>& chunk) {
    const std::shared_ptr<Chunk> held = chunk.lock();
    if (held != nullptr) held->LetGo();
    return held == nullptr;
  });
}

std::string FolderForPages() {
  const char* folder = std::getenv("TMPDIR");
  return folder != nullptr && *folder != '\0' ? folder : "/var/tmp";
}

}  // namespace dmslam
