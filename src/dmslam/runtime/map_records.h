#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/map/map_delta.h"
#include "dmslam/messaging/stream_reader.h"
#include "dmslam/wire/record_groups.h"

namespace dmslam {

/// Makes changes of a map of the records of its stream, which a replica may then apply. Where a record cannot
/// be read or breaks its group, the reader is made to ask for a snapshot, so that nothing is applied to a
/// replica that lacks it, and nothing acknowledged.
class MapRecords {
 public:
  struct Outcome {
    std::optional<MapDelta> change;       ///< what is complete with the record; none while its group is not
    std::vector<std::string> complaints;  ///< what is to be counted and named
  };
  /// `record`: the one that `reader` gave last. One that tells of no later change than the one before, as
  /// nothing that a mapper writes does, is asked for again: its change is none.
  Outcome Read(const Record& record, StreamReader* reader, int64_t now_ns);
  /// Whether a saved map is being published, and more of it is to come: what is here of it is no whole map.
  bool InParts() const { return in_parts_; }

 private:
  struct Newest {
    Term term;
    uint64_t version = 0;
  };
  bool IsOld(const Record& record, const MapDelta& delta, StreamReader* reader, int64_t now_ns);

  wire::RecordGroups<MapDelta> groups_;
  Newest newest_;  ///< the change that was read last
  bool in_parts_ = false;
};

}  // namespace dmslam
