#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/messaging/types.h"

namespace dmslam {

/// The collector's, in the folder of a run's results, while it goes on.
std::string JournalPath(const std::string& folder);

/// Records on disk: what a run of any length needs only at its end takes no memory, and a collector that is
/// started again has what the one before it had accepted. A record that was not written whole is not there,
/// nor is what follows it: each carries a checksum, since after a power cut a file may end in anything.
class Journal {
 public:
  explicit Journal(std::string path) : path_(std::move(path)) {}
  ~Journal() { Close(); }
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  using Handler = std::function<void(std::span<const uint8_t> record)>;
  using NoteHandler = std::function<void(const std::string& note)>;

  /// Hands out the records of `session` that are there, in order, and goes on behind them. A journal of
  /// another session is set aside (see SetAside); what is damaged is cut off.
  void Resume(int64_t session, const Handler& handle, const NoteHandler& read = {});
  /// Begins an empty one; what is there is set aside.
  void Begin(int64_t session);
  /// Hands out the same as Resume, of a file that others may write, and changes nothing. False where there is
  /// no journal of this session.
  static bool Read(const std::string& path, int64_t session, const Handler& handle,
                   const NoteHandler& read = {});
  /// Whose records are there; none where there is no journal, or no whole record in it.
  static std::optional<int64_t> SessionOf(const std::string& path);
  /// Hands out all records, in order.
  void ForEach(const Handler& handle);
  /// Where the disk takes no more the record is kept in memory, at most kMostKept bytes of them, and written
  /// as soon as the disk takes some again.
  void Append(std::span<const uint8_t> record);
  /// A note of its owner's, between the records.
  void AppendNote(const std::string& note);
  /// Tries again to write what is kept in memory. Whether all of it is on the disk now.
  bool Flush();
  /// Whether all that was appended is on the disk.
  bool complete() const { return kept_.empty(); }
  /// How many records are kept in memory because the disk takes none: whoever dies now loses them.
  int64_t pending() const { return pending_; }
  /// Why the disk took no more when it first did not; empty where it always did.
  const std::string& problem() const { return problem_; }
  /// How many records were given up, because the disk took none for too long.
  int64_t lost() const { return lost_; }
  /// On the disk, whatever becomes of this host. Throws InputError where the disk refuses.
  void Sync() const;
  /// The same for what others have left.
  static void Sync(const std::string& path);
  /// It is no longer needed.
  void Remove();

 private:
  static constexpr size_t kMostKept = 64u << 20;

  void Open(int how);
  void Close();
  bool ReadAll(const Handler& handle, const NoteHandler& read);
  void SetAsideWhatIsThere();
  std::vector<uint8_t> ReadAt(int64_t offset, size_t size) const;
  struct Entry {
    bool is_note = false;
    std::vector<uint8_t> bytes;  ///< of a note: its session and its text
  };
  std::optional<Entry> ReadEntry(int64_t* offset) const;
  static std::optional<int64_t> SessionOf(const Entry& entry);
  std::optional<int64_t> SessionThere() const;
  void AppendEntry(const Entry& entry);
  bool WriteFramed(const std::vector<uint8_t>& framed);
  void DropFirstKept();

  std::string path_;
  int64_t session_ = 0;
  int fd_ = -1;
  int64_t size_ = 0;                       ///< of the whole records on the disk
  std::deque<std::vector<uint8_t>> kept_;  ///< with their lengths, not on the disk yet
  size_t kept_bytes_ = 0;
  int64_t pending_ = 0;  ///< records among them
  std::string problem_;
  int64_t lost_ = 0;
};

}  // namespace dmslam
