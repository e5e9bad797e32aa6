#include "player/player_office.h"

#include "dmslam/console/log.h"
#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/process_info.h"
#include "dmslam/runtime/stream_node.h"
#include "dmslam/wire/channels.h"

namespace dmslam {
namespace {

constexpr const char* kOwner = owners::kPlayer;

WriterElection::Options ElectionOptions(const NodeContext& context, const PlayerOffice::Part& part,
                                        bool take_over) {
  WriterElection::Options options;
  options.session = part.session;
  options.stream = StreamOfCamera(StreamId::kPlayer, part.camera_id);
  options.owner = OfCamera(kOwner, part.camera_id);
  options.name = context.name;
  options.writer = context.random_id;
  options.schema_hash = SchemaHash();
  options.clock_offset_us = ClockOffsetUs(context);
  options.take_over = take_over;
  if (context.fresh_system) options.listen_ns = 0;
  return options;
}

}  // namespace

PlayerOffice::PlayerOffice(const NodeContext& context, const Part& part, bool take_over, Endpoint* endpoint)
    : context_(context),
      part_(part),
      endpoint_(endpoint),
      begun_ns_(context_.now_ns()),
      election_(ElectionOptions(context, part, take_over), context.now_ns()) {
  endpoint_->AddElection(&election_, OfCamera(kOwner, part_.camera_id));
}

std::vector<std::string> PlayerOffice::AnswersTo(CameraId camera_id) {
  return {ChannelOfCamera(channels::kFrameDone, camera_id),
          ChannelOfCamera(channels::kSequenceDone, camera_id), channels::kMapperStatus,
          ChannelOfCamera(channels::kFrontendStatus, camera_id),
          ChannelOfCamera(channels::kCameraInfo, camera_id)};
}

PlayerOffice::~PlayerOffice() {
  endpoint_->Remove(&election_);
  if (writer_) endpoint_->Remove(writer_.get());
}

void PlayerOffice::HearCamera(const CameraInfo& said, const CameraInfo& ours) {
  if (frame_taken_ || exit_code_ || said.session != part_.session || IsOfSame(said, ours)) return;
  CameraInfo claim = said;
  claim.camera_id = part_.camera_id;
  if (!claims_.SaidAgain(claim, context_.now_ns())) return;
  const auto difference = FirstDifference(ours.camera, said.camera);
  exit_code_ = kExitMisfit;
  problem_ = "session " + std::to_string(part_.session) + " is that of " + said.sequence + ", and " +
             (difference ? "its camera has " + difference->b + ", not " + difference->a
                         : ours.sequence + " is another recording") +
             "; end its processes and start them anew, or give this one a session of its own (--session)";
}

void PlayerOffice::Advance() {
  endpoint_->Advance();
  if (exit_code_) return;
  if (!writer_ && election_.state() == WriterElection::State::kWon) Open();
  if (election_.state() == WriterElection::State::kRefused) {
    exit_code_ = kExitPresent;
    problem_ = "session " + std::to_string(part_.session) + ": " + election_.refusal();
  }
  if (writer_) WatchWriter();
}

/// Who asks to go on in this one's place may be nobody: then this one is to be started again.
void PlayerOffice::WatchWriter() {
  if (writer_->superseded_by()) {
    exit_code_ = hands_over_until_ns_ ? kExitDone : kExitSuperseded;
    problem_ = hands_over_until_ns_ ? ""
                                    : "another player has taken over session " +
                                          std::to_string(part_.session) + ": " + *writer_->superseded_by();
  } else if (writer_->close_requested_by() && !hands_over_until_ns_) {
    LogInfo("player: hands session {} over to {}", part_.session, *writer_->close_requested_by());
    hands_over_until_ns_ = context_.now_ns() + kGoesOnWithinNs;
    writer_->Close(context_.now_ns());
  } else if (hands_over_until_ns_ && context_.now_ns() >= *hands_over_until_ns_) {
    exit_code_ = kExitSuperseded;
    problem_ = NobodyWentOn(*writer_->close_requested_by());
  }
}

ProcessHealth PlayerOffice::Health() const {
  ProcessHealth health = MeasureProcess(context_.pid);
  health.uptime_s = static_cast<double>(context_.now_ns() - begun_ns_) * 1e-9;
  health.dropped_foreign = context_.refused();
  health.epoch = writer_ ? writer_->term().epoch : 0;
  return health;
}

void PlayerOffice::Open() {
  StreamWriter::Options options;
  options.session = part_.session;
  options.stream = StreamOfCamera(StreamId::kPlayer, part_.camera_id);
  options.owner = OfCamera(kOwner, part_.camera_id);
  options.name = context_.name;
  options.schema_hash = SchemaHash();
  options.clock_offset_us = ClockOffsetUs(context_);
  const Term term = election_.Win(context_.wall_us());
  endpoint_->Remove(&election_);
  writer_ = std::make_unique<StreamWriter>(options, term, Version{});
  endpoint_->AddWriter(writer_.get(), options.owner, {});
  endpoint_->Advance();
}

}  // namespace dmslam
