#include "dmslam/messaging/event_log.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>

#include "dmslam/messaging/codec.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"

namespace dmslam {
namespace {

constexpr int32_t kSync = static_cast<int32_t>(0xEDA1DA01);
constexpr std::array<uint8_t, 4> kSyncBytes = {0xED, 0xA1, 0xDA, 0x01};
constexpr size_t kHeaderSize = 28;
constexpr int32_t kMaxChannelBytes = 255;
constexpr int32_t kMaxDataBytes = 256 << 20;
constexpr size_t kBufferBytes = 1 << 20;

}  // namespace

int64_t EventLogReader::Lengths::total() const { return static_cast<int64_t>(kHeaderSize) + channel + data; }

EventLogReader::EventLogReader(std::string path)
    : path_(std::move(path)), file_(std::fopen(path_.c_str(), "rb")) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path_, ignored))
    throw InputError(path_ + ": is a folder; give the log or the saved map itself");
  if (!file_ || std::fseek(file_.get(), 0, SEEK_END) != 0) {
    throw InputError(path_ + ": cannot be read; check the path of the log");
  }
  size_ = std::ftell(file_.get());
  if (!FindEvent(0, size_)) {
    throw InputError(path_ +
                     ": is no LCM log; give a file that lcm-logger or `dmslam-player --to-log` has written");
  }
}

/// Makes `num_bytes` from `offset` on available in the buffer; false when the file has not so many.
bool EventLogReader::Load(int64_t offset, size_t num_bytes) {
  if (offset < 0 || offset + static_cast<int64_t>(num_bytes) > size_) return false;
  const int64_t end = buffer_offset_ + static_cast<int64_t>(buffer_.size());
  if (offset >= buffer_offset_ && offset + static_cast<int64_t>(num_bytes) <= end) return true;
  buffer_.resize(std::min(std::max(num_bytes, kBufferBytes), static_cast<size_t>(size_ - offset)));
  buffer_offset_ = offset;
  const bool read = std::fseek(file_.get(), static_cast<long>(offset), SEEK_SET) == 0 &&
                    std::fread(buffer_.data(), 1, buffer_.size(), file_.get()) == buffer_.size();
  if (!read)
    throw InputError(path_ + ": cannot be read at byte " + std::to_string(offset) + "; check the disk");
  return true;
}

/// The lengths in the header at `offset`, if one can stand there: it begins as it should, names a channel
/// that can be, and its event lies within the file.
std::optional<EventLogReader::Lengths> EventLogReader::HeaderAt(int64_t offset) {
  if (!Load(offset, kHeaderSize)) return std::nullopt;
  const std::span<const uint8_t> header =
      std::span(buffer_).subspan(static_cast<size_t>(offset - buffer_offset_));
  if (GetInt<int32_t>(header, 0) != kSync) return std::nullopt;
  const auto channel = GetInt<int32_t>(header, 20), data = GetInt<int32_t>(header, 24);
  if (channel < 1 || channel > kMaxChannelBytes || data < 0 || data > kMaxDataBytes) return std::nullopt;
  const Lengths lengths{channel, data};
  if (offset + lengths.total() > size_ || !Load(offset, kHeaderSize + static_cast<size_t>(channel)))
    return std::nullopt;
  const auto name = buffer_.begin() + (offset - buffer_offset_) + static_cast<int64_t>(kHeaderSize);
  const bool printable = std::all_of(name, name + channel, [](uint8_t c) { return c > 0x20 && c < 0x7f; });
  return printable ? std::optional(lengths) : std::nullopt;
}

/// Whether what these lengths enclose is followed by the beginning of another event, whole or not, or by the
/// end. If not, bytes are missing in it, its lengths are wrong, or what follows is damaged: it is not to be
/// trusted.
bool EventLogReader::IsFollowed(int64_t offset, const Lengths& lengths) {
  const int64_t end = offset + lengths.total();
  const auto num_bytes = static_cast<size_t>(std::min<int64_t>(4, size_ - end));
  if (!Load(end, num_bytes)) return false;
  return std::equal(kSyncBytes.begin(), kSyncBytes.begin() + static_cast<ptrdiff_t>(num_bytes),
                    buffer_.begin() + (end - buffer_offset_));
}

/// The first place from `from` on, before `before`, where an event stands.
std::optional<int64_t> EventLogReader::FindEvent(int64_t from, int64_t before) {
  for (int64_t at = from; at < before;) {
    const auto block = static_cast<size_t>(std::min<int64_t>(static_cast<int64_t>(kBufferBytes), size_ - at));
    if (!Load(at, block)) return std::nullopt;
    const auto begin = buffer_.begin() + (at - buffer_offset_);
    const auto end = begin + static_cast<int64_t>(block);
    const auto found = std::search(begin, end, kSyncBytes.begin(), kSyncBytes.end());
    if (found == end) {
      if (at + static_cast<int64_t>(block) == size_) return std::nullopt;
      at += static_cast<int64_t>(block) - 3;  // the word may stand across the border
      continue;
    }
    at += found - begin;
    if (at >= before) return std::nullopt;
    if (HeaderAt(at)) return at;
    ++at;
  }
  return std::nullopt;
}

LogEvent EventLogReader::Read(int64_t offset, const Lengths& lengths) {
  Load(offset, static_cast<size_t>(lengths.total()));
  const std::span<const uint8_t> bytes =
      std::span(buffer_).subspan(static_cast<size_t>(offset - buffer_offset_));
  LogEvent event;
  event.number = GetInt<int64_t>(bytes, 4);
  event.utime_us = GetInt<int64_t>(bytes, 12);
  event.offset = offset;
  const auto name = bytes.begin() + static_cast<int64_t>(kHeaderSize);
  event.channel.assign(name, name + lengths.channel);
  event.bytes.assign(name + lengths.channel, name + lengths.channel + lengths.data);
  return event;
}

void EventLogReader::CountGap(int64_t offset, int64_t end) {
  if (gap_open_) {
    gaps_.back().num_bytes = end - gaps_.back().offset;
    return;
  }
  gaps_.push_back({offset, end - offset, 0});
  gap_open_ = true;
}

bool EventLogReader::UseKey(const BusKey& key) {
  EventLogReader log(path_);
  while (const std::optional<LogEvent> event = log.NextWhole()) {
    if (!key.Verify(WithoutPrefix(event->channel), event->bytes)) continue;
    key_ = key;
    return true;
  }
  return false;
}

std::optional<LogEvent> EventLogReader::Next() {
  while (std::optional<LogEvent> event = NextWhole()) {
    const std::string channel = WithoutPrefix(event->channel);
    if (key_ && !key_->Verify(channel, event->bytes)) {
      if (!channel.empty()) ++refused_;
      continue;
    }
    event->bytes.resize(WithoutTag(event->bytes).size());
    return event;
  }
  return std::nullopt;
}

std::optional<LogEvent> EventLogReader::NextWhole() {
  while (at_ < size_) {
    const std::optional<Lengths> lengths = HeaderAt(at_);
    if (!lengths || !IsFollowed(at_, *lengths)) {
      const int64_t next = FindEvent(at_ + 1, size_).value_or(size_);
      CountGap(at_, next);
      at_ = next;
      continue;
    }
    LogEvent event = Read(at_, *lengths);
    at_ += lengths->total();
    const int64_t lost = event.number - last_number_ - 1;
    if (gap_open_ && lost > 0 && lost <= gaps_.back().num_bytes) gaps_.back().lost_events = lost;
    gap_open_ = false;
    last_number_ = event.number;
    return event;
  }
  gap_open_ = false;
  return std::nullopt;
}

void EventLogReader::Seek(int64_t offset) {
  at_ = offset;
  gap_open_ = false;
  last_number_ = INT64_MAX / 2;
}

std::string EventLogReader::DescribeGaps() const {
  if (gaps_.empty()) return {};
  constexpr size_t kNamed = 3;
  int64_t bytes = 0;
  std::string places;
  for (size_t i = 0; i < gaps_.size(); ++i) {
    const LogGap& gap = gaps_[i];
    bytes += gap.num_bytes;
    if (i >= kNamed) continue;
    places += (i == 0 ? "" : ", ") + std::to_string(gap.num_bytes) + " at byte " + std::to_string(gap.offset);
    if (gap.offset + gap.num_bytes == size_) places += " (its end)";
    if (gap.lost_events > 0) places += " (" + std::to_string(gap.lost_events) + " messages)";
  }
  if (gaps_.size() > kNamed) places += " and " + std::to_string(gaps_.size() - kNamed) + " more places";
  return path_ + ": " + std::to_string(bytes) + " of " + std::to_string(size_) +
         " bytes are damaged and were skipped: " + places;
}

EventLogWriter::EventLogWriter(std::string path)
    : path_(std::move(path)), file_(std::fopen(path_.c_str(), "wb")) {
  if (file_) return;
  CheckFolderOf(path_);
  throw InputError(path_ + ": cannot be written; check that it is no folder and may be written to");
}

void EventLogWriter::Write(int64_t utime_us, const std::string& channel, std::span<const uint8_t> bytes) {
  std::array<uint8_t, kHeaderSize> header{};
  PutInt(kSync, 0, header);
  PutInt(next_number_++, 4, header);
  PutInt(utime_us, 12, header);
  PutInt(static_cast<int32_t>(channel.size()), 20, header);
  PutInt(static_cast<int32_t>(bytes.size()), 24, header);
  std::fwrite(header.data(), 1, header.size(), file_.get());
  std::fwrite(channel.data(), 1, channel.size(), file_.get());
  std::fwrite(bytes.data(), 1, bytes.size(), file_.get());
  if (std::ferror(file_.get()) != 0) throw InputError(path_ + ": cannot be written; is the disk full?");
}

void EventLogWriter::Close() {
  if (!file_) return;
  const bool whole = std::fflush(file_.get()) == 0 && std::ferror(file_.get()) == 0;
  file_.reset();
  if (!whole) throw InputError(path_ + ": cannot be written; is the disk full?");
}

std::string WithoutPrefix(const std::string& channel) {
  const size_t at = channel.find("DMSLAM_");
  return at == std::string::npos ? std::string() : channel.substr(at);
}

}  // namespace dmslam
