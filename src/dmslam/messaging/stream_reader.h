#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/head_t.hpp"
#include "dmslam/messaging/claims.h"
#include "dmslam/messaging/held_versions.h"
#include "dmslam/messaging/receive_window.h"
#include "dmslam/messaging/state_machine.h"
#include "dmslam/messaging/types.h"

namespace dmslam {

struct ReaderStatistics {
  int64_t records = 0;        ///< handed out
  int64_t payload_bytes = 0;  ///< of them
  int64_t parts = 0;          ///< that arrived
  int64_t duplicates = 0;     ///< records and parts that were here already
  int64_t requested = 0;      ///< ranges of bytes or records named as missing
  int64_t repaired = 0;       ///< records that came late or in pieces, after they had been named as missing
  int64_t lost = 0;  ///< records given up: no longer kept, and the writer offers no snapshot; those that
                     ///< were gone before a reader that held nothing came are counted where it wants all
  int64_t lost_with_writer =
      0;                        ///< of them: those of a writer that is gone and has no successor who has them
  int64_t snapshots = 0;        ///< received whole
  int64_t dropped_bad = 0;      ///< messages with wrong bytes
  int64_t dropped_foreign = 0;  ///< of other sessions
  int64_t dropped_doubtful = 0;  ///< that say what cannot be, or what must be said again to be believed
  int64_t dropped_no_room = 0;   ///< beyond what is kept ahead; they come again
  double recovery_p50_ms =
      0;  ///< from a record's being named as missing to its being here, of the newest ones
  double recovery_p99_ms = 0;
  int64_t backlog = 0;    ///< records known to exist and not yet taken
  size_t kept_bytes = 0;  ///< waiting to be taken, whole or in pieces
};

/// The receiving end of a stream: hands out its records once each, strictly in order, whatever is lost,
/// doubled or late on the way; follows the writer with the highest term; takes a snapshot when it lacks more
/// than the writer keeps. What would end or change much (a higher term, the end, a leap of the numbers,
/// records given up) is believed when the writer's next beacon says so too: one forged message does no harm.
/// A pure state machine: no clock, no I/O, no threads.
class StreamReader : public StateMachine {
 public:
  struct Options {
    int64_t session = 1;
    StreamId stream = StreamId::kTest;
    std::string owner;        ///< of the stream: names its channels, "MAPPER"
    std::string reader;       ///< this process: names the channel of its acknowledgements, "FRONTEND"
    std::string role;         ///< as the writer's configuration names it
    std::string name;         ///< for messages to people: process, host and process id
    int64_t id = 0;           ///< random, not zero
    int64_t schema_hash = 0;  ///< over all message types; writers with another one are refused
    int64_t clock_offset_us =
        0;  ///< the wall clock minus that of `now_ns`: bounds the terms that are believed
    /// What the owner holds already; none: that will turn out, and what it has not received of a writer that
    /// is gone may be what it holds.
    std::optional<Version> start = Version();
    /// What was written before this reader came, and does not come any more, counts as lost: it is the first
    /// of its owners, and begins with nothing.
    bool wants_all = false;
    int64_t only_writer = 0;  ///< follows terms of this writer id alone (a hand-over); 0: of any
    ReceiveWindow::Limits limits;
    int64_t ack_ns = 30'000'000;          ///< between acknowledgements while something is new or missing
    int64_t idle_ack_ns = 1'000'000'000;  ///< ... and otherwise
    int64_t writer_timeout_ns = 1'000'000'000;  ///< a writer is there so long after its last word
  };
  enum class State {
    kNoWriter,        ///< none heard yet
    kFollowing,       ///< records come in order
    kSnapshot,        ///< lacks more than is kept: asks for a snapshot, or receives it
    kRefusedVersion,  ///< the writer speaks another protocol or other types: see problem()
    kRefusedBehind,   ///< the writer knows less than is held here: see problem(); Forget() gives in
  };

  explicit StreamReader(Options options);

  void Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) override;

  /// The next record in order. The owner applies it now. When `begins_anew()` it forgets what it held before.
  std::optional<Record> Take();

  /// The record taken last is a part of what the owner will apply as one: until the rest is here, what is
  /// held stays as it was before.
  void KeepHeld() { versions_.KeepHeld(); }

  /// The record taken last says what would end its owner or cost it much, and may be forged: true, and it is
  /// as if it had not been taken, and asked for again. False: it is believed, for it has come again as it
  /// was, too late for a copy on its way through a network; or nobody is left who could say it again.
  bool Doubt(const Record& record, int64_t now_ns);

  /// The owner has all records up to this version safe: this is what the writer hears. Versions of earlier
  /// terms and those that were not yet taken are ignored.
  void Accept(const Version& version);
  /// Accepts all that was taken.
  void AcceptTaken() { Accept(held()); }

  /// Gives up what is held, so that a snapshot of the present writer is taken.
  void Forget();

  /// Another reader of the stream has had it up to `version`: what of that is not here when its writer is
  /// gone is lost, even where no beacon told of it. Terms that were over before this reader came do not
  /// count, unless it wants all.
  void NoteWritten(const Version& version);

  void Advance(int64_t now_ns) override;
  std::vector<Outgoing> TakeOutgoing() override;
  int64_t deadline_ns() const override;

  State state() const { return state_; }
  /// The writer's beacon was heard lately.
  bool writer_present(int64_t now_ns) const {
    return now_ns - beacons_.last_ns <= options_.writer_timeout_ns;
  }
  /// For how long no writer was heard.
  int64_t silent_ns(int64_t now_ns) const { return now_ns - beacons_.last_ns; }
  /// The writer said that its stream is complete, and all of it was taken.
  bool AtEnd() const;
  /// The writer said that nothing follows, and all of it was taken: its stream is complete as soon as all
  /// readers have accepted it.
  bool AllTaken() const;
  /// What keeps this reader from following; empty when nothing does. Names the writer and the cure.
  const std::string& problem() const { return problem_; }
  /// All records up to here were taken (KeepHeld: and are whole); empty inside a snapshot.
  const Version& held() const { return versions_.held(); }
  const Version& accepted() const { return versions_.accepted(); }
  const Term& term() const { return term_; }
  /// What the term that is followed continues; empty when it is fresh.
  const Version& parent() const { return parent_; }

  /// Records known to exist and not yet taken.
  int64_t backlog() const;
  ReaderStatistics statistics() const;

 private:
  struct Snapshot {
    int64_t number = 0;  // 0: asked for, not yet begun
    int64_t cut = 0;
    int64_t last = 0;  // its last piece, once known
    ReceiveWindow window;
    bool complete() const { return last > 0 && window.received() >= last; }
  };
  /// How far a term is known to have been written.
  struct Written {
    int64_t known = 0;
    int64_t settled = 0;  // how far its records have been handed out or counted as lost
  };
  /// What the writer's beacons say, the newest ones last.
  struct Beacons {
    int64_t last_ns = INT64_MIN / 2;  // when the last one was heard
    int64_t last_utime = INT64_MIN;   // ... and when it was said
    int64_t last_seq = 0;             // of the last one
    bool gap_seen = false;            // it said that records are gone that are not here
    int closed = 0;                   // how many said that the stream is closed
    int complete = 0;                 // ... that nothing follows
    int below = 0;                    // ... knew less records than are known here
    int64_t below_of = 0;             // ... than these
  };
  /// What was said to the writer.
  struct Acknowledged {
    int64_t last_ns = INT64_MIN / 2;
    int64_t accepted = -1, received = -1;
    bool due = false;  // what is new must be said at once
  };
  struct Recovery {
    std::map<int64_t, int64_t> missing_since_ns;  // by seq: when it was first named as missing
    std::deque<double> took_ms;                   // the newest of those that were
  };

  void ReceiveHead(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns);
  void ReceivePart(std::span<const uint8_t> bytes, int64_t now_ns);
  void ReceiveRecord(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns);
  void Add(ReceiveWindow* window, const std::string& channel, Bytes bytes, const RecordHeader& header,
           int64_t now_ns);
  bool LeapsAhead(const ReceiveWindow& window, int64_t seq);
  void NoteMissing(const std::vector<MissingRange>& missing, int64_t now_ns);
  void NoteArrival(int64_t seq, int64_t now_ns);
  ReceiveWindow* WindowOf(const RecordHeader& header);
  bool IsWanted(const head_t& head, int64_t now_ns);
  bool LeapsTooFar(const Term& term, int64_t now_ns) const;
  bool IsOnlyOneLeft(const Term& term, int64_t now_ns);
  bool IsPlausible(const head_t& head, int64_t now_ns);
  void NoteEnd(const head_t& head);
  void RetractWhatIsNot();
  bool SpeaksOurLanguage(const head_t& head);
  void BeginTerm(const head_t& head);
  Version DrainFormerTerm(const Version& parent, bool fresh);
  int64_t GiveUpAll(int64_t newest);
  void DrainBeyondGaps();
  void Settle(const Version& version);
  void CountLostOfFormerTerms();
  void Follow(const head_t& head);
  void FollowSnapshot(const head_t& head);
  void NeedSnapshot();
  std::optional<Record> TakeFromSnapshot();
  void SendAck(bool of_snapshot, int64_t now_ns);
  bool AckIsUrgent() const;
  int32_t KeyOf(int64_t snapshot) const;

  Options options_;
  State state_ = State::kNoWriter;
  Term term_;
  Version parent_;
  HeldVersions versions_;
  struct {
    SharedBytes record;
    int64_t since_ns = 0;
  } doubt_;  // the record doubted last
  ReceiveWindow window_;
  std::deque<Record> former_;           // of former terms, in order, not yet taken
  std::map<int64_t, Written> written_;  // by epoch: terms that are over, and those that others have told of
  int64_t first_epoch_ = 0;             // of what this reader has held or followed; 0: nothing yet
  std::optional<Snapshot> snapshot_;
  Recovery recovery_;
  bool writer_closed_ = false;
  Term only_one_;  // of an earlier term than was held at the start, and heard before anybody else
  int64_t only_one_since_ns_ = 0;
  Claims<Term> terms_;  // that are not followed, yet
  Claims<Term> leaps_;  // of the beacons of the term that is followed
  Beacons beacons_;
  Acknowledged acknowledged_;
  bool joined_ = false;  // has followed a writer
  std::string problem_;
  std::vector<Outgoing> outgoing_;
  ReaderStatistics statistics_;
};

}  // namespace dmslam
