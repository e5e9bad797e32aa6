#pragma once

#include <cstddef>
#include <deque>

#include "dmslam/map/map_delta.h"
#include "dmslam/messaging/types.h"

namespace dmslam {

/// Map records that are here but not yet applied, and how far the replica has come. In lock-step they are
/// applied up to a settled record, so that which frame sees what does not depend on how fast the mapper was
/// with what nobody waits for (evidence); or up to the end of the map, which settles nothing any more. A
/// snapshot takes the place of the replica when all of it is here.
class HeldRecords {
 public:
  struct Held {
    MapDelta delta;
    Version version;
    bool begins_anew = false;  ///< the replica is void before it
    bool in_snapshot = false;
    bool ends_snapshot = false;
  };

  /// A fresh stream or a snapshot begins: what is held is void. The replica stays until the next record is
  /// applied.
  void BeginAnew();
  void Add(MapDelta delta, Version version, bool in_snapshot, bool ends_snapshot);
  bool empty() const { return held_.empty(); }
  /// How many may be applied: `all` that are whole (in real time), or those up to a settled record or the
  /// end.
  size_t NumReady(bool all) const;
  /// The first `count` will be applied.
  void Promise(size_t count) { promised_ = held_[count - 1].version; }
  const Held& operator[](size_t k) const { return held_[k]; }
  /// The first one has been applied.
  Held PopApplied();

  Version applied() const { return applied_; }    ///< of the replica
  Version promised() const { return promised_; }  ///< the same, when all that is promised is applied
  bool IsUpToDate() const { return applied_ == promised_; }

 private:
  std::deque<Held> held_;
  bool begins_anew_ = false;  ///< with the next record
  Version applied_, promised_;
};

}  // namespace dmslam
