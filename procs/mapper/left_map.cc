#include "mapper/left_map.h"

#include <utility>

#include "dmslam/wire/channels.h"

namespace dmslam {

LeftMap::LeftMap(Options options, Endpoint* endpoint, int64_t now_ns)
    : options_(std::move(options)), endpoint_(endpoint) {
  Begin(now_ns);
}

LeftMap::~LeftMap() { endpoint_->Remove(fetch_.get()); }

void LeftMap::Begin(int64_t now_ns) {
  fetch_ = std::make_unique<ReplicaFetch>(options_.fetch, now_ns);
  endpoint_->AddFetch(fetch_.get(), {channels::kMap});
}

LeftMap::State LeftMap::Advance(int64_t now_ns, const ReadRecord& read, const Complain& complain) {
  while (const std::optional<Record> record = fetch_->Take()) {
    if (!TakeIn(*record, read, complain)) return Refuse(now_ns);
  }
  if (fetch_->state() == ReplicaFetch::State::kNone) return State::kNone;
  if (fetch_->KeepsGrowing(now_ns)) return State::kKeepsGrowing;
  return fetch_->state() == ReplicaFetch::State::kDone ? State::kWhole : State::kFetching;
}

/// Half a map is none: all of it is asked for again.
LeftMap::State LeftMap::Refuse(int64_t now_ns) {
  if (!first_refused_ns_) first_refused_ns_ = now_ns;
  if (++refused_ > kMostRefused && now_ns - *first_refused_ns_ > kMostRefusingNs) return State::kBroken;
  endpoint_->Remove(fetch_.get());
  replica_.reset();
  Begin(now_ns);
  return State::kFetching;
}

/// False: the record is not to be used, and so nothing of the fetch.
bool LeftMap::TakeIn(const Record& record, const ReadRecord& read, const Complain& complain) {
  if (record.begins_anew()) {
    replica_.emplace(options_.camera, options_.pyramid);
    replica_->KeepFeaturesIn(options_.feature_store);
    groups_.Clear();
  }
  std::optional<MapDelta> delta = read(record);
  if (!delta) return false;
  delta = groups_.Add(std::move(*delta), record.term());
  if (!groups_.fault().empty()) {
    complain(record, groups_.fault());
    return false;
  }
  if (delta) replica_->Apply(*delta);
  return true;
}

}  // namespace dmslam
