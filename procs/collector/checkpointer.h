#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "dmslam/map/map.h"
#include "dmslam/recording/checkpoint.h"
#include "dmslam/recording/journal.h"
#include "dmslam/runtime/core_thread.h"

namespace dmslam {

/// Keeps on disk what a run needs to be resumed when all its processes die at once: the map, every so many
/// seconds in which it changed, and the journal of frame poses, every second. Only the map's copy is made on
/// the thread that reads the streams; all that waits for the disk is done on the thread given to it. A
/// checkpoint is never ahead of the journal: that is synced first.
class Checkpointer {
 public:
  struct Options {
    double every_s = 10;  ///< 0: no checkpoints, the journal alone
    std::string path;
    std::function<int64_t()> now_ns;
  };
  Checkpointer(Options options, std::unique_ptr<CoreThread> thread, Journal* journal);
  ~Checkpointer();

  /// The map as it is now. Begins a checkpoint where one is due and the map may be read (`whole`).
  void OnMap(const Map& map, bool whole, std::optional<int64_t> newest_stamp_ns,
             const std::optional<SessionStart>& session);
  /// Begins to sync the journal.
  void SyncJournal();
  /// When OnMap should be called again.
  int64_t deadline_ns() const;
  /// Waits for what is being written.
  void Finish();
  /// Writes what is not on the disk yet, and waits for it. Whether all of the map is there.
  bool WriteLast(const Map& map, bool whole, const std::optional<SessionStart>& session);
  /// Why one could not be written, once; empty when there is nothing new to say.
  std::string TakeProblem();
  int64_t written() const { return written_; }
  bool enabled() const { return options_.every_s > 0; }

 private:
  void Begin(const Map& map, const SessionStart& session);
  /// The work of the thread that reads the streams.
  struct Copied {
    int64_t begun_ns = 0, ended_ns = 0;
    size_t keyframes = 0, landmarks = 0;
  };
  void OnEnded(const Copied& copied, const std::string& problem);
  void Warn(const std::string& problem);

  static constexpr int64_t kLookAgainNs = 100'000'000;
  Options options_;
  CheckpointSchedule schedule_;
  Journal* journal_;
  std::optional<int64_t> look_again_ns_;  ///< one was due, and could not begin: not before that
  int64_t written_ = 0;
  bool warned_ = false;
  std::string problem_;
  std::unique_ptr<CoreThread> thread_;  ///< ends before everything that its jobs touch
};

}  // namespace dmslam
