#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "dmslam/messaging/types.h"
#include "dmslam/part_t.hpp"

namespace dmslam {

/// What a reader lacks: the records first..last, or of the one record first = last the bytes [first_byte,
/// end_byte) when end_byte > 0.
struct MissingRange {
  int64_t first_seq = 0;
  int64_t last_seq = 0;
  int32_t first_byte = 0;
  int32_t end_byte = 0;
};

/// Puts the records of one numbering in order, from whole messages and from parts in any order. Used for the
/// stream itself and for its snapshot.
class ReceiveWindow {
 public:
  struct Limits {
    int64_t records_ahead = 8192;     ///< how far behind the next record to hand out others are kept
    size_t bytes = 64u << 20;         ///< of all that is kept, whole or in pieces
    size_t record_bytes = 16u << 20;  ///< of one record
  };
  enum class Result { kNew, kDuplicate, kNoRoom, kIncomplete };

  explicit ReceiveWindow(const Limits& limits) : limits_(limits) {}

  /// Starts over: the next record to hand out is `next`.
  void Reset(int64_t next);

  /// The writer has sent all records up to `seq`: what of them is not here is missing.
  void Expose(int64_t seq);

  /// There are no records behind `seq`: what is here of such is none, and is thrown away.
  void Retract(int64_t seq);

  /// Gives up what is missing of the records before `first`; returns how many that are.
  int64_t GiveUpBefore(int64_t first);

  /// Adds a whole record, already found intact.
  Result Add(Record record);

  /// Adds a piece. When it completes a record, its channel and bytes are returned for inspection; call Add
  /// with the record if it is intact, and nothing otherwise: then it counts as missing.
  struct PartResult {
    Result result = Result::kIncomplete;
    std::optional<std::pair<std::string, Bytes>> whole;
  };
  PartResult AddPart(const part_t& part);

  /// The next record in order, if it is here.
  std::optional<Record> Take();
  /// The one that was handed out last counts as missing again.
  void PutBack();
  /// Whether Take would give one.
  bool CanTake() const { return !whole_.empty() && whole_.begin()->first == next_; }

  /// What is missing, oldest first, at most `limit` ranges.
  std::vector<MissingRange> Missing(size_t limit) const;
  bool AnyMissing() const { return !Missing(1).empty(); }

  /// The number of the next record to hand out.
  int64_t next() const { return next_; }
  /// All records up to here have arrived.
  int64_t received() const { return received_; }
  /// The oldest record that is here and was not handed out; none: there is none.
  std::optional<int64_t> oldest() const {
    return whole_.empty() ? std::nullopt : std::optional(whole_.begin()->first);
  }
  /// The newest record known to exist.
  int64_t newest() const { return newest_; }
  size_t bytes() const { return bytes_; }

 private:
  // A record in pieces: disjoint, sorted [begin, end) that are here.
  struct Pieces {
    Bytes data;
    std::map<int32_t, int32_t> have;
  };
  bool IsKnown(int64_t seq) const { return seq < next_ || whole_.contains(seq); }
  bool HasRoomFor(int64_t seq, size_t more_bytes) const;
  void Discard(int64_t seq);
  static void Join(int32_t begin, int32_t end, std::map<int32_t, int32_t>* have);
  void AppendGaps(int64_t seq, const Pieces& pieces, size_t limit, std::vector<MissingRange>* missing) const;

  Limits limits_;
  void SkipGivenUp();

  int64_t next_ = 1;
  int64_t given_up_before_ = 0;
  int64_t received_ = 0;
  int64_t newest_ = 0;
  int64_t sent_ = 0;  // all up to here were sent: even their last bytes count as missing
  size_t bytes_ = 0;
  std::map<int64_t, Record> whole_;
  std::map<int64_t, Pieces> pieces_;
};

}  // namespace dmslam
