#include "dmslam/recording/journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "dmslam/messaging/codec.h"
#include "dmslam/recording/set_aside.h"
#include "dmslam/util/check.h"
#include "dmslam/util/crc32c.h"
#include "dmslam/util/output_file.h"

namespace dmslam {
namespace {

constexpr size_t kLengthBytes = 4;
constexpr size_t kSessionBytes = 8;
constexpr uint32_t kMostBytes = 1u << 24;  // of a record: beyond it is damage
constexpr size_t kChecksumBytes = 4;
constexpr uint32_t kNoteBit = 1u << 31;      // of the length: the owner's note, no record
constexpr uint32_t kChecksumBit = 1u << 30;  // ... the last bytes are the CRC32C of those before

/// The bytes without their checksum; none where it does not fit them.
std::optional<std::span<const uint8_t>> Verified(std::span<const uint8_t> bytes) {
  if (bytes.size() < kChecksumBytes) return std::nullopt;
  const std::span<const uint8_t> payload = bytes.first(bytes.size() - kChecksumBytes);
  if (GetInt<uint32_t>(bytes, payload.size()) != Crc32c(payload)) return std::nullopt;
  return payload;
}

bool IsNote(std::span<const uint8_t> framed) { return (GetInt<uint32_t>(framed, 0) & kNoteBit) != 0; }

}  // namespace

std::string JournalPath(const std::string& folder) { return folder + "/collector.journal"; }

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
  const uint32_t length = framing & ~(kNoteBit | kChecksumBit);
  if (length == 0 || length > kMostBytes) return std::nullopt;
  Entry entry{(framing & kNoteBit) != 0, ReadAt(*offset + static_cast<int64_t>(kLengthBytes), length)};
  if (entry.bytes.size() != length) return std::nullopt;
  if ((framing & kChecksumBit) != 0) {
    const auto payload = Verified(entry.bytes);
    if (!payload) return std::nullopt;
    entry.bytes.resize(payload->size());
  }
  *offset += static_cast<int64_t>(kLengthBytes + length);
  return entry;
}

std::optional<int64_t> Journal::SessionOf(const Entry& entry) {
  if (entry.is_note) {
    if (entry.bytes.size() < kSessionBytes) return std::nullopt;
    return GetInt<int64_t>(entry.bytes, 0);
  }
  const std::optional<RecordHeader> header = ParseHeader(entry.bytes);
  if (!header) return std::nullopt;
  return header->session;
}

/// Of the first record.
std::optional<int64_t> Journal::SessionThere() const {
  int64_t offset = 0;
  const std::optional<Entry> entry = ReadEntry(&offset);
  return entry ? SessionOf(*entry) : std::nullopt;
}

std::optional<int64_t> Journal::SessionOf(const std::string& path) {
  if (access(path.c_str(), F_OK) != 0) return std::nullopt;
  Journal journal(path);
  journal.Open(O_RDONLY);
  return journal.SessionThere();
}

/// False where it begins with another session's.
bool Journal::ReadAll(const Handler& handle, const NoteHandler& read) {
  size_ = 0;
  int64_t whole = 0;
  while (const std::optional<Entry> entry = ReadEntry(&whole)) {
    if (SessionOf(*entry) != session_) return size_ > 0;
    if (!entry->is_note && handle) handle(entry->bytes);
    if (entry->is_note && read) read({entry->bytes.begin() + kSessionBytes, entry->bytes.end()});
    size_ = whole;
  }
  return true;
}

void Journal::Resume(int64_t session, const Handler& handle, const NoteHandler& read) {
  session_ = session;
  Open(O_RDWR | O_CREAT);
  if (!ReadAll(handle, read)) {
    SetAsideWhatIsThere();
  } else if (ftruncate(fd_, size_) != 0) {
    throw InputError(path_ + ": cannot be written; check its rights");
  }
  SyncFolderOf(path_);
}

bool Journal::Read(const std::string& path, int64_t session, const Handler& handle, const NoteHandler& read) {
  if (access(path.c_str(), F_OK) != 0) return false;
  Journal journal(path);
  journal.session_ = session;
  journal.Open(O_RDONLY);
  return journal.ReadAll(handle, read) && journal.size_ > 0;
}

void Journal::Begin(int64_t session) {
  session_ = session;
  Open(O_RDWR | O_CREAT);
  if (!ReadAt(0, 1).empty()) SetAsideWhatIsThere();
  SyncFolderOf(path_);
}

void Journal::ForEach(const Handler& handle) {
  int64_t offset = 0;
  while (offset < size_) {
    const std::optional<Entry> entry = ReadEntry(&offset);
    if (!entry) break;
    if (!entry->is_note) handle(entry->bytes);
  }
  for (const std::vector<uint8_t>& framed : kept_) {
    const size_t length = framed.size() - kLengthBytes - kChecksumBytes;
    if (!IsNote(framed)) handle(std::span(framed).subspan(kLengthBytes, length));
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
  const size_t length = entry.bytes.size() + kChecksumBytes;
  std::vector<uint8_t> framed(kLengthBytes + length);
  const uint32_t note_bit = entry.is_note ? kNoteBit : 0;
  PutInt(static_cast<uint32_t>(length) | kChecksumBit | note_bit, 0, framed);
  std::copy(entry.bytes.begin(), entry.bytes.end(), framed.begin() + kLengthBytes);
  PutInt(Crc32c(entry.bytes), kLengthBytes + entry.bytes.size(), framed);
  kept_bytes_ += framed.size();
  kept_.push_back(std::move(framed));
  pending_ += entry.is_note ? 0 : 1;
  Flush();
  while (kept_bytes_ > kMostKept) {
    lost_ += IsNote(kept_.front()) ? 0 : 1;
    DropFirstKept();
  }
}

bool Journal::Flush() {
  while (!kept_.empty() && WriteFramed(kept_.front())) DropFirstKept();
  return kept_.empty();
}

void Journal::DropFirstKept() {
  pending_ -= IsNote(kept_.front()) ? 0 : 1;
  kept_bytes_ -= kept_.front().size();
  kept_.pop_front();
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

void Journal::Sync() const {
  if (fd_ < 0 || fdatasync(fd_) == 0) return;
  throw InputError(path_ + ": is not safe from a power cut (" + std::strerror(errno) + "); check its disk");
}

void Journal::Sync(const std::string& path) {
  Journal journal(path);
  journal.Open(O_RDONLY);
  journal.Sync();
}

void Journal::Remove() {
  Close();
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

/// What another session has left is none of ours, and not ours to remove.
void Journal::SetAsideWhatIsThere() {
  const int64_t session = SessionThere().value_or(0);
  Close();
  const std::filesystem::path path(path_);
  const std::string folder = path.has_parent_path() ? path.parent_path().string() : ".";
  SetAside(folder, session, {path.filename().string()});
  Open(O_RDWR | O_CREAT);
}

void Journal::Open(int how) {
  Close();
  fd_ = open(path_.c_str(), how | O_CLOEXEC, 0644);
  if (fd_ < 0) {
    const std::string what = how == O_RDONLY ? "read" : "written";
    throw InputError(path_ + ": cannot be " + what + " (" + std::strerror(errno) +
                     "); check the folder given with --out");
  }
  size_ = 0;
}

void Journal::Close() {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
}

}  // namespace dmslam
