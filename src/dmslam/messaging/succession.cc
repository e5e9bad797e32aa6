#include "dmslam/messaging/succession.h"

#include <algorithm>
#include <utility>

namespace dmslam {
namespace {

constexpr int64_t kIdleServerNs = 10'000'000'000;  // a hand-over nobody takes ends after so long

ReplicaSearch::Options SearchOptions(const ReplicaFetch::Options& options) {
  ReplicaSearch::Options search;
  search.session = options.session;
  search.stream = options.stream;
  search.owner = options.owner;
  search.asker = options.id;
  for (const ReplicaFetch::Holder& holder : options.holders) search.roles.push_back(holder.role);
  return search;
}

void Append(std::vector<Outgoing> more, std::vector<Outgoing>* all) {
  std::move(more.begin(), more.end(), std::back_inserter(*all));
}

}  // namespace

ReplicaFetch::ReplicaFetch(Options options, int64_t now_ns)
    : options_(std::move(options)), search_(SearchOptions(options_), now_ns) {}

void ReplicaFetch::Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) {
  search_.Receive(channel, bytes, now_ns);
  if (reader_) reader_->Receive(channel, bytes, now_ns);
}

void ReplicaFetch::Advance(int64_t now_ns) {
  search_.Advance(now_ns);
  Append(search_.TakeOutgoing(), &outgoing_);
  if (state_ == State::kSearching && search_.state() == ReplicaSearch::State::kNone) state_ = State::kNone;
  if (state_ == State::kSearching && search_.state() == ReplicaSearch::State::kFound) OpenReader(now_ns);
  if (!reader_) return;
  reader_->Advance(now_ns);
  Append(reader_->TakeOutgoing(), &outgoing_);
  if (state_ != State::kReceiving) return;
  CountBegun(now_ns);
  if (std::exchange(taken_before_, taken_) != taken_) advanced_ns_ = now_ns;
  if (now_ns - advanced_ns_ < options_.stalled_ns) return;
  reader_.reset();
  search_.TryAgain(now_ns);
  state_ = State::kSearching;
}

/// The holder begins again in another term when what it hands over has grown.
void ReplicaFetch::CountBegun(int64_t now_ns) {
  if (reader_->term() == handed_over_in_) return;
  handed_over_in_ = reader_->term();
  if (begun_++ == 0) first_begun_ns_ = now_ns;
}

void ReplicaFetch::OpenReader(int64_t now_ns) {
  const auto holder =
      std::find_if(options_.holders.begin(), options_.holders.end(),
                   [&](const Holder& candidate) { return candidate.role == search_.replica().role; });
  if (holder == options_.holders.end()) {  // answered, but was not asked: not one of ours
    search_.TryAgain(now_ns);
    return;
  }
  StreamReader::Options options;
  options.session = options_.session;
  options.stream = StreamId::kHandOver;
  options.owner = holder->channel;
  options.reader = options_.owner;
  options.role = "successor";
  options.name = options_.name;
  options.id = search_.asker();
  options.schema_hash = options_.schema_hash;
  options.only_writer = search_.asker();
  options.limits = options_.limits;
  reader_ = std::make_unique<StreamReader>(options);
  handed_over_in_ = {};
  begun_ = 0;
  advanced_ns_ = now_ns;
  state_ = State::kReceiving;
}

std::optional<Record> ReplicaFetch::Take() {
  if (state_ != State::kReceiving) return std::nullopt;
  std::optional<Record> record = reader_->Take();
  if (!record) return std::nullopt;
  ++taken_;
  if (record->ends_snapshot()) {
    version_ = reader_->parent();
    reader_->AcceptTaken();
    search_.Finish();
    state_ = State::kDone;
  }
  return record;
}

std::vector<Outgoing> ReplicaFetch::TakeOutgoing() { return std::exchange(outgoing_, {}); }

int64_t ReplicaFetch::deadline_ns() const {
  int64_t deadline = search_.deadline_ns();
  if (state_ == State::kReceiving) deadline = std::min(deadline, advanced_ns_ + options_.stalled_ns);
  return reader_ ? std::min(deadline, reader_->deadline_ns()) : deadline;
}

ReplicaServer::ReplicaServer(Options options, std::function<Version()> held, SnapshotSource* snapshots)
    : options_(std::move(options)),
      held_(held),
      source_(snapshots),
      holder_(options_.holder, std::move(held)) {}

void ReplicaServer::Receive(const std::string& channel, std::span<const uint8_t> bytes, int64_t now_ns) {
  holder_.Receive(channel, bytes, now_ns);
  if (writer_) writer_->Receive(channel, bytes, now_ns);
}

void ReplicaServer::Advance(int64_t now_ns) {
  Append(holder_.TakeOutgoing(), &outgoing_);
  const bool chosen_anew = holder_.chosen_by() && holder_.chosen_by() != served_;
  if (chosen_anew) idle_since_ns_ = now_ns;
  // A replica that grew while it is handed over is begun again: parent and content must be of one version.
  // Not for ever: who took it writes the stream now, and makes the replica grow.
  if (chosen_anew || (writer_ && held_() != offered_)) Open(now_ns);
  if (!writer_) return;
  writer_->Advance(now_ns);
  Append(writer_->TakeOutgoing(), &outgoing_);
  if (writer_->num_readers() > 0) idle_since_ns_ = now_ns;
  if (now_ns - idle_since_ns_ > kIdleServerNs) writer_.reset();
}

void ReplicaServer::Open(int64_t now_ns) {
  writer_.reset();
  served_ = holder_.chosen_by();
  offered_ = held_();
  if (offered_.empty()) return;
  epoch_ = std::max(now_ns / 1000, epoch_ + 1);
  StreamWriter::Options options;
  options.session = options_.holder.session;
  options.stream = StreamId::kHandOver;
  options.owner = options_.holder.holder;
  options.name = options_.name;
  options.schema_hash = options_.schema_hash;
  options.link = options_.link;
  options.snapshot_per_burst = options.parts_per_burst;  // everybody waits for it
  writer_ = std::make_unique<StreamWriter>(options, Term{epoch_, *served_}, offered_, source_);
}

std::vector<Outgoing> ReplicaServer::TakeOutgoing() { return std::exchange(outgoing_, {}); }

int64_t ReplicaServer::deadline_ns() const {
  const bool chosen_anew = holder_.chosen_by() && holder_.chosen_by() != served_;
  if (chosen_anew || holder_.has_outgoing()) return INT64_MIN;
  return writer_ ? writer_->deadline_ns() : INT64_MAX;
}

}  // namespace dmslam
