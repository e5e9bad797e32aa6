#include "runs.h"

#include <deque>
#include <optional>
#include <utility>
#include <variant>

#include "dmslam/map/snapshot.h"
#include "dmslam/slam/sequence_end.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/codec.h"

namespace dmslam::replay {
namespace {

std::string Text(const std::vector<StampedPose>& poses) {
  std::string text;
  for (const StampedPose& pose : poses) text += FormatPose(pose) + "\n";
  return text;
}

Outcome ToOutcome(const TrajectoryBuilder::Trajectories& trajectories, const Map& map) {
  Outcome outcome;
  outcome.final = Text(trajectories.final);
  outcome.online = Text(trajectories.online);
  outcome.keyframes = map.keyframes().size();
  outcome.landmarks = map.num_landmarks();
  if (map.keyframes().empty()) return outcome;
  for (const MapDelta& part : CutSnapshot(map, map.keyframes().rbegin()->first, kSnapshotPieceBytes)) {
    const std::vector<uint8_t> bytes = wire::Encode(part);
    outcome.map.append(bytes.begin(), bytes.end());
  }
  return outcome;
}

/// As another process hears it.
template <typename Message>
Message OverTheWire(const Message& message) {
  std::string reason;
  std::optional<Message> heard = wire::Decode<Message>(wire::Encode(message), &reason);
  DMSLAM_CHECK(heard.has_value(), reason.c_str());
  return *std::move(heard);
}

/// Three processes and a reader of their streams, without the processes.
class Cores {
 public:
  explicit Cores(const Slam::Setup& setup)
      : frontend_(setup.frontend),
        mapper_(setup.mapper, setup.frontend.camera, setup.frontend.pyramid, 1,
                [this](const MapDelta& delta) { OnMapRecord(OverTheWire(delta)); }),
        loopcloser_(setup.loop, setup.frontend.camera, setup.frontend.pyramid, setup.frontend.seed,
                    setup.frontend.vocabulary),
        trajectory_(setup.frontend.camera, setup.frontend.pyramid) {}

  void OnFrame(const FrameInput& frame) {
    Tell(frontend_.ProcessFeatures(frame.index, frame.stamp_ns, frame.features));
    while (frontend_.IsBehind()) Tell(frontend_.CatchUp());
  }

  Outcome Finish() {
    const auto adjust = [this](const AdjustRequest& request) {
      mapper_.OnAdjustRequest(OverTheWire(request));
      TellFrontend(waiting_.size());
    };
    FinishSequence(&frontend_, 0, {[this](const FrontendOutput& output) { Tell(output); }, adjust});
    mapper_.End();
    return ToOutcome(trajectory_.Build(), trajectory_.map());
  }

 private:
  void OnMapRecord(const MapDelta& delta) {
    loopcloser_.ApplyMapDelta(delta);
    trajectory_.OnMapDelta(delta);
    waiting_.push_back(delta);
  }

  /// The frontend's replica changes between frames, up to a settled record.
  void TellFrontend(size_t count) {
    for (; count > 0; --count) {
      frontend_.ApplyMapDelta(waiting_.front());
      waiting_.pop_front();
    }
  }

  void Tell(const FrontendOutput& output) {
    for (const FrontendEvent& event : output.events)
      std::visit([this](const auto& record) { Hear(OverTheWire(record)); }, event);
    size_t settled = waiting_.size();
    while (settled > 0 && waiting_[settled - 1].event != MapEvent::kSettled) --settled;
    TellFrontend(settled);
  }

  void Hear(const FramePose& pose) { trajectory_.OnFramePose(pose); }
  void Hear(const FrameEvidence& evidence) { mapper_.OnEvidence(evidence); }
  void Hear(const InitialMap& proposal) {
    Settle(proposal.second.id, proposal.map_id, mapper_.OnInitialMap(proposal));
  }
  void Hear(const KeyframeProposal& proposal) {
    Settle(proposal.id, proposal.map_id, mapper_.OnKeyframe(proposal) == KeyframeOutcome::kInserted);
  }
  void Hear(const MapReset& reset) {
    trajectory_.OnMapReset(reset);
    mapper_.OnReset(reset);
  }
  void Settle(KeyframeId id, MapId map_id, bool is_new) {
    if (is_new) mapper_.OnLoopAnswer(OverTheWire(loopcloser_.Check(id)));
    mapper_.Settle(id, map_id);
  }

  FrontendCore frontend_;
  MapperCore mapper_;
  LoopcloserCore loopcloser_;
  TrajectoryBuilder trajectory_;
  std::deque<MapDelta> waiting_;  ///< what the frontend has not applied
};

}  // namespace

Outcome RunOnImages(const Slam::Setup& setup, FrameSource& frames, size_t first, size_t count,
                    Recording* recording) {
  Slam slam(setup);
  FeatureStage stage(setup.frontend.extractor, setup.frontend.options.initializer_feature_factor);
  GrayDecoder decoder;
  GrayImage image;
  for (size_t i = first; i < first + count; ++i) {
    const EncodedImage file = frames.Read(i);
    decoder.Decode(file.encoding, file.width, file.height, file.bytes, frames.Name(i), image);
    const GrayView view = {image.data.data(), image.width, image.height, image.width};
    const bool searches = slam.frontend().IsSearching();
    if (recording)
      recording->push_back({frames.FrameIndex(i), frames.StampNs(i), stage.Extract(view, searches)});
    slam.Process(frames.FrameIndex(i), frames.StampNs(i), view);
  }
  const TrajectoryBuilder::Trajectories trajectories = slam.Finish();
  return ToOutcome(trajectories, slam.map());
}

Outcome RunOnFeatures(const Slam::Setup& setup, const Recording& recording) {
  Slam slam(setup);
  for (const FrameInput& frame : recording) slam.ProcessFeatures(frame.index, frame.stamp_ns, frame.features);
  const TrajectoryBuilder::Trajectories trajectories = slam.Finish();
  return ToOutcome(trajectories, slam.map());
}

Outcome RunCores(const Slam::Setup& setup, const Recording& recording) {
  Cores cores(setup);
  for (const FrameInput& frame : recording) cores.OnFrame(frame);
  return cores.Finish();
}

}  // namespace dmslam::replay
