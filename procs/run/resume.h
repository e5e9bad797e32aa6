#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace dmslam {

/// What a run was begun with: kept in OUT/run.json, for whoever resumes it.
struct RunIdentity {
  uint32_t session = 0;
  std::string folder;                  ///< in which it was begun: paths may be relative to it
  std::vector<std::string> arguments;  ///< of dmslam-run, without its name
  int64_t pid = 0;                     ///< of the dmslam-run that wrote it last
  int resumed = 0;                     ///< how often it was resumed

  /// Throw InputError that names the file.
  void Write(const std::string& out) const;
  static RunIdentity Read(const std::string& out);
};

/// Held as long as a run writes into a folder; the kernel gives it back, however its holder ends. A copy of
/// the folder is not held.
class RunLock {
 public:
  /// Throws InputError that names who holds it.
  explicit RunLock(const std::string& out);
  ~RunLock();
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;

 private:
  int fd_ = -1;
};

/// Moves what `--resume` needs of a run that has not ended (its run.json, journal and checkpoints) out of the
/// way of another one that begins in the same folder: see SetAside. Returns the folder in which it is kept
/// and can be resumed; none where there is no such run. The caller holds the RunLock. Throws InputError.
std::optional<std::string> KeepUnfinishedRun(const std::string& out);

/// From where a run whose processes all died goes on.
struct ResumePoint {
  uint32_t session = 0;
  std::optional<uint32_t> last_frame;  ///< the newest one of which there is a word on the disk
  /// A recording is played again behind this one: the first keyframe that is in no checkpoint comes next, so
  /// that the map that is lost is made again. A camera's are numbered behind `last_frame`.
  std::optional<uint32_t> play_behind;
  size_t keyframes = 0;
  std::optional<uint32_t> newest_keyframe;  ///< its frame, where it is of this session
  double lead_s = 0;    ///< before the first frame: mapper and frontend need it to have the map again
  std::string warning;  ///< what is worse than it should be; empty: nothing
};
/// Throws InputError that says why the run in `out` cannot be resumed.
ResumePoint FindResumePoint(const std::string& out, const RunIdentity& identity);

}  // namespace dmslam
