#include "dmslam/initialization/testimony.h"

#include <algorithm>
#include <cmath>

namespace dmslam {
namespace {

std::optional<Rigid3d> PoseAt(const CandidateBuilder& builder, const ReferenceWindow& window,
                              const CandidateMap& candidate, uint32_t frame) {
  if (frame == window.reference().index) return Rigid3d();
  for (const ReferenceView& view : window.views()) {
    if (view.frame.index == frame) return builder.PoseOf(view, candidate);
  }
  return std::nullopt;
}

bool SayTheSame(const Rigid3d& a, const Rigid3d& b, const TestimonyOptions& options) {
  return AngleBetween(a.rotation, b.rotation) < options.max_turn_rad &&
         a.translation.normalized().dot(b.translation.normalized()) > std::cos(options.max_direction_rad);
}

/// +1 for each comparison that agrees, -1 for each that does not; nothing where one of the motions is
/// unknown.
class Tally {
 public:
  explicit Tally(const TestimonyOptions& options) : options_(options) {}
  void Compare(const std::optional<Rigid3d>& a, const std::optional<Rigid3d>& b) {
    if (a && b) sum_ += SayTheSame(*a, *b, options_) ? 1 : -1;
  }
  int sum() const { return sum_; }

 private:
  const TestimonyOptions& options_;
  int sum_ = 0;
};

/// The candidate predicts what the window itself and younger ones claimed.
void CompareClaims(const CandidateBuilder& builder, const ReferenceWindow& other,
                   const ReferenceWindow& window, const CandidateMap& candidate,
                   const TestimonyOptions& options, Tally* tally) {
  const auto T_from_0 = PoseAt(builder, window, candidate, other.reference().index);
  if (!T_from_0) return;
  for (const ReferenceWindow::Motion& claim : other.claims()) {
    if (claim.view == &candidate.last()) continue;  // the candidate itself
    if (SecondsFromTo(claim.view->frame, candidate.last().frame) > options.memory_s) continue;
    const auto T_to_0 = PoseAt(builder, window, candidate, claim.view->frame.index);
    if (T_to_0) tally->Compare(*T_to_0 * T_from_0->Inverse(), claim.T_view_0);
  }
}

/// What an older window found last predicts the candidate.
void ComparePrediction(const CandidateBuilder& builder, const ReferenceWindow& older,
                       const ReferenceWindow& window, const CandidateMap& candidate,
                       const TestimonyOptions& options, Tally* tally) {
  if (older.claims().empty() || older.hypotheses().empty()) return;
  const CandidateMap& found = older.hypotheses().front();
  const ReferenceWindow::Motion& claim = older.claims().back();
  const bool claimed =
      claim.view == &found.last() && CandidateBuilder::SameMotion(claim.T_view_0, found.T_last_0());
  if (!claimed) return;
  if (SecondsFromTo(found.last().frame, candidate.last().frame) > options.memory_s) return;
  const uint32_t from = window.reference().index;
  const uint32_t to = std::min(candidate.last().frame.index, found.last().frame.index);
  if (from >= to) return;
  const std::optional<Rigid3d> its = MotionBetween(builder, older, found, from, to);
  // A camera that hardly moved between the two frames has no direction to compare.
  if (!its || its->translation.norm() < options.min_moved_share * found.T_last_0().translation.norm()) return;
  tally->Compare(MotionBetween(builder, window, candidate, from, to), its);
}

}  // namespace

std::optional<Rigid3d> MotionBetween(const CandidateBuilder& builder, const ReferenceWindow& window,
                                     const CandidateMap& candidate, uint32_t from, uint32_t to) {
  const std::optional<Rigid3d> T_from_0 = PoseAt(builder, window, candidate, from);
  if (!T_from_0) return std::nullopt;
  const std::optional<Rigid3d> T_to_0 = PoseAt(builder, window, candidate, to);
  if (!T_to_0) return std::nullopt;
  return *T_to_0 * T_from_0->Inverse();
}

std::vector<Rigid3d> MotionsToTry(const CandidateBuilder& builder, const std::deque<ReferenceWindow>& windows,
                                  const ReferenceWindow& window, const TestimonyOptions& options) {
  std::vector<Rigid3d> motions;
  const InitializerFrame& last = window.views().back().frame;
  const auto add = [&](const ReferenceWindow& from) {
    for (const CandidateMap& found : from.hypotheses()) {
      if (&from != &window && SecondsFromTo(found.last().frame, last) > options.share_s) continue;
      const auto motion = MotionBetween(builder, from, found, window.reference().index, last.index);
      if (motion) motions.push_back(*motion);
    }
  };
  add(window);
  for (const ReferenceWindow& older : windows) {
    if (older.reference().index >= window.reference().index) break;
    add(older);
  }
  return motions;
}

Verdict Hear(const CandidateBuilder& builder, const std::deque<ReferenceWindow>& windows,
             const ReferenceWindow& window, const CandidateMap& candidate, const TestimonyOptions& options) {
  double in_favour_s = 0, against_s = 0;
  for (const ReferenceWindow& other : windows) {
    Tally tally(options);
    if (other.reference().index >= window.reference().index) {
      CompareClaims(builder, other, window, candidate, options, &tally);
    } else {
      ComparePrediction(builder, other, window, candidate, options, &tally);
    }
    if (tally.sum() == 0) continue;
    const bool is_own = other.reference().index == window.reference().index;
    const double watched_s = other.claims().back().view->since_reference_s;
    if (tally.sum() < 0) {
      against_s += watched_s;
    } else if (!is_own) {
      in_favour_s += watched_s;
    }
  }
  const double own_s = candidate.last().since_reference_s;
  if (against_s > 0 && (in_favour_s <= 0 || against_s >= own_s + in_favour_s)) return Verdict::kContradicted;
  return in_favour_s > 0 ? Verdict::kConfirmed : Verdict::kUnheard;
}

}  // namespace dmslam
