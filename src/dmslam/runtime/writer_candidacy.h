#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/messaging/election.h"
#include "dmslam/messaging/endpoint.h"
#include "dmslam/messaging/stream_writer.h"

namespace dmslam {

/// How a process comes to write its stream: it stands for election, opens the writer when it has won, and
/// writes at once, or, where another may be taking over as well, when nobody has said so for 0.3 s. Of two
/// that take over at once the one with the higher term goes on. The other has written nothing yet, so nothing
/// is lost with it.
class WriterCandidacy {
 public:
  /// `readers`: whose acknowledgements are heard. `endpoint` outlives this, and the writer.
  WriterCandidacy(WriterElection::Options options, bool may_be_contested, std::vector<std::string> readers,
                  Endpoint* endpoint, int64_t now_ns);

  /// Whether the writer may be opened. Until it is, the election goes on: another writer that is heard
  /// meanwhile turns the victory into a refusal.
  bool IsWon() const { return election_.state() == WriterElection::State::kWon; }
  /// Why somebody else writes; none: that is not decided against this one.
  std::optional<std::string> Refusal() const;
  /// Opens the writer, which goes on from `parent`.
  void Open(StreamWriter::Options options, Version parent, SnapshotSource* snapshots, int64_t wall_us,
            int64_t now_ns);
  /// What was opened; null before, and after it was taken. It may not write yet.
  const StreamWriter* writer() const { return writer_.get(); }
  /// The writer, when it may write; null before.
  std::unique_ptr<StreamWriter> TakeSettled(int64_t now_ns);
  /// The writer at any time, as to close it; null where none was opened.
  std::unique_ptr<StreamWriter> TakeWriter() { return std::move(writer_); }
  /// When the writer may write, as far as that depends on the clock alone.
  int64_t deadline_ns() const { return writer_ ? settled_ns_ : INT64_MAX; }

 private:
  std::string owner_;
  bool may_be_contested_;
  std::vector<std::string> readers_;
  Endpoint* endpoint_;
  WriterElection election_;
  std::unique_ptr<StreamWriter> writer_;
  int64_t settled_ns_ = 0;
};

}  // namespace dmslam
