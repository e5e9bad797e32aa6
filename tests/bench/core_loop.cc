#include "core_loop.h"

#include <chrono>
#include <optional>
#include <utility>
#include <variant>

#include "dmslam/settings/frontend_setup.h"
#include "dmslam/settings/run_options.h"
#include "dmslam/slam/sequence_end.h"

namespace dmslam::bench {

CoreLoop::CoreLoop(const Settings& settings, const Camera& camera,
                   const std::shared_ptr<const Vocabulary>& vocabulary)
    : frontend_(FrontendSetup(settings, camera, vocabulary)),
      mapper_(settings.Read<MapperOptions>(), camera, settings.Read<Pyramid>(), 1,
              [this](const MapDelta& delta) { OnDelta(delta); }),
      loopcloser_(settings.Read<LoopcloserOptions>(), camera, settings.Read<Pyramid>(),
                  settings.Read<RunOptions>().seed, vocabulary) {}

StepTimes CoreLoop::StepImage(uint32_t index, int64_t stamp_ns, const GrayView& image) {
  const Stopwatch watch;
  const FrontendOutput output = frontend_.ProcessImage(index, stamp_ns, image);
  return AfterFrame(output, watch.ms());
}

StepTimes CoreLoop::StepFeatures(uint32_t index, int64_t stamp_ns, FeatureSet features) {
  const Stopwatch watch;
  const FrontendOutput output = frontend_.ProcessFeatures(index, stamp_ns, std::move(features));
  return AfterFrame(output, watch.ms());
}

void CoreLoop::OnDelta(const MapDelta& delta) {
  if (times_ != nullptr && delta.event == MapEvent::kLandmarksCreated)
    times_->to_landmarks = keyframe_watch_.ms();
  if (times_ != nullptr && delta.event == MapEvent::kAdjusted) times_->to_adjusted = keyframe_watch_.ms();
  deltas_.push_back(delta);
}

void CoreLoop::Settle(KeyframeId id, MapId map_id, StepTimes* times) {
  TellLoopCloser();
  const Stopwatch watch;
  const LoopAnswer answer = loopcloser_.Check(id);
  times->check = watch.ms();
  mapper_.OnLoopAnswer(answer);
  mapper_.Settle(id, map_id);
}

void CoreLoop::TellLoopCloser() {
  for (; told_ < deltas_.size(); ++told_) loopcloser_.ApplyMapDelta(deltas_[told_]);
}

StepTimes CoreLoop::AfterFrame(const FrontendOutput& output, double frontend_ms) {
  StepTimes times;
  times.frontend = frontend_ms;
  for (const FrontendEvent& event : output.events) {
    if (const auto* initial = std::get_if<InitialMap>(&event)) {
      mapper_.OnInitialMap(*initial);
      Settle(initial->second.id, initial->map_id, &times);
    } else if (const auto* keyframe = std::get_if<KeyframeProposal>(&event)) {
      times.keyframe = true;
      times_ = &times;
      keyframe_watch_ = Stopwatch();
      mapper_.OnKeyframe(*keyframe);
      times.mapper = keyframe_watch_.ms();
      times_ = nullptr;
      Settle(keyframe->id, keyframe->map_id, &times);
    } else if (const auto* evidence = std::get_if<FrameEvidence>(&event)) {
      mapper_.OnEvidence(*evidence);
    } else if (const auto* reset = std::get_if<MapReset>(&event)) {
      mapper_.OnReset(*reset);
    }
  }
  const Stopwatch watch;
  TellFrontend();
  times.replica_update = watch.ms();
  return times;
}

void CoreLoop::TellFrontend() {
  for (const MapDelta& delta : deltas_) frontend_.ApplyMapDelta(delta);
  deltas_.clear();
  told_ = 0;
}

EndTimes CoreLoop::End() {
  using Clock = std::chrono::steady_clock;
  const auto since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  EndTimes times;
  const Clock::time_point start = Clock::now();
  const auto adjust = [&](const AdjustRequest& request) {
    const Clock::time_point asked = Clock::now();
    mapper_.OnAdjustRequest(request);
    times.adjustment = since(asked);
    TellFrontend();
  };
  FinishSequence(&frontend_, std::nullopt,
                 {[this](const FrontendOutput& output) { AfterFrame(output, 0); }, adjust});
  times.all = since(start);
  return times;
}

}  // namespace dmslam::bench
