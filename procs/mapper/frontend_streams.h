#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "dmslam/messaging/stream_reader.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// The streams of the frontends, one of each camera. What of them is in the map that this mapper goes on with
/// is not handed out again.
class FrontendStreams {
 public:
  /// Asks whether the record, the last one taken from this reader, may be forged and is to be said again.
  using IsDoubtful = std::function<bool(const Record&, StreamReader*)>;

  /// That of the next camera.
  void Add(std::unique_ptr<StreamReader> reader) { streams_.push_back({std::move(reader), Version()}); }
  /// The map with which this mapper begins holds that much of a camera's stream.
  void BeginWith(CameraId camera, const Version& mapped) { streams_[camera].mapped = mapped; }

  /// The next record of a camera that is new to the map, its channel called as it is where there is one
  /// camera. Those before it that are in the map are accepted. None: nothing is here, or what is here must be
  /// said again.
  std::optional<Record> Take(CameraId camera, const IsDoubtful& is_doubtful);
  void Accept(CameraId camera, const Version& version) { streams_[camera].reader->Accept(version); }
  /// What is here, and has no effect any more, counts as accepted.
  void AcceptUnread();

  CameraId size() const { return static_cast<CameraId>(streams_.size()); }
  /// In which a camera's frontend writes; 0: none is known.
  int64_t Epoch(CameraId camera) const { return streams_[camera].reader->term().epoch; }
  bool HasEnded(CameraId camera) const { return streams_[camera].reader->AtEnd(); }
  bool AllHaveEnded() const;
  /// No frontend was heard lately.
  bool AllAreGone(int64_t now_ns) const;
  /// The frontend of a camera was heard lately.
  bool IsThere(CameraId camera, int64_t now_ns) const {
    return streams_[camera].reader->writer_present(now_ns);
  }
  /// Records that are not taken yet, of the camera that has most of them.
  size_t LargestBacklog() const;
  std::vector<const StreamReader*> readers() const;

 private:
  struct Stream {
    std::unique_ptr<StreamReader> reader;
    Version mapped;  ///< what the map held already when this mapper began with it
  };
  std::vector<Stream> streams_;
};

}  // namespace dmslam
