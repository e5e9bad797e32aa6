#pragma once

#include <optional>
#include <string>
#include <utility>

#include "dmslam/map/map_delta.h"
#include "dmslam/map/proposals.h"

namespace dmslam::wire {

/// Puts `more`, the next record of the same group, behind `all`: together they are one change.
void Append(MapDelta more, MapDelta* all);
void Append(LoopAnswer more, LoopAnswer* all);

/// Makes one change of the records of a group (RecordGroup), which follow each other in their stream. A group
/// with a record missing, doubled, or of another group among them is refused as a whole.
template <typename Message>
class RecordGroups {
 public:
  /// Takes the next record. The change that is complete with it: at once where it stands alone, none while
  /// its group is not whole, and none where the group is refused, which `fault()` then says.
  std::optional<Message> Add(Message record) {
    fault_.clear();
    const RecordGroup group = record.group;
    const uint32_t expected = open_ ? open_->group.index + 1 : 0;
    const bool same = !open_ || (group.id == open_->group.id && group.count == open_->group.count);
    if (!same || group.index != expected) return Refuse(group, expected);
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

  std::optional<Message> open_;  ///< what came of the group so far; its `group` is that of the newest record
  std::string fault_;
};

}  // namespace dmslam::wire
