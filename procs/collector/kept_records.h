#pragma once

#include <cstdint>
#include <istream>
#include <map>
#include <optional>
#include <string>

#include "dmslam/messaging/types.h"
#include "dmslam/recording/journal.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// What of the frontends' streams is kept on disk, since it is in no replica and is needed at the end; and
/// how far each of them is there, so that a collector after this one goes on behind it. A disk that is full
/// ends no run: what it does not take waits in memory, and is not safe, so that the frontend keeps it too.
class KeptRecords {
 public:
  explicit KeptRecords(const std::string& path) : journal_(path) {}

  Journal& journal() { return journal_; }
  const Journal& journal() const { return journal_; }

  /// Up to there what is to be kept of a frontend's stream has been handed over: the last record that is.
  void SetPosition(CameraId camera, const Version& version) { safe_[camera] = version; }
  /// A note of this class's kind, "taken"; `text` stands behind the kind. Cameras from `num_cameras` on are
  /// none of ours.
  void ReadNote(std::istream& text, CameraId num_cameras);
  /// The frontends that wrote what is there are gone; the next ones begin anew.
  void ForgetPositions() { safe_.clear(); }

  /// Why the disk takes no more, where it refuses from this record on.
  std::optional<std::string> Keep(const Record& record, int64_t now_ns);
  /// Up to there a frontend's stream was taken. Behind the last record that is kept there may be what is kept
  /// nowhere: that it was here is noted.
  void NotePosition(CameraId camera, const Version& taken);
  /// Tries to write what waits, where something does.
  void Retry(int64_t now_ns);

  /// All that was handed over is on the disk.
  bool complete() const { return journal_.complete(); }
  /// Up to where a frontend's stream is kept; with all that came before it, once it is `complete`.
  Version PositionOf(CameraId camera) const;

 private:
  Journal journal_;
  std::map<CameraId, Version> safe_;
  std::optional<int64_t> say_again_ns_;  ///< how much waits; none: the disk takes all
};

}  // namespace dmslam
