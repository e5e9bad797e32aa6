#include "dmslam/loops/loopcloser_core.h"

#include <optional>
#include <utility>

#include "dmslam/loops/loop_correction.h"

namespace dmslam {

LoopcloserCore::LoopcloserCore(const LoopcloserOptions& options, const Camera& camera, const Pyramid& pyramid,
                               uint64_t seed, std::shared_ptr<const Vocabulary> vocabulary)
    : options_(options),
      camera_(camera),
      pyramid_(pyramid),
      map_(camera, pyramid),
      places_(std::move(vocabulary)),
      detector_(options),
      verifier_(options, seed),
      keyframes_since_loop_(options.min_keyframes_between) {}

void LoopcloserCore::ApplyMapDelta(const MapDelta& delta) {
  map_.Apply(delta);
  places_.Update(map_);
  if (awaited_correction_ && delta.correction_id == awaited_correction_) HearOfCorrection(delta);
}

/// What the mapper made of the loop that was proposed.
void LoopcloserCore::HearOfCorrection(const MapDelta& delta) {
  awaited_correction_.reset();
  if (delta.event != MapEvent::kRefused) return;
  --counters_.loops;
  adjustment_due_ = false;
  keyframes_since_loop_ = options_.min_keyframes_between;
}

void LoopcloserCore::ForgetMap() {
  map_.Clear();
  places_.Clear();
  detector_.Reset();
  proposals_.clear();
  awaited_correction_.reset();
}

std::function<bool()> LoopcloserCore::Interrupt() const {
  if (!pump_) return {};
  return [pump = pump_] {
    pump();
    return false;
  };
}

LoopAnswer LoopcloserCore::Check(KeyframeId id) {
  ++counters_.checked;
  counters_.last_keyframe = id;
  verdicts_.clear();
  LoopAnswer answer;
  const Keyframe* keyframe = map_.FindKeyframe(id);
  if (options_.enabled && places_.usable() && keyframe != nullptr) {
    places_.Refresh(map_, id);
    ++keyframes_since_loop_;
    if (!awaited_correction_) answer = adjustment_due_ ? AdjustAfterLoop(id) : FindLoop(*keyframe);
  }
  answer.keyframe = id;
  answer.base_version = map_.version();
  if (keyframe != nullptr) answer.stamp_ns = keyframe->stamp_ns;
  return answer;
}

LoopAnswer LoopcloserCore::FindLoop(const Keyframe& keyframe) {
  const LoopDetector::Found found = detector_.Detect(map_, places_, keyframe);
  counters_.candidates += static_cast<uint64_t>(found.named);
  counters_.refused_consistency += static_cast<uint64_t>(found.named) - found.candidates.size();
  for (Proposal& proposal : proposals_) ++proposal.age;
  std::erase_if(proposals_, [&](const Proposal& p) { return p.age > options_.confirm_within; });
  if (keyframes_since_loop_ <= options_.min_keyframes_between) return {};
  std::optional<VerifiedLoop> loop = ConfirmProposed(keyframe);
  if (!loop) loop = ProposePlace(keyframe, found.candidates);
  return loop ? Close(*loop) : LoopAnswer();
}

std::optional<VerifiedLoop> LoopcloserCore::ConfirmProposed(const Keyframe& keyframe) {
  std::optional<VerifiedLoop> best;
  for (const Proposal& proposal : proposals_) {
    Verdict verdict;
    verdict.place = proposal.loop.place;
    verdict.confirms = true;
    std::optional<VerifiedLoop> loop = verifier_.Confirm(map_, keyframe, proposal.loop, &verdict.why);
    verdict.accepted = loop.has_value();
    verdicts_.push_back(std::move(verdict));
    if (loop && (!best || loop->share > best->share)) best = std::move(loop);
  }
  return best;
}

std::optional<VerifiedLoop> LoopcloserCore::ProposePlace(const Keyframe& keyframe,
                                                         const std::vector<KeyframeId>& candidates) {
  for (const KeyframeId candidate : candidates) {
    Verdict verdict;
    verdict.place = candidate;
    std::optional<VerifiedLoop> loop =
        verifier_.Propose(map_, places_, keyframe, *map_.FindKeyframe(candidate), &verdict.why);
    verdict.accepted = loop.has_value();
    verdicts_.push_back(std::move(verdict));
    if (!loop) {
      ++counters_.refused_geometry;
      continue;
    }
    if (verifier_.IsCertain(map_, *loop)) return loop;
    proposals_.push_back({std::move(*loop), 0});
    break;
  }
  return std::nullopt;
}

LoopAnswer LoopcloserCore::Close(const VerifiedLoop& loop) {
  LoopAnswer answer = CorrectLoop(map_, loop, verifier_, options_, Interrupt());
  if (answer.kind != LoopAnswer::Kind::kLoop) return {};
  ++counters_.loops;
  counters_.last_loop_keyframe = loop.keyframe;
  keyframes_since_loop_ = 0;
  adjustment_due_ = options_.global_adjustment;
  awaited_correction_ = answer.correction_id;
  detector_.Reset();
  proposals_.clear();
  return answer;
}

LoopAnswer LoopcloserCore::AdjustAfterLoop(KeyframeId keyframe) {
  adjustment_due_ = false;
  LoopAnswer answer = AdjustGlobally(map_, keyframe, options_, Interrupt());
  if (answer.kind == LoopAnswer::Kind::kGlobalAdjustment) ++counters_.global_adjustments;
  return answer;
}

}  // namespace dmslam
