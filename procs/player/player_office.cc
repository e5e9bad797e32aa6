#include "player/player_office.h"

#include "dmslam/console/log.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/stream_node.h"

namespace dmslam {
namespace {

constexpr char kOwner[] = "PLAYER";

WriterElection::Options ElectionOptions(const NodeContext& context, uint32_t session, bool take_over) {
  WriterElection::Options options;
  options.session = session;
  options.stream = StreamId::kPlayer;
  options.owner = kOwner;
  options.name = context.name;
  options.writer = context.random_id;
  options.schema_hash = SchemaHash();
  options.take_over = take_over;
  if (context.fresh_system) options.listen_ns = 0;
  return options;
}

}  // namespace

PlayerOffice::PlayerOffice(const NodeContext& context, uint32_t session, bool take_over, Endpoint* endpoint)
    : context_(context),
      session_(session),
      endpoint_(endpoint),
      election_(ElectionOptions(context, session, take_over), context.now_ns()) {
  endpoint_->AddElection(&election_, kOwner);
}

PlayerOffice::~PlayerOffice() {
  endpoint_->Remove(&election_);
  if (writer_) endpoint_->Remove(writer_.get());
}

void PlayerOffice::Advance() {
  endpoint_->Advance();
  if (exit_code_) return;
  if (!writer_ && election_.state() == WriterElection::State::kWon) Open();
  if (election_.state() == WriterElection::State::kRefused) {
    exit_code_ = kExitPresent;
    problem_ = "session " + std::to_string(session_) + ": " + election_.refusal();
  }
  if (!writer_) return;
  if (writer_->close_requested_by()) {
    LogInfo("player: hands session {} over to {}", session_, *writer_->close_requested_by());
    exit_code_ = kExitDone;
  }
  if (writer_->superseded_by()) {
    exit_code_ = kExitSuperseded;
    problem_ = "another player has taken over session " + std::to_string(session_) + ": " +
               *writer_->superseded_by();
  }
}

void PlayerOffice::Open() {
  StreamWriter::Options options;
  options.session = session_;
  options.stream = StreamId::kPlayer;
  options.owner = kOwner;
  options.name = context_.name;
  options.schema_hash = SchemaHash();
  const Term term = election_.Win(context_.wall_us());
  endpoint_->Remove(&election_);
  writer_ = std::make_unique<StreamWriter>(options, term, Version{});
  endpoint_->AddWriter(writer_.get(), kOwner, {});
  endpoint_->Advance();
}

}  // namespace dmslam
