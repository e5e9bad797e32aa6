#include "dmslam/slam/sequence_end.h"

#include <algorithm>
#include <utility>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr int64_t kAskAgainNs = 10'000'000'000;

using Phase = SequenceEnd::Phase;

/// What follows a phase in which the core has work.
Phase After(Phase phase) {
  switch (phase) {
    case Phase::kGrowingBack:
      return Phase::kAwaitingAdjustedMap;
    case Phase::kAwaitingAdjustedMap:
      return Phase::kRefining;
    case Phase::kRefining:
      return Phase::kJoining;
    case Phase::kJoining:
      return Phase::kTelling;
    case Phase::kPlaying:
    case Phase::kTelling:
    case Phase::kDone:
    case Phase::kHandedOver:
      break;
  }
  DMSLAM_CHECK(false, "the end of a sequence is worked on step by step");
  return phase;
}

}  // namespace

/// The player says it until it is answered. Without a mapper the map cannot grow.
void SequenceEnd::OnEndHeard() {
  if (Is(Phase::kPlaying)) phase_ = has_mapper_ ? Phase::kGrowingBack : Phase::kAwaitingAdjustedMap;
}

/// Work on the last poses goes on where it is: only the next frontend says that the sequence is done.
void SequenceEnd::OnHandOver() {
  if (HandsOver() || Is(Phase::kDone)) return;
  last_ = Phase::kHandedOver;
  phase_ = std::max(phase_, Phase::kAwaitingAdjustedMap);
}

bool SequenceEnd::AwaitsAnswer(const Map& map) const {
  return Is(Phase::kAwaitingAdjustedMap) && has_mapper_ && !HandsOver() && !map.keyframes().empty() &&
         !(question_ && question_->is_answered);
}

/// The map grows one keyframe at a time: the mapper has time for it.
bool SequenceEnd::Waits(const FrontendCore& core) const {
  if (Is(Phase::kGrowingBack)) return core.awaited() && !core.map().keyframes().empty();
  return AwaitsAnswer(core.map());
}

std::optional<AdjustRequest> SequenceEnd::Ask(const Map& map, int64_t now_ns,
                                              std::optional<int64_t> newest_stamp_ns, int64_t epoch) {
  if (!AwaitsAnswer(map) || (question_ && now_ns - question_->asked_ns <= kAskAgainNs)) return std::nullopt;
  question_ = {.epoch = epoch, .request = question_ ? question_->request + 1 : 1, .asked_ns = now_ns};
  return AdjustRequest{question_->request, "the sequence has ended", newest_stamp_ns, camera_id_};
}

void SequenceEnd::OnAnswer(const Answer& answer) {
  if (!question_ || answer.camera != camera_id_ || answer.epoch != question_->epoch) return;
  if (answer.request == question_->request) question_->is_answered = true;
}

SequenceEnd::Worked SequenceEnd::Work(Phase phase, FrontendCore* core) {
  switch (phase) {
    case Phase::kGrowingBack: {
      core->SetWithheld(false);
      std::optional<FrontendOutput> output = core->GrowBack();
      const bool is_done = !output.has_value();
      return {std::move(output).value_or(FrontendOutput()), is_done};
    }
    case Phase::kAwaitingAdjustedMap:
      core->RefineRest();
      return {{}, true};
    case Phase::kRefining:
      if (core->IsRefining()) core->RefineNext();
      return {{}, !core->IsRefining()};
    case Phase::kJoining:
      if (core->WorkAtEnd()) return {};
      return {core->Finish(), true};
    case Phase::kPlaying:
    case Phase::kTelling:
    case Phase::kDone:
    case Phase::kHandedOver:
      break;
  }
  DMSLAM_CHECK(false, "there is work between the end of the sequence and the last poses alone");
  return {};
}

void SequenceEnd::OnWorked(bool is_done) {
  const Phase after = After(phase_);
  if (is_done) phase_ = after;
}

void SequenceEnd::OnTold() {
  DMSLAM_CHECK(Is(Phase::kTelling), "the last poses are told when they are known");
  phase_ = last_;
}

void FinishSequence(FrontendCore* core, std::optional<int64_t> newest_stamp_ns,
                    const EndListeners& listeners) {
  SequenceEnd end(true, core->camera_id());
  end.OnEndHeard();
  while (!end.Is(Phase::kTelling)) {
    if (const auto request = end.Ask(core->map(), 0, newest_stamp_ns, 0)) {
      listeners.adjust(*request);
      end.OnAnswer({request->camera_id, 0, request->request});
    }
    DMSLAM_CHECK(!end.Waits(*core), "what is told is answered at once");
    const SequenceEnd::Worked worked = SequenceEnd::Work(end.phase(), core);
    end.OnWorked(worked.is_done);
    listeners.tell(worked.output);
  }
  end.OnTold();
}

}  // namespace dmslam
