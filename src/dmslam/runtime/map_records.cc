#include "dmslam/runtime/map_records.h"

#include <utility>

#include "dmslam/wire/codec.h"

namespace dmslam {

MapRecords::Outcome MapRecords::Read(const Record& record, StreamReader* reader, int64_t now_ns) {
  Outcome outcome;
  if (record.begins_anew()) groups_.Clear();
  std::string fault;
  std::optional<MapDelta> delta = wire::Decode<MapDelta>(*record.bytes, &fault);
  if (delta && IsOld(record, *delta, reader, now_ns)) return outcome;
  if (delta) {
    outcome.change = groups_.Add(std::move(*delta), record.term());
    fault = groups_.fault();
    if (!groups_.abandoned().empty()) outcome.complaints.push_back(groups_.abandoned());
    if (groups_.open()) reader->KeepHeld();
  }
  if (fault.empty()) {
    if (outcome.change) in_parts_ = outcome.change->event == MapEvent::kSnapshot && !record.in_snapshot();
    return outcome;
  }
  outcome.complaints.push_back(fault + "; asks for a snapshot of the map");
  groups_.Clear();
  reader->Forget();
  return outcome;
}

/// A record that stands for a change which was there before is none of the writer's: versions count changes.
bool MapRecords::IsOld(const Record& record, const MapDelta& delta, StreamReader* reader, int64_t now_ns) {
  if (record.begins_anew() || record.term() != newest_.term) newest_ = {record.term(), 0};
  if (record.in_snapshot() || delta.event == MapEvent::kSnapshot || groups_.open()) return false;
  if (delta.version <= newest_.version && reader->Doubt(record, now_ns)) return true;
  newest_.version = delta.version;
  return false;
}

}  // namespace dmslam
