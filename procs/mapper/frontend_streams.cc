#include "mapper/frontend_streams.h"

#include <algorithm>

#include "dmslam/messaging/camera_channels.h"

namespace dmslam {

std::optional<Record> FrontendStreams::Take(CameraId camera, const IsDoubtful& is_doubtful) {
  Stream& stream = streams_[camera];
  while (std::optional<Record> record = stream.reader->Take()) {
    if (is_doubtful(*record, stream.reader.get())) return std::nullopt;
    // A term before that one is of a frontend that began on a clock that is behind, when nobody named it.
    const Version version = record->version();
    if (version.epoch == stream.mapped.epoch && version <= stream.mapped) {
      stream.reader->Accept(version);
      continue;
    }
    record->channel = SplitCamera(record->channel).channel;
    return record;
  }
  return std::nullopt;
}

void FrontendStreams::AcceptUnread() {
  for (const Stream& stream : streams_) {
    while (stream.reader->Take()) stream.reader->AcceptTaken();
  }
}

bool FrontendStreams::AllHaveEnded() const {
  return std::ranges::all_of(streams_, [](const Stream& stream) { return stream.reader->AtEnd(); });
}

bool FrontendStreams::AllAreGone(int64_t now_ns) const {
  return std::ranges::none_of(
      streams_, [now_ns](const Stream& stream) { return stream.reader->writer_present(now_ns); });
}

size_t FrontendStreams::LargestBacklog() const {
  int64_t most = 0;
  for (const Stream& stream : streams_) most = std::max(most, stream.reader->backlog());
  return static_cast<size_t>(most);
}

std::vector<const StreamReader*> FrontendStreams::readers() const {
  std::vector<const StreamReader*> readers;
  for (const Stream& stream : streams_) readers.push_back(stream.reader.get());
  return readers;
}

}  // namespace dmslam
