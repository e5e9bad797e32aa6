#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/map/map_delta.h"
#include "dmslam/map/proposals.h"
#include "dmslam/messaging/types.h"

namespace dmslam::wire {

/// No record is larger when it is encoded: a change that would be is a group of records (Split).
inline constexpr size_t kMaxRecordBytes = size_t{1} << 20;

/// A change as records of at most `max_bytes` each when encoded, which RecordGroups makes one change of
/// again, with every list in the same order. One that fits stays as it is. A single keyframe is never cut.
std::vector<MapDelta> Split(MapDelta change, size_t max_bytes = kMaxRecordBytes);
std::vector<LoopAnswer> Split(LoopAnswer change, size_t max_bytes = kMaxRecordBytes);

/// Puts `more`, the next record of the same group, behind `all`: together they are one change.
void Append(MapDelta more, MapDelta* all);
void Append(LoopAnswer more, LoopAnswer* all);

/// Whether two records tell of the same change: all but their lists and their note is the same.
bool TellOfOneChange(const MapDelta& a, const MapDelta& b);
bool TellOfOneChange(const LoopAnswer& a, const LoopAnswer& b);

/// Makes one change of the records of a group (RecordGroup), which follow each other in their stream. A group
/// with a record missing, doubled, of another change or of another group among them is refused as a whole.
/// One whose writer is succeeded before it is whole is abandoned: the successor goes on from before it.
template <typename Message>
class RecordGroups {
 public:
  /// Takes the next record. The change that is complete with it: at once where it stands alone, none while
  /// its group is not whole, and none where the group is refused, which `fault()` then says.
  /// `by`: in whose term it was written.
  std::optional<Message> Add(Message record, const Term& by = {}) {
    fault_.clear();
    abandoned_.clear();
    if (open_ && by != by_) {
      abandoned_ = "a group of " + std::to_string(open_->group.count) + " records ended with record " +
                   std::to_string(open_->group.index + 1) + ", for its writer is gone: it is not applied";
      open_.reset();
    }
    by_ = by;
    const RecordGroup group = record.group;
    const uint32_t expected = open_ ? open_->group.index + 1 : 0;
    const bool same = !open_ || (group.id == open_->group.id && group.count == open_->group.count);
    if (!same || group.index != expected) return Refuse(group, expected);
    if (open_ && !TellOfOneChange(*open_, record)) return RefuseOther(group);
    if (open_) {
      Append(std::move(record), &*open_);
    } else {
      open_ = std::move(record);
    }
    open_->group = group;
    if (group.index + 1 < group.count) return std::nullopt;
    open_->group = {};
    return std::exchange(open_, std::nullopt);
  }
  /// Why the record added last was refused; empty: it was not.
  const std::string& fault() const { return fault_; }
  /// What became of the group that was open before the record added last; empty: nothing was lost.
  const std::string& abandoned() const { return abandoned_; }
  /// Whether a group has begun and is not whole.
  bool open() const { return open_.has_value(); }
  void Clear() { open_.reset(); }

 private:
  std::optional<Message> Refuse(const RecordGroup& group, uint32_t expected) {
    const RecordGroup wanted = open_ ? open_->group : RecordGroup{group.id, 0, group.count};
    fault_ = "record " + std::to_string(expected + 1) + " of " + std::to_string(wanted.count) + " of group " +
             std::to_string(wanted.id) + " was due, record " + std::to_string(group.index + 1) + " of " +
             std::to_string(group.count) + " of group " + std::to_string(group.id) + " came";
    open_.reset();
    return std::nullopt;
  }
  std::optional<Message> RefuseOther(const RecordGroup& group) {
    fault_ = "record " + std::to_string(group.index + 1) + " of " + std::to_string(group.count) +
             " of group " + std::to_string(group.id) + " tells of another change than those before it";
    open_.reset();
    return std::nullopt;
  }

  std::optional<Message> open_;  ///< what came of the group so far; its `group` is that of the newest record
  Term by_;                      ///< of the record added last
  std::string fault_, abandoned_;
};

}  // namespace dmslam::wire
