#include "dmslam/loops/loopcloser_core.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "dmslam/loops/loop_correction.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr int kMostWitnesses = 15;  // keyframes around one that are asked whether they see what it sees

}  // namespace

LoopcloserCore::LoopcloserCore(const LoopcloserOptions& options, const Camera& camera, const Pyramid& pyramid,
                               uint64_t seed, std::shared_ptr<const Vocabulary> vocabulary)
    : options_(options),
      camera_(camera),
      pyramid_(pyramid),
      map_(camera, pyramid),
      places_(std::move(vocabulary)),
      detector_(options),
      verifier_(options, seed) {}

void LoopcloserCore::ApplyMapDelta(const MapDelta& delta) {
  map_.Apply(delta);
  places_.Update(map_);
  const Proposed* proposed = std::get_if<Proposed>(&last_loop_);
  if (proposed != nullptr && delta.correction_id == proposed->correction_id)
    HearOfCorrection(Proposed(*proposed), delta);
}

/// What the mapper made of the loop that was proposed.
void LoopcloserCore::HearOfCorrection(const Proposed& loop, const MapDelta& delta) {
  if (delta.event != MapEvent::kCorrectionRefused) return OnLoopInMap(loop.keyframe);
  --counters_.loops;
  counters_.last_loop_keyframe = loop.loop_before;
  keyframes_since_loop_.reset();
  last_loop_ = Settled();
}

void LoopcloserCore::OnLoopInMap(KeyframeId keyframe) {
  last_loop_ = Settled();
  if (options_.correction.global_adjustment) last_loop_ = AdjustmentDue{keyframe};
}

void LoopcloserCore::Begin(Step step) const {
  if (on_step_) on_step_(step);
}

void LoopcloserCore::ForgetMap() {
  map_.Clear();
  places_.Clear();
  detector_.Reset();
  proposals_.clear();
  asked_again_.reset();
  sightings_.Clear();
  // Its loop may be in the snapshot, and what it has left to be adjusted.
  if (const Proposed* proposed = std::get_if<Proposed>(&last_loop_)) OnLoopInMap(proposed->keyframe);
}

LoopAnswer LoopcloserCore::Check(KeyframeId id) {
  ++counters_.checked;
  counters_.last_keyframe = id;
  verdicts_.clear();
  LoopAnswer answer;
  if (const Keyframe* keyframe = map_.FindKeyframe(id)) {
    answer = FindCorrection(*keyframe);
    answer.stamp_ns = keyframe->stamp_ns;
  }
  answer.keyframe = id;
  answer.base_version = map_.version();
  return answer;
}

/// What a keyframe goes through; from now on it is in the index of places. An answer without a correction: it
/// is all right as it is.
LoopAnswer LoopcloserCore::FindCorrection(const Keyframe& keyframe) {
  if (!options_.enabled || !places_.usable()) return {};
  places_.Refresh(map_, keyframe.id);
  if (keyframes_since_loop_) ++*keyframes_since_loop_;
  if (AwaitsMapper()) return {};
  if (const AdjustmentDue* due = std::get_if<AdjustmentDue>(&last_loop_))
    return AdjustAfterLoop(due->keyframe, keyframe);
  std::vector<const Keyframe*> candidates = NamePlaces(keyframe);
  ForgetUnconfirmed(keyframe.stamp_ns);
  // The same place is seen for a while after a loop, and would be one again; another map is another matter.
  if (keyframes_since_loop_ && *keyframes_since_loop_ <= options_.min_keyframes_between)
    std::erase_if(candidates, [&](const Keyframe* place) { return place->map_id == keyframe.map_id; });
  if (const std::optional<VerifiedLoop> loop = ConfirmProposed(keyframe)) return Close(*loop);
  if (const std::optional<VerifiedLoop> loop = ProposePlace(keyframe, candidates)) return Close(*loop);
  if (const std::optional<VerifiedLoop> loop = AskAgain(keyframe)) return Close(*loop);
  return {};
}

/// Places that words name, for this keyframe and for those before it.
std::vector<const Keyframe*> LoopcloserCore::NamePlaces(const Keyframe& keyframe) {
  Begin(Step::kNamePlaces);
  LoopDetector::Found found;
  if (options_.within_maps) found = detector_.Detect(map_, places_, keyframe);
  counters_.candidates += static_cast<uint64_t>(found.named);
  counters_.refused_consistency += static_cast<uint64_t>(found.named) - found.candidates.size();
  std::vector<const Keyframe*> places = detector_.DetectInOtherMaps(map_, places_, keyframe);
  std::erase_if(places, [&](const Keyframe* place) {
    return std::ranges::find(found.candidates, place) != found.candidates.end();
  });
  counters_.candidates += places.size();
  places.insert(places.begin(), found.candidates.begin(), found.candidates.end());
  Begin(Step::kVerify);
  return places;
}

std::vector<const Keyframe*> LoopcloserCore::NamePlacesInOtherMaps(const Keyframe& keyframe) const {
  Begin(Step::kNamePlaces);
  std::vector<const Keyframe*> places = detector_.DetectInOtherMaps(map_, places_, keyframe);
  Begin(Step::kVerify);
  return places;
}

/// Proposals that nothing has confirmed for long.
void LoopcloserCore::ForgetUnconfirmed(int64_t now_ns) {
  std::erase_if(proposals_, [&](const Proposal& proposal) {
    return SecondsApart(now_ns, proposal.last_ns) > options_.confirmation.within_s;
  });
}

std::optional<VerifiedLoop> LoopcloserCore::ConfirmProposed(const Keyframe& keyframe) {
  std::optional<VerifiedLoop> best;
  for (Proposal& proposal : proposals_) {
    if (proposal.claim.keyframe.camera() != keyframe.id.camera())
      continue;  // it sees another part of the world
    Verdict verdict;
    verdict.place = proposal.claim.place;
    verdict.confirms = true;
    std::optional<VerifiedLoop> loop = verifier_.Confirm(map_, keyframe, proposal.claim, &verdict.why);
    verdict.accepted = loop.has_value();
    verdicts_.push_back(std::move(verdict));
    if (!loop) continue;
    proposal.claim = loop->Claim();
    proposal.last_ns = keyframe.stamp_ns;
    const bool enough = ++proposal.confirmations >= options_.confirmation.times &&
                        SecondsApart(keyframe.stamp_ns, proposal.first_ns) >= options_.confirmation.for_s;
    if (enough && (!best || loop->share > best->share)) best = std::move(loop);
  }
  return best;
}

/// The neighbours of the keyframe saw the place as later ones would: as many, over as long a time.
bool LoopcloserCore::IsConfirmedAround(const VerifiedLoop& loop) const {
  int confirmations = 0;
  double longest_s = 0;
  for (const Keyframe* other :
       map_.BestCovisible(*loop.keyframe, kMostWitnesses, options_.min_covisibility)) {
    std::string why;
    if (!verifier_.Confirm(map_, *other, loop.Claim(), &why)) continue;
    ++confirmations;
    longest_s = std::max(longest_s, SecondsApart(other->stamp_ns, loop.keyframe->stamp_ns));
  }
  return confirmations >= options_.confirmation.times && longest_s >= options_.confirmation.for_s;
}

std::optional<VerifiedLoop> LoopcloserCore::ProposePlace(const Keyframe& keyframe,
                                                         const std::vector<const Keyframe*>& candidates) {
  for (const Keyframe* place : candidates) {
    Verdict verdict;
    verdict.place = place->id;
    std::optional<VerifiedLoop> loop = verifier_.Propose(map_, places_, keyframe, *place, &verdict.why);
    verdict.accepted = loop.has_value();
    verdicts_.push_back(std::move(verdict));
    if (loop) {
      if (loop->joins) sightings_.Add(loop->Claim());
      if (MayJoin(*loop)) return loop;
      proposals_.push_back({loop->Claim(), keyframe.stamp_ns, keyframe.stamp_ns, 0});
      return std::nullopt;
    }
    ++counters_.refused_geometry;
  }
  return std::nullopt;
}

bool LoopcloserCore::MayJoin(const VerifiedLoop& loop) const {
  if (!loop.joins || !verifier_.HoldsAmongOthers(loop)) return false;
  return (verifier_.HoldsBetweenMaps(loop) && IsConfirmedAround(loop)) ||
         sightings_.BearOut(map_, loop, options_.joining);
}

/// In turn, by their ids.
std::vector<const Keyframe*> LoopcloserCore::NextToAsk(const Keyframe& newest) const {
  if (!map_.HasAnotherMap(newest.map_id)) return {};
  std::vector<const Keyframe*> of_others;
  for (const auto& [id, keyframe] : map_.keyframes()) {
    if (keyframe.map_id != newest.map_id) of_others.push_back(&keyframe);
  }
  const auto next = asked_again_ ? std::ranges::upper_bound(of_others, *asked_again_, {}, &Keyframe::id)
                                 : of_others.begin();
  std::rotate(of_others.begin(), next, of_others.end());
  of_others.resize(std::min(of_others.size(), static_cast<size_t>(std::max(0, options_.asked_again))));
  return of_others;
}

std::optional<VerifiedLoop> LoopcloserCore::AskAgain(const Keyframe& newest) {
  for (const Keyframe* keyframe : NextToAsk(newest)) {
    asked_again_ = keyframe->id;
    if (std::optional<VerifiedLoop> loop = FindInOtherMaps(*keyframe)) return loop;
  }
  return std::nullopt;
}

std::optional<VerifiedLoop> LoopcloserCore::FindInOtherMaps(const Keyframe& keyframe) {
  for (const Keyframe* place : NamePlacesInOtherMaps(keyframe)) {
    Verdict verdict;
    verdict.place = place->id;
    std::optional<VerifiedLoop> loop = verifier_.Propose(map_, places_, keyframe, *place, &verdict.why);
    if (loop) sightings_.Add(loop->Claim());
    verdict.accepted = loop && MayJoin(*loop);
    verdicts_.push_back(verdict);
    if (verdict.accepted) return loop;
  }
  return std::nullopt;
}

LoopAnswer LoopcloserCore::Close(const VerifiedLoop& loop) {
  Begin(Step::kCorrect);
  LoopAnswer answer = CorrectLoop(map_, loop, verifier_, options_, interrupt_);
  if (answer.kind != LoopAnswer::Kind::kLoop) return {};
  last_loop_ = Proposed{answer.correction_id.value(), loop.keyframe->id, counters_.last_loop_keyframe};
  ++counters_.loops;
  counters_.last_loop_keyframe = loop.keyframe->id;
  keyframes_since_loop_ = 0;
  detector_.Reset();
  proposals_.clear();
  return answer;
}

/// The map in which the loop was closed. The keyframe that is asked about may be in another one.
LoopAnswer LoopcloserCore::AdjustAfterLoop(KeyframeId loop, const Keyframe& keyframe) {
  Begin(Step::kCorrect);
  last_loop_ = Settled();
  const Keyframe* closed = map_.Resolve(loop);
  if (closed == nullptr) return {};
  LoopAnswer answer =
      AdjustGlobally(map_, closed->map_id, keyframe.id.value, options_.correction, interrupt_);
  if (answer.kind == LoopAnswer::Kind::kGlobalAdjustment) ++counters_.global_adjustments;
  return answer;
}

}  // namespace dmslam
