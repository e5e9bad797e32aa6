#include "collector/journal.h"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <vector>

#include "dmslam/messaging/codec.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr size_t kLengthBytes = 4;

std::vector<uint8_t> ReadWhole(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace

void Journal::Resume(int64_t session, const std::function<void(std::span<const uint8_t> record)>& handle) {
  const std::vector<uint8_t> all = ReadWhole(path_);
  const std::span<const uint8_t> bytes(all);
  size_t at = 0;
  while (bytes.size() - at > kLengthBytes) {
    const auto length = static_cast<size_t>(GetInt<uint32_t>(bytes, at));
    if (length > bytes.size() - at - kLengthBytes) break;
    const std::span<const uint8_t> record = bytes.subspan(at + kLengthBytes, length);
    const std::optional<RecordHeader> header = ParseHeader(record);
    if (!header || header->session != session) break;
    handle(record);
    at += kLengthBytes + length;
  }
  if (at < all.size()) std::filesystem::resize_file(path_, at);
  Open("ab");
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

void Journal::Open(const char* mode) {
  Close();
  file_ = std::fopen(path_.c_str(), mode);
  if (file_ == nullptr) throw InputError(path_ + ": cannot be written; check the folder given with --out");
}

void Journal::Close() {
  if (file_ != nullptr) std::fclose(file_);
  file_ = nullptr;
}

}  // namespace dmslam
