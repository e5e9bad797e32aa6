#include "player/records_node.h"

#include <algorithm>
#include <map>

#include "dmslam/console/log.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/recording/map_file.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/streams.h"
#include "player/intervals.h"

namespace dmslam {

RecordsNode::RecordsNode(NodeContext context, NodeOptions options, std::shared_ptr<const LogIndex> log,
                         uint32_t session)
    : StreamNode(std::move(context), std::move(options), roles::kFrontend),
      log_(std::move(log)),
      recorded_(Camera(), Pyramid()),
      live_(Camera(), Pyramid()) {
  const RecordedSession& recorded = log_->Session(session);
  const std::optional<SessionStart> start = FindSessionStart(*log_, recorded);
  records_ = PlanReplay(recorded.Stream(StreamId::kFrontend));
  map_records_ = PlanReplay(recorded.Stream(StreamId::kMap));
  if (!start || records_.steps.empty()) {
    throw InputError(log_->path() + ": holds no records of a frontend; was the frontend recorded too?");
  }
  if (records_.missing > 0) {
    LogWarning("{}: {} records of the frontend are missing in it", log_->path(), records_.missing);
  }
  recorded_ = Replica(start->camera, start->pyramid);
  recorded_.KeepFeaturesIn(feature_store_);
  live_ = recorded_;
  if (session_ == 0) session_ = recorded.id + 1;
  CameraInfo info;
  info.session = session_;
  info.camera = start->camera;
  info.sequence = start->sequence;
  info.mode = PlaybackMode::kLockstep;
  camera_info_ = info;
}

void RecordsNode::PublishCameraInfo() {
  camera_info_->utime = context_.wall_us();
  PublishLoose(*camera_info_);
  next_info_ns_ = context_.now_ns() + InfoAgainNs(infos_said_++);
}

void RecordsNode::Begin(const CameraInfo&) {
  map_reader_ = MakeReader(StreamId::kMap);
  WantWriter({StreamId::kFrontend, ReadersOf(StreamId::kFrontend, 1), {}, nullptr});
  PublishCameraInfo();
}

/// Up to a settled record, so that what is translated does not depend on how fast the mapper was.
void RecordsNode::TakeMapRecords() {
  while (std::optional<Record> record = map_reader_->Take()) {
    if (record->begins_anew()) {
      held_.clear();
      live_.Clear();
    }
    auto delta = ReadMapRecord(*record, map_reader_.get());
    if (!delta) continue;
    held_.push_back(std::move(*delta));
    const MapEvent event = held_.back().event;
    const bool settled = event == MapEvent::kSettled || event == MapEvent::kRequestDone || finished_;
    while (settled && !held_.empty()) {
      live_.Apply(held_.front());
      if (held_.front().event == MapEvent::kSettled && held_.front().about == awaited_) awaited_.reset();
      held_.pop_front();
    }
    map_reader_->AcceptTaken();
  }
}

bool RecordsNode::WorkOnce() {
  if (context_.now_ns() >= next_info_ns_) PublishCameraInfo();
  TakeMapRecords();
  if (finished_) {
    if (!options_.HasPeer(roles::kMapper) || NobodyNeedsTheMap(live_, *map_reader_)) Stop();
    return false;
  }
  if (awaited_) return false;
  if (next_record_ == records_.steps.size()) return Finish();
  const RecordedMessage& message = *records_.steps[next_record_++].message;
  AdvanceRecordedMap(message.order);
  Enter(message);
  return true;
}

void RecordsNode::AdvanceRecordedMap(int64_t until_order) {
  for (; next_map_record_ < map_records_.steps.size(); ++next_map_record_) {
    const ReplayStep& step = map_records_.steps[next_map_record_];
    if (step.message->order > until_order) return;
    if (step.begins_anew) {
      recorded_.Clear();
      recorded_groups_.Clear();
    }
    auto delta = Read<MapDelta>(log_->Read(*step.message));
    if (delta) delta = recorded_groups_.Add(std::move(*delta), step.term);
    if (!recorded_groups_.fault().empty()) CountMalformed(channels::kMap, recorded_groups_.fault());
    if (delta) recorded_.Apply(*delta);
  }
}

void RecordsNode::Enter(const RecordedMessage& message) {
  const Bytes bytes = log_->Read(message);
  if (message.channel == channels::kSession) {
    if (auto start = Read<SessionStart>(bytes)) {
      start->session = session_;
      start->mode = PlaybackMode::kLockstep;
      start->software = kVersion;
      start->configuration_hash = options_.settings.Hash();  // who maps them may do it in another way
      start->vocabulary_checksum.reset();
      PublishRecord(*start);
    }
  } else if (message.channel == channels::kInitialMap) {
    if (const auto proposal = Read<InitialMap>(bytes)) {
      awaited_ = proposal->second.id;
      ++keyframes_;
      PublishRecord(*proposal);
    }
  } else if (message.channel == channels::kKeyframe) {
    if (auto proposal = Read<KeyframeProposal>(bytes)) {
      Translate(&*proposal);
      awaited_ = proposal->id;
      ++keyframes_;
      PublishRecord(*proposal);
    }
  } else if (message.channel == channels::kFrameEvidence) {
    if (auto evidence = Read<FrameEvidence>(bytes)) {
      Translate(&*evidence);
      if (!evidence->items.empty()) PublishRecord(*evidence);
    }
  } else if (message.channel == channels::kMapReset) {
    if (const auto reset = Read<MapReset>(bytes)) PublishRecord(*reset);
  } else if (message.channel == channels::kAdjustRequest) {
    if (const auto request = Read<AdjustRequest>(bytes)) PublishRecord(*request);
  } else if (message.channel == channels::kFramePose) {
    if (const auto pose = Read<FramePose>(bytes)) PublishRecord(*pose);
  }
}

/// The landmark that most of the recorded one's features see in the map of now; none if they see none. Where
/// both maps are the same it keeps its name, whatever became of it.
std::optional<LandmarkId> RecordsNode::Translate(LandmarkId recorded) const {
  const Landmark* landmark = recorded_.Resolve(recorded);
  const Landmark* namesake = live_.Resolve(recorded);
  if (landmark == nullptr) return namesake != nullptr ? std::nullopt : std::optional(recorded);
  std::map<LandmarkId, int> votes;
  for (const Observation& observation : landmark->observations) {
    const Keyframe* keyframe = live_.FindKeyframe(observation.keyframe);
    if (keyframe == nullptr || observation.feature >= keyframe->landmarks.size()) continue;
    if (const LandmarkId now = keyframe->landmarks[observation.feature]; now.valid()) ++votes[now];
  }
  const bool unseen = landmark->observations.empty() && namesake != nullptr && namesake->observations.empty();
  if (unseen || (namesake != nullptr && votes.contains(namesake->id))) return recorded;
  const auto most =
      std::max_element(votes.begin(), votes.end(), [](auto& a, auto& b) { return a.second < b.second; });
  return most == votes.end() ? std::nullopt : std::optional(most->first);
}

void RecordsNode::Translate(KeyframeProposal* proposal) {
  std::vector<KeyframeProposal::Match> matches;
  for (const KeyframeProposal::Match& match : proposal->matches) {
    if (const std::optional<LandmarkId> now = Translate(match.landmark)) {
      matches.push_back({match.feature, *now});
    } else {
      ++dropped_;
    }
  }
  proposal->matches = std::move(matches);
}

void RecordsNode::Translate(FrameEvidence* evidence) {
  std::map<LandmarkId, FrameEvidence::Item> items;
  for (const FrameEvidence::Item& item : evidence->items) {
    const std::optional<LandmarkId> now = Translate(item.landmark);
    if (!now) continue;
    FrameEvidence::Item& sum = items[*now];
    sum.landmark = *now;
    sum.visible = static_cast<uint16_t>(std::min(0xffff, sum.visible + item.visible));
    sum.found = static_cast<uint16_t>(std::min(0xffff, sum.found + item.found));
    sum.moved = static_cast<uint16_t>(std::min(0xffff, sum.moved + item.moved));
  }
  evidence->items.clear();
  for (const auto& [id, item] : items) evidence->items.push_back(item);
}

bool RecordsNode::Finish() {
  LogInfo("{} keyframes entered; {} of their matches are with landmarks that this map does not have",
          keyframes_, dropped_);
  writer_->Complete(context_.now_ns());
  finished_ = true;
  return true;
}

}  // namespace dmslam
