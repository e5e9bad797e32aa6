#include "dmslam/slam/slam.h"

#include <optional>
#include <utility>
#include <variant>

#include "dmslam/slam/sequence_end.h"

namespace dmslam {

Slam::Slam(const Setup& setup)
    : frontend_(setup.frontend),
      mapper_(setup.mapper, setup.frontend.camera, setup.frontend.pyramid, 1,
              [this](const MapDelta& delta) { deltas_.push_back(delta); }),
      loopcloser_(setup.loop, setup.frontend.camera, setup.frontend.pyramid, setup.frontend.seed,
                  setup.frontend.vocabulary),
      trajectory_(setup.frontend.camera, setup.frontend.pyramid) {}

FramePose Slam::Process(uint32_t frame_index, int64_t stamp_ns, const GrayView& image) {
  FramePose pose = Handle(frontend_.ProcessImage(frame_index, stamp_ns, image));
  while (frontend_.IsBehind()) Handle(frontend_.CatchUp());
  return pose;
}

FramePose Slam::ProcessFeatures(uint32_t frame_index, int64_t stamp_ns, FeatureSet features) {
  FramePose pose = Handle(frontend_.ProcessFeatures(frame_index, stamp_ns, std::move(features)));
  while (frontend_.IsBehind()) Handle(frontend_.CatchUp());
  return pose;
}

TrajectoryBuilder::Trajectories Slam::Finish() {
  const auto adjust = [this](const AdjustRequest& request) {
    mapper_.OnAdjustRequest(request);
    TellFrontend(true);
  };
  FinishSequence(&frontend_, std::nullopt,
                 {[this](const FrontendOutput& output) { Handle(output); }, adjust});
  mapper_.End();
  TellLoopcloser();
  return trajectory_.Build();
}

/// Carries the frontend's records, in their order, to the mapper and the mapper's to the others. Returns the
/// last pose among them.
FramePose Slam::Handle(const FrontendOutput& output) {
  FramePose last;
  for (const FrontendEvent& event : output.events) {
    if (const auto* pose = std::get_if<FramePose>(&event)) {
      trajectory_.OnFramePose(*pose);
      last = *pose;
    } else if (const auto* initial = std::get_if<InitialMap>(&event)) {
      const bool is_new = mapper_.OnInitialMap(*initial);
      Settle(initial->second.id, initial->map_id, is_new);
    } else if (const auto* keyframe = std::get_if<KeyframeProposal>(&event)) {
      const KeyframeOutcome outcome = mapper_.OnKeyframe(*keyframe);
      Settle(keyframe->id, keyframe->map_id, outcome == KeyframeOutcome::kInserted, WhyRefused(outcome));
    } else if (const auto* evidence = std::get_if<FrameEvidence>(&event)) {
      mapper_.OnEvidence(*evidence);
    } else if (const auto* reset = std::get_if<MapReset>(&event)) {
      trajectory_.OnMapReset(*reset);
      mapper_.OnReset(*reset);
    }
  }
  TellFrontend(false);
  return last;
}

/// A keyframe is settled when the loop closer has answered it and the answer is in the map.
void Slam::Settle(KeyframeId id, MapId map_id, bool is_new, std::string why_refused) {
  TellLoopcloser();
  if (is_new) mapper_.OnLoopAnswer(loopcloser_.Check(id));
  mapper_.Settle(id, map_id, std::move(why_refused));
}

void Slam::TellLoopcloser() {
  for (; told_ < deltas_.size(); ++told_) {
    loopcloser_.ApplyMapDelta(deltas_[told_]);
    trajectory_.OnMapDelta(deltas_[told_]);
  }
}

/// As processes do in lock-step: the map as the frontend knows it changes when a keyframe is settled, `all`:
/// now.
void Slam::TellFrontend(bool all) {
  TellLoopcloser();
  size_t count = deltas_.size();
  while (!all && count > 0 && deltas_[count - 1].event != MapEvent::kSettled) --count;
  for (size_t i = 0; i < count; ++i) frontend_.ApplyMapDelta(deltas_[i]);
  deltas_.erase(deltas_.begin(), deltas_.begin() + static_cast<std::ptrdiff_t>(count));
  told_ -= count;
}

}  // namespace dmslam
