#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "dmslam/recording/map_file.h"

namespace dmslam {

/// The checkpoint of a run: its map as a saved map, in the folder of its results, while it goes on.
std::string CheckpointPath(const std::string& folder);
/// The one before it: what is left where the newest one is damaged.
std::string FormerCheckpointPath(const std::string& path);

/// When the next checkpoint is due: the oldest change of the map that is on no disk is never older than
/// `every_s`, of this host's time or of the frames' (a recording may play faster). The first one is due as
/// soon as there is a map. A pure state machine: time comes from outside.
class CheckpointSchedule {
 public:
  /// `every_s` = 0: none is ever due.
  explicit CheckpointSchedule(double every_s);

  /// The map is as of `version` now, and the newest frame was taken at `stamp_ns`; none: no frame is known,
  /// and only this host's time counts.
  void OnMap(uint64_t version, std::optional<int64_t> stamp_ns, int64_t now_ns);
  bool Due() const;
  /// There is a change that is on no disk, and none is being written.
  bool HasUnsaved() const { return every_ns_ > 0 && !writing_ && changed_; }
  /// Before this nothing becomes due without OnMap; INT64_MAX: never.
  int64_t deadline_ns() const;
  /// What the map is now is being written.
  void OnBegun();
  /// ... and is on the disk, or could not be written: then it is tried again when the time has come again.
  void OnEnded(bool written, int64_t now_ns);

 private:
  struct Moment {
    int64_t now_ns = 0;
    std::optional<int64_t> stamp_ns;
  };
  int64_t Age() const;

  int64_t every_ns_;
  uint64_t version_ = 0;
  std::optional<uint64_t> begun_version_;  ///< of the one that is, or was last, being written
  std::optional<Moment> changed_;          ///< when the map first was other than that
  Moment newest_;
  Moment begun_changed_;  ///< of what is being written: when it first was other than what is on the disk
  int64_t begun_ns_ = 0;
  int64_t duration_ns_ = 0;  ///< that the last one took
  bool writing_ = false;
  bool any_ = false;                 ///< there is one on the disk
  std::optional<int64_t> retry_ns_;  ///< the last one could not be written: not before that
};

/// Writes a checkpoint so that whatever happens at any time leaves the former one or this one whole: a file
/// of its own, synced, renamed, and the folder synced. The former one stays beside it. Throws InputError that
/// says why it cannot be written (a full disk); what was there is then still there.
void WriteCheckpoint(const std::string& path, const CutMap& map, const SessionStart& session);

/// What was found of a session's checkpoints.
struct FoundCheckpoint {
  std::optional<RebuiltMap> map;
  std::string path;     ///< of the one that was read
  std::string problem;  ///< why it was not the newest one, or why there is none
};
/// The newest checkpoint of `session` that is whole; of another session's there is none. `features`: see
/// RebuildMap.
FoundCheckpoint FindCheckpoint(const std::string& path, uint32_t session,
                               const std::shared_ptr<FeatureStore>& features = nullptr);

/// What a run of another session than this one needs to be resumed, its journal and its checkpoints, is moved
/// out of the way, together: see SetAside. `begins`: so is what one of the same session has left. Returns the
/// folder; none where there is nothing of the kind. Throws InputError.
std::optional<std::string> SetFormerRunAside(const std::string& folder, int64_t session, bool begins);

/// The run has ended, or another one begins.
void RemoveCheckpoints(const std::string& path);

}  // namespace dmslam
