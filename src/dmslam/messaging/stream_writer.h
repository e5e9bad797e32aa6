#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/ack_t.hpp"
#include "dmslam/messaging/claims.h"
#include "dmslam/messaging/send_window.h"
#include "dmslam/messaging/state_machine.h"
#include "dmslam/messaging/types.h"

namespace dmslam {

/// Where a writer gets a snapshot of its owner's state from, for a reader that lacks more than is kept:
/// successive records of about 64 KiB at most, the most wanted first (of a map: the local map). Implemented
/// by the owner.
class SnapshotSource {
 public:
  struct Piece {
    std::string channel;
    Bytes message;
    bool last = false;
  };
  virtual ~SnapshotSource() = default;
  /// Whether a snapshot could begin now. A source that is at work says no, and is asked again.
  virtual bool Ready() { return true; }
  /// A snapshot begins. It is cut at `cut`: readers go on with the next record of the stream. Later pieces
  /// may show later states as long as applying the records from `cut + 1` on ends in the right one (absolute
  /// values do).
  virtual void BeginSnapshot(int64_t cut) = 0;
  /// The next piece. Called a few times per burst while the snapshot goes on; a snapshot has at least one.
  virtual Piece NextPiece() = 0;
};

struct WriterStatistics {
  int64_t records = 0;
  int64_t payload_bytes = 0;     ///< of the records published
  int64_t sent_bytes = 0;        ///< of all messages sent for them, beacons included, local taps not
  int64_t parts = 0;             ///< parts of first transmissions
  int64_t parts_repaired = 0;    ///< parts sent again
  int64_t repaired_bytes = 0;    ///< of them
  int64_t overrun = 0;           ///< records forgotten that a known lossless reader still lacked
  int64_t snapshots = 0;         ///< begun
  int64_t dropped_bad = 0;       ///< acknowledgements and beacons with wrong bytes
  int64_t dropped_foreign = 0;   ///< of other sessions
  int64_t dropped_doubtful = 0;  ///< that say what cannot be, or what must be said again to be believed
  int64_t refused = 0;           ///< from readers of another protocol version or schema
  size_t kept_records = 0;
  size_t kept_bytes = 0;
};

/// The sending end of a stream that loses nothing: numbers and seals records, sends each once, beacons how
/// far it is, keeps records until the lossless readers have accepted them, repairs what readers name as
/// missing, and sends a snapshot to a reader that lacks more than is kept. A pure state machine: no clock, no
/// I/O, no threads.
class StreamWriter : public StateMachine {
 public:
  /// A lossless reader, by its role in the system. Other readers never hold the writer back.
  struct Role {
    std::string name;
    bool required = false;  ///< keeps records for it even while none of its kind is known
  };
  struct Options {
    int64_t session = 1;
    StreamId stream = StreamId::kTest;
    std::string owner;        ///< names the beacon's and the parts' channels: "MAPPER"
    std::string name;         ///< for messages to people: process, host and process id
    int64_t schema_hash = 0;  ///< over all message types; readers with another one are refused
    int64_t clock_offset_us =
        0;                    ///< the wall clock minus that of `now_ns`: bounds the terms that are believed
    std::vector<Role> roles;  ///< the lossless readers
    Link link = Link::kHost;
    size_t max_records = 65536;     ///< kept at most; beyond them the oldest are forgotten
    size_t max_bytes = 64u << 20;   ///< ... and of bytes
    size_t spare_records = 64;      ///< kept though accepted, for readers that are not lossless ...
    size_t spare_bytes = 1u << 20;  ///< ... within so many bytes
    int32_t part_bytes = 1380;      ///< of a record in one datagram: with all headers below 1500
    bool pack = true;               ///< parts are pieces of the deflated record
    int parts_per_burst = 40;       ///< pace: at most so many datagrams ...
    int64_t burst_ns = 2'000'000;   ///< ... in so much time
    int snapshot_per_burst = 12;    ///< of them for a snapshot: about 8 MB/s, so that a late comer to a
                                    ///< large map does not take the machine from those who track
    int64_t resend_after_ns = 20'000'000;       ///< a part sent this recently is not repaired again
    int64_t beacon_ns = 100'000'000;            ///< between beacons
    int64_t taker_timeout_ns = 2'000'000'000;   ///< who takes a snapshot must say so that often
    int64_t reader_timeout_ns = 5'000'000'000;  ///< a reader is known so long after its last word
    int64_t close_timeout_ns = 2'000'000'000;   ///< closing waits for the readers at most so long
    int snapshot_ahead = 16;                    ///< pieces of a snapshot kept at a time
  };

  /// Writes from seq 1 of `term`, which continues `parent`; an empty parent makes the term fresh.
  StreamWriter(Options options, Term term, Version parent, SnapshotSource* snapshots = nullptr);

  /// Publishes an encoded message whose second field is a record header. Returns its seq. Ask Full() before.
  int64_t Publish(const std::string& channel, Bytes message, int64_t now_ns);
  /// As record `seq` carries it, or would.
  RecordHeader HeaderOf(int64_t seq) const;

  void Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) override;
  void Advance(int64_t now_ns) override;
  std::vector<Outgoing> TakeOutgoing() override;
  int64_t deadline_ns() const override;

  /// Ends the stream: waits a while for the known lossless readers, tells everybody, then closed() is true.
  void Close(int64_t now_ns);
  /// Nothing follows, but the writer stays: it waits for its lossless readers however long they take, then
  /// says that the stream is complete, again and again, and repairs, until Close.
  void Complete(int64_t now_ns);
  /// The lossless readers have accepted all of a stream that is complete.
  bool completed() const { return state_ == State::kClosed; }
  bool closed() const { return state_ == State::kClosed && beacons_.farewells == 0; }

  /// Set when another writer has a higher term, and has said so twice: this one is silent from then on, and
  /// its owner must stop. Names the other.
  const std::optional<std::string>& superseded_by() const { return superseded_by_; }
  /// Set when a newcomer has asked for the stream for half a second: finish what is pending, then Close.
  const std::optional<std::string>& close_requested_by() const { return close_requested_by_; }
  /// Names the last reader that was refused because of its protocol version or schema; empty when there was
  /// none.
  const std::string& refusal() const { return refusal_; }

  const Term& term() const { return term_; }
  int64_t last_seq() const { return window_.last(); }
  /// No more can be kept: publishing now would forget a record that somebody needs.
  bool Full() const;
  /// Whether at least one lossless reader, in a process of its own, has accepted the records up to `seq`.
  bool AcknowledgedByAny(int64_t seq) const;
  /// Up to where all known readers of a role have accepted; nothing while none is known.
  std::optional<int64_t> AcknowledgedBy(const std::string& role) const;
  /// How many records a role has not accepted; all that were published while none is known.
  int64_t Backlog(const std::string& role) const;
  /// How many readers are known, lossless or not.
  size_t num_readers() const { return readers_.size(); }
  /// The newest version that a reader said it holds of another term, while that lies beyond this term's
  /// parent: somebody knows more than this writer did when it began.
  const std::optional<Version>& newer_replica() const { return newer_replica_; }

  WriterStatistics statistics() const;

 private:
  enum class State { kLive, kClosing, kClosed };
  struct Reader {
    std::string role;
    bool lossless = false;
    bool following = false;  // of this term
    bool wants_snapshot = false;
    int64_t accepted = 0;
    int64_t floor = 0;  // needs nothing up to here (accepted, or covered by the snapshot it receives)
    int64_t last_heard_ns = 0;
    std::optional<int64_t> last_utime;      // of its newest word: older ones that come late are ignored
    std::optional<int64_t> doubtful_utime;  // of one that does not follow from the last: another will tell
  };
  struct Snapshot {
    int64_t number = 0;
    int64_t cut = 0;
    int64_t total = 0;  // known once the last piece is made
    SendWindow window;
    struct Taker {
      int64_t received = 0;  // up to which piece
      int64_t last_heard_ns = 0;
    };
    std::map<int64_t, Taker> takers;          // by reader
    std::optional<int64_t> cutting_since_ns;  // none: it has been cut, and a step made since
  };
  struct Beacons {
    int64_t next_ns = INT64_MIN;
    bool due = true;
    int early = 3;      // of a new term: one alone is not believed
    int farewells = 6;  // that still say goodbye: two of them are needed
  };
  /// Who sends much at once sends in bursts.
  struct Burst {
    int64_t next_ns = INT64_MIN / 2;
    int left = 0;
    int for_snapshot = 0;  // of what is left
  };

  void ReceiveAck(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns);
  void ReceiveHead(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns);
  void ReceiveTakeOver(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns);
  Reader* Meet(const ack_t& ack, int64_t now_ns);
  bool IsInTime(const ack_t& ack, int64_t now_ns, Reader* reader);
  bool IsBelieved(const Term& term, int64_t utime, int64_t now_ns);
  void ReceiveSnapshotAck(const ack_t& ack, int64_t now_ns);
  void ForgetSilentReaders(int64_t now_ns);
  void ForgetAccepted();
  void AdvanceSnapshot(int64_t now_ns);
  void BeginSnapshot(int64_t now_ns);
  void EndSnapshot();
  void ExcuseSilence(int64_t now_ns);
  void MakePieces();
  void SendPaced(int64_t now_ns);
  void Beacon(int64_t now_ns);
  void AdvanceClosing(int64_t now_ns);
  int64_t Floor(bool followers_only) const;
  bool AllAccepted() const;
  bool IsSilent() const { return superseded_by_.has_value() || closed(); }

  Options options_;
  Term term_;
  Version parent_;
  SnapshotSource* source_;
  State state_ = State::kLive;
  SendWindow window_;
  std::optional<Snapshot> snapshot_;
  int32_t snapshots_begun_ = 0;
  std::map<int64_t, Reader> readers_;          // by reader id
  std::map<std::string, int64_t> role_floor_;  // of required roles: what they last accepted
  Claims<Term> terms_;                         // higher than ours
  Insistence successors_;                      // who asks for the stream
  Claims<Version> newer_;                      // than what this term continues
  std::optional<std::string> superseded_by_, close_requested_by_;
  std::optional<Version> newer_replica_;
  std::string refusal_;
  std::vector<Outgoing> outgoing_;
  int64_t close_deadline_ns_ = INT64_MAX;
  bool lingers_ = false;     // complete, and not yet told to close
  bool hands_over_ = false;  // closes for a successor who asked
  Beacons beacons_;
  Burst burst_;
  WriterStatistics statistics_;
};

}  // namespace dmslam
