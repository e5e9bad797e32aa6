#include "dmslam/runtime/writer_candidacy.h"

#include <utility>

namespace dmslam {
namespace {

constexpr int64_t kSettledNs = 300'000'000;

}  // namespace

WriterCandidacy::WriterCandidacy(WriterElection::Options options, bool may_be_contested,
                                 std::vector<std::string> readers, Endpoint* endpoint, int64_t now_ns)
    : owner_(options.owner),
      may_be_contested_(may_be_contested),
      readers_(std::move(readers)),
      endpoint_(endpoint),
      election_(std::move(options), now_ns) {
  endpoint_->AddElection(&election_, owner_, readers_);
  election_.Advance(now_ns);
}

std::optional<std::string> WriterCandidacy::Refusal() const {
  if (election_.state() != WriterElection::State::kRefused) return std::nullopt;
  return election_.refusal();
}

void WriterCandidacy::Open(StreamWriter::Options options, Version parent, SnapshotSource* snapshots,
                           int64_t wall_us, int64_t now_ns) {
  const Term term = election_.Win(wall_us, parent.epoch);
  endpoint_->Remove(&election_);
  writer_ = std::make_unique<StreamWriter>(std::move(options), term, parent, snapshots);
  endpoint_->AddWriter(writer_.get(), owner_, readers_);
  settled_ns_ = now_ns + (may_be_contested_ ? kSettledNs : 0);
}

std::unique_ptr<StreamWriter> WriterCandidacy::TakeSettled(int64_t now_ns) {
  if (!writer_ || now_ns < settled_ns_ || writer_->superseded_by()) return nullptr;
  return std::move(writer_);
}

}  // namespace dmslam
