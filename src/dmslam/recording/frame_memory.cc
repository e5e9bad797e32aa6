#include "dmslam/recording/frame_memory.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include "dmslam/messaging/codec.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

// A frame as text: its number and the length of the pose's message (0: no pose), that message, what was seen.
constexpr size_t kIntBytes = 4;

std::string EndOfName(CameraId camera) { return "-camera" + std::to_string(camera) + ".frames"; }

std::string PathOf(const std::string& folder, uint32_t session, CameraId camera, const char* part) {
  return fs::path(folder) / (std::to_string(session) + part + EndOfName(camera));
}

std::string Encode(const RememberedFrame& frame) {
  const Bytes pose = frame.pose ? wire::Encode(*frame.pose) : Bytes();
  const Bytes seen = wire::Encode(frame.seen);
  Bytes bytes(2 * kIntBytes);
  PutInt(frame.seen.id.frame_index(), 0, bytes);
  PutInt(static_cast<uint32_t>(pose.size()), kIntBytes, bytes);
  bytes.insert(bytes.end(), pose.begin(), pose.end());
  bytes.insert(bytes.end(), seen.begin(), seen.end());
  return {bytes.begin(), bytes.end()};
}

std::span<const uint8_t> BytesOf(const std::string& text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

std::optional<uint32_t> IndexOf(const std::string& text) {
  if (text.size() < 2 * kIntBytes) return std::nullopt;
  return GetInt<uint32_t>(BytesOf(text), 0);
}

/// None where it is no such frame.
std::optional<RememberedFrame> Decode(const std::string& text) {
  if (!IndexOf(text)) return std::nullopt;
  const std::span<const uint8_t> messages = BytesOf(text).subspan(2 * kIntBytes);
  const size_t length = GetInt<uint32_t>(BytesOf(text), kIntBytes);
  if (length > messages.size()) return std::nullopt;
  std::optional<FramePose> pose;
  if (length > 0 && !(pose = wire::Decode<FramePose>(messages.first(length)))) return std::nullopt;
  std::optional<KeyframeProposal> seen = wire::Decode<KeyframeProposal>(messages.subspan(length));
  if (!seen) return std::nullopt;
  return RememberedFrame{*std::move(seen), std::move(pose)};
}

/// What a file says of each frame of before `end`, by its number.
using Frames = std::map<uint32_t, std::string>;
Frames ReadFile(const std::string& path, uint32_t session, uint32_t end) {
  Frames frames;
  Journal::Read(path, session, {}, [&](const std::string& text) {
    const std::optional<uint32_t> index = IndexOf(text);
    if (index && *index < end) frames.insert_or_assign(*index, text);
  });
  return frames;
}

/// Of the frames in a file; none where there is none.
struct FrameRange {
  std::optional<uint32_t> first, last;
  size_t bytes = 0;
};
FrameRange RangeIn(const std::string& path, uint32_t session) {
  FrameRange range;
  Journal::Read(path, session, {}, [&](const std::string& text) {
    const std::optional<uint32_t> index = IndexOf(text);
    if (!index) return;
    range.first = std::min(range.first.value_or(*index), *index);
    range.last = std::max(range.last.value_or(*index), *index);
    range.bytes += text.size();
  });
  return range;
}

}  // namespace

std::string FrameMemoryPath(const std::string& folder) { return folder + "/frames"; }

FrameMemory::FrameMemory(std::string folder, uint32_t session, CameraId camera, size_t max_bytes)
    : folder_(std::move(folder)),
      session_(session),
      camera_(camera),
      max_bytes_(max_bytes),
      paths_{PathOf(folder_, session, camera, "-a"), PathOf(folder_, session, camera, "-b")},
      journals_{Journal(paths_[0]), Journal(paths_[1])} {}

void FrameMemory::Open(uint32_t first) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw InputError(folder_ + ": cannot be made (" + error.message() + "); check --frame-memory");
  RemoveOtherSessions();
  const std::array<FrameRange, 2> there{RangeIn(paths_[0], session_), RangeIn(paths_[1], session_)};
  const bool useful = std::ranges::any_of(
      there, [&](const FrameRange& range) { return range.first && *range.first < first; });
  if (!useful) RemoveFrames();
  current_ = useful && there[1].last > there[0].last ? 1 : 0;
  written_ = useful ? there[current_].bytes : 0;
  journals_[current_].Resume(session_, {});
}

void FrameMemory::Add(const RememberedFrame& frame) {
  if (written_ >= max_bytes_) {
    current_ = 1 - current_;
    journals_[current_].Remove();
    journals_[current_].Begin(session_);
    written_ = 0;
  }
  const std::string text = Encode(frame);
  journals_[current_].AppendNote(text);
  written_ += text.size();
}

void FrameMemory::ForEach(uint32_t end, const std::function<void(RememberedFrame)>& take) const {
  Frames frames = ReadFile(paths_[current_], session_, end);
  frames.merge(ReadFile(paths_[1 - current_], session_, end));  // what was told last stays
  for (auto next = frames.rbegin(); next != frames.rend(); ++next) {
    if (std::optional<RememberedFrame> frame = Decode(next->second)) take(*std::move(frame));
  }
}

void FrameMemory::RemoveFrames() {
  for (Journal& journal : journals_) journal.Remove();
}

/// Where another camera's frames are in the folder, it stays.
void FrameMemory::Remove() {
  RemoveFrames();
  std::error_code ignored;
  fs::remove(folder_, ignored);
}

void FrameMemory::RemoveOtherSessions() const {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder_, ignored)) {
    const fs::path name = entry.path().filename();
    const auto is_named_so = [&](const std::string& path) { return fs::path(path).filename() == name; };
    if (name.string().ends_with(EndOfName(camera_)) && std::ranges::none_of(paths_, is_named_so))
      fs::remove(entry.path(), ignored);
  }
}

}  // namespace dmslam
