#include "collector/journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "dmslam/messaging/codec.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr size_t kLengthBytes = 4;
constexpr size_t kSessionBytes = 8;
constexpr uint32_t kMostBytes = 1u << 24;  // of a record: beyond it is damage
constexpr uint32_t kNoteBit = 1u << 31;    // of the length: the owner's note, no record

}  // namespace

std::vector<uint8_t> Journal::ReadAt(int64_t offset, size_t size) const {
  std::vector<uint8_t> bytes(size);
  const ssize_t got = pread(fd_, bytes.data(), size, offset);
  bytes.resize(got > 0 ? static_cast<size_t>(got) : 0);
  return bytes;
}

/// None at the end, and where it is not whole.
std::optional<Journal::Entry> Journal::ReadEntry(int64_t* offset) const {
  const std::vector<uint8_t> length_bytes = ReadAt(*offset, kLengthBytes);
  if (length_bytes.size() < kLengthBytes) return std::nullopt;
  const auto framing = GetInt<uint32_t>(length_bytes, 0);
  const uint32_t length = framing & ~kNoteBit;
  if (length == 0 || length > kMostBytes) return std::nullopt;
  Entry entry{(framing & kNoteBit) != 0, ReadAt(*offset + static_cast<int64_t>(kLengthBytes), length)};
  if (entry.bytes.size() != length) return std::nullopt;
  *offset += static_cast<int64_t>(kLengthBytes + length);
  return entry;
}

bool Journal::IsOf(int64_t session, const Entry& entry) {
  if (entry.is_note) return entry.bytes.size() >= kSessionBytes && GetInt<int64_t>(entry.bytes, 0) == session;
  const std::optional<RecordHeader> header = ParseHeader(entry.bytes);
  return header && header->session == session;
}

void Journal::Resume(int64_t session, const Handler& handle, const NoteHandler& read) {
  session_ = session;
  Open();
  int64_t whole = 0;
  while (const std::optional<Entry> entry = ReadEntry(&whole)) {
    if (!IsOf(session, *entry)) return SetAside();
    if (!entry->is_note) handle(entry->bytes);
    if (entry->is_note && read) read({entry->bytes.begin() + kSessionBytes, entry->bytes.end()});
    size_ = whole;
  }
  if (ftruncate(fd_, size_) != 0) throw InputError(path_ + ": cannot be written; check its rights");
}

void Journal::Begin(int64_t session) {
  session_ = session;
  Open();
  if (!ReadAt(0, 1).empty()) SetAside();
}

void Journal::ForEach(const Handler& handle) {
  int64_t offset = 0;
  while (offset < size_) {
    const std::optional<Entry> entry = ReadEntry(&offset);
    if (!entry) break;
    if (!entry->is_note) handle(entry->bytes);
  }
  for (const std::vector<uint8_t>& framed : kept_) {
    const bool is_note = (GetInt<uint32_t>(framed, 0) & kNoteBit) != 0;
    if (!is_note) handle(std::span(framed).subspan(kLengthBytes));
  }
}

void Journal::Append(std::span<const uint8_t> record) {
  AppendEntry({false, std::vector<uint8_t>(record.begin(), record.end())});
}

void Journal::AppendNote(const std::string& note) {
  Entry entry{true, std::vector<uint8_t>(kSessionBytes + note.size())};
  PutInt(session_, 0, entry.bytes);
  std::copy(note.begin(), note.end(), entry.bytes.begin() + kSessionBytes);
  AppendEntry(entry);
}

void Journal::AppendEntry(const Entry& entry) {
  std::vector<uint8_t> framed(kLengthBytes + entry.bytes.size());
  PutInt(static_cast<uint32_t>(entry.bytes.size()) | (entry.is_note ? kNoteBit : 0), 0, framed);
  std::copy(entry.bytes.begin(), entry.bytes.end(), framed.begin() + kLengthBytes);
  kept_bytes_ += framed.size();
  kept_.push_back(std::move(framed));
  WriteKept();
  while (kept_bytes_ > kMostKept) {
    kept_bytes_ -= kept_.front().size();
    kept_.pop_front();
    ++lost_;
  }
}

void Journal::WriteKept() {
  while (!kept_.empty() && WriteFramed(kept_.front())) {
    kept_bytes_ -= kept_.front().size();
    kept_.pop_front();
  }
}

/// All of it or nothing.
bool Journal::WriteFramed(const std::vector<uint8_t>& framed) {
  const ssize_t written = pwrite(fd_, framed.data(), framed.size(), size_);
  if (written == static_cast<ssize_t>(framed.size())) {
    size_ += static_cast<int64_t>(framed.size());
    return true;
  }
  const std::string reason = written < 0 ? std::strerror(errno) : "No space left on device";
  if (problem_.empty()) problem_ = path_ + ": cannot be written (" + reason + ")";
  if (written > 0 && ftruncate(fd_, size_) != 0) return false;  // half a record is none to whoever reads it
  return false;
}

void Journal::Sync() {
  if (fd_ >= 0) fdatasync(fd_);
}

void Journal::Remove() {
  Close();
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

/// What another session has left is none of ours, and not ours to remove.
void Journal::SetAside() {
  Close();
  const std::string aside = path_ + ".former";
  std::error_code error;
  std::filesystem::rename(path_, aside, error);
  if (error) throw InputError(path_ + ": is of another session, and cannot be renamed; check its rights");
  Open();
}

void Journal::Open() {
  Close();
  fd_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd_ < 0) {
    throw InputError(path_ + ": cannot be written (" + std::strerror(errno) +
                     "); check the folder given with --out");
  }
  size_ = 0;
}

void Journal::Close() {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
}

}  // namespace dmslam
