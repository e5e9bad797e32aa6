#include "collector/journal.h"

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "dmslam/messaging/codec.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr size_t kLengthBytes = 4;

constexpr uint32_t kMostBytes = 1u << 24;  // of a record: beyond it is damage

}  // namespace

/// False at the end, and where a record is not whole.
bool Journal::ReadNext(std::vector<uint8_t>* record) {
  std::vector<uint8_t> length_bytes(kLengthBytes);
  if (std::fread(length_bytes.data(), 1, kLengthBytes, file_) != kLengthBytes) return false;
  const auto length = GetInt<uint32_t>(length_bytes, 0);
  if (length > kMostBytes) return false;
  record->resize(length);
  return std::fread(record->data(), 1, length, file_) == length;
}

void Journal::Resume(int64_t session, const Handler& handle) {
  Open();
  std::rewind(file_);
  std::vector<uint8_t> record;
  long whole = 0;
  while (ReadNext(&record)) {
    const std::optional<RecordHeader> header = ParseHeader(record);
    if (!header || header->session != session) break;
    handle(record);
    whole = std::ftell(file_);
  }
  if (ftruncate(fileno(file_), whole) != 0) throw InputError(path_ + ": cannot be written; check its rights");
  std::fseek(file_, 0, SEEK_END);
}

void Journal::ForEach(const Handler& handle) {
  std::rewind(file_);
  std::vector<uint8_t> record;
  while (ReadNext(&record)) handle(record);
  std::fseek(file_, 0, SEEK_END);
}

void Journal::Append(std::span<const uint8_t> record) {
  std::vector<uint8_t> length(kLengthBytes);
  PutInt(static_cast<uint32_t>(record.size()), 0, length);
  const bool written = std::fwrite(length.data(), 1, length.size(), file_) == length.size() &&
                       std::fwrite(record.data(), 1, record.size(), file_) == record.size() &&
                       std::fflush(file_) == 0;
  if (!written) throw InputError(path_ + ": cannot be written; is the disk full?");
}

void Journal::Remove() {
  Close();
  std::filesystem::remove(path_);
}

void Journal::Open() {
  Close();
  file_ = std::fopen(path_.c_str(), "a+b");
  if (file_ == nullptr) throw InputError(path_ + ": cannot be written; check the folder given with --out");
}

void Journal::Close() {
  if (file_ != nullptr) std::fclose(file_);
  file_ = nullptr;
}

}  // namespace dmslam
