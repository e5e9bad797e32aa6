#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/ack_t.hpp"
#include "dmslam/messaging/types.h"

namespace dmslam {

/// The records of one numbering that a writer keeps for repair, and what of them waits to be sent. Used for
/// the stream itself and for its snapshot. Knows nothing of readers.
class SendWindow {
 public:
  struct Options {
    Link link = Link::kHost;
    std::string part_channel;
    int32_t part_bytes = 1200;    ///< of a record in one part
    bool pack = true;             ///< deflates what travels in parts
    int64_t resend_after_ns = 0;  ///< a part sent this recently is on its way and not sent again
  };

  SendWindow(const Options& options, int32_t stream_key) : options_(options), stream_key_(stream_key) {}

  /// Keeps a record and queues it. The next number is last() + 1.
  void Append(std::string channel, SharedBytes record);

  /// Forgets all records up to `seq`.
  void DiscardThrough(int64_t seq);

  /// Queues what a reader lacks, unless it was sent a moment ago or waits anyway.
  void Repair(const ack_t& ack, int64_t now_ns);

  /// Sends up to `budget` datagrams: repairs first, then what was never sent. Returns what is left of the
  /// budget: less than nothing after a record that travels whole.
  int Send(int budget, int64_t now_ns, std::vector<Outgoing>* out);

  bool idle() const { return repairs_.empty() && next_seq_ > last(); }
  int64_t first() const { return first_; }
  int64_t last() const { return first_ + static_cast<int64_t>(kept_.size()) - 1; }
  /// All records up to here were sent once.
  int64_t sent() const { return next_seq_ - 1; }
  size_t kept() const { return kept_.size(); }
  size_t bytes() const { return bytes_; }

  int64_t parts_sent = 0;      ///< statistics: parts of first transmissions
  int64_t parts_repaired = 0;  ///< parts sent again
  int64_t bytes_sent = 0;      ///< bytes of all messages that leave the host
  int64_t bytes_repaired = 0;  ///< of them, those of parts sent again

 private:
  struct Kept {
    std::string channel;
    SharedBytes record;
    int64_t sent_ns = INT64_MIN / 2;    // as a whole
    std::vector<int64_t> part_sent_ns;  // per part; empty until the first one is sent
    Bytes content;                      // what the parts are pieces of; empty until they are needed
    size_t plain_bytes() const { return channel.size() + 1 + record->size(); }
  };
  Kept& at(int64_t seq) { return kept_[static_cast<size_t>(seq - first_)]; }
  void Cut(Kept& kept) const;
  bool TravelsWhole(const Kept& kept) const;
  int64_t NumParts(const Kept& kept) const;
  void RepairRange(int64_t seq, int64_t first_byte, int64_t end_byte, int64_t now_ns);
  int SendNew(int budget, int64_t now_ns, std::vector<Outgoing>* out);
  void SendPart(int64_t seq, int64_t part, int64_t now_ns, std::vector<Outgoing>* out);

  Options options_;
  int32_t stream_key_;
  std::deque<Kept> kept_;
  int64_t first_ = 1;
  size_t bytes_ = 0;
  int64_t next_seq_ = 1;                           // the first record not wholly sent ...
  int64_t next_part_ = 0;                          // ... and the first of its parts not sent
  std::set<std::pair<int64_t, int64_t>> repairs_;  // (seq, part)
};

}  // namespace dmslam
