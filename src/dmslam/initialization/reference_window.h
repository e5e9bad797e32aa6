#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "dmslam/initialization/candidate_map.h"

namespace dmslam {

/// A reference frame with the views after it, and frames before it that testify.
class ReferenceWindow {
 public:
  enum class Kind : uint8_t {
    kLasting,
    kBrief,  ///< one of those that are kept only while they are young
  };
  explicit ReferenceWindow(InitializerFrame reference, std::vector<InitializerFrame> past = {},
                           Kind kind = Kind::kLasting)
      : kind_(kind), reference_(std::move(reference)), past_frames_(std::move(past)) {}
  // Candidates point to views, which stay where they are when the window is moved.
  ReferenceWindow(const ReferenceWindow&) = delete;
  ReferenceWindow& operator=(const ReferenceWindow&) = delete;
  ReferenceWindow(ReferenceWindow&&) = default;
  ReferenceWindow& operator=(ReferenceWindow&&) = default;

  bool IsBrief() const { return kind_ == Kind::kBrief; }
  const InitializerFrame& reference() const { return reference_; }
  double AgeAt(const InitializerFrame& frame) const { return SecondsFromTo(reference_, frame); }
  /// Views stay where they are in memory while the window lives.
  const ReferenceView& AddView(ReferenceView view) { return views_.emplace_back(std::move(view)); }
  const std::deque<ReferenceView>& views() const { return views_; }

  /// How far the camera will have turned from the reference frame at that time, if it goes on as it does at
  /// the nearest views; before the reference frame, as just after it.
  Eigen::Quaterniond TurnAt(double since_reference_s) const;

  /// The newest view last, and as many before it as make `num_pairs`, spread evenly over those that moved;
  /// empty while there are too few, or they are nearer to each other than `min_step_s` in the mean.
  std::vector<const ReferenceView*> PairsToAgree(int num_pairs, double min_step_s) const;
  /// The views that a map is made of besides `last`: of more than there may be an even choice.
  std::vector<const ReferenceView*> ViewsBetween(const ReferenceView& last, int most) const;
  /// Frames before the reference frame as views of it; they are matched with match(frame) the first time.
  template <typename MatchFunction>
  const std::deque<ReferenceView>& Past(MatchFunction match) {
    for (const InitializerFrame& frame : past_frames_) past_.push_back(match(frame));
    past_frames_.clear();
    return past_;
  }

  /// What won the contest of motions at the newest view, since when without a break.
  struct Lead {
    int64_t since_ns = 0;
    std::vector<uint32_t> features;  ///< of the reference frame, sorted
  };
  const std::optional<Lead>& lead() const { return lead_; }
  /// A motion has won the contest at `stamp_ns` with these features of the reference frame, sorted. It goes
  /// on with the lead where `min_overlap` of the smaller of the two sets is common to both. Returns since
  /// when it leads.
  int64_t OnContestWon(int64_t stamp_ns, std::vector<uint32_t> features, double min_overlap);
  void OnContestUndecided() { lead_.reset(); }

  /// The two motions that explained the views best when one was found last, the better first.
  const std::vector<CandidateMap>& hypotheses() const { return hypotheses_; }
  void OnExplained(const CandidateMap& best, const std::optional<CandidateMap>& runner_up = std::nullopt);

  /// The motion to a view.
  struct Motion {
    const ReferenceView* view = nullptr;
    Rigid3d T_view_0;
  };
  /// Motions that were better than their rivals, and whose direction was known; in order of time.
  const std::vector<Motion>& claims() const { return claims_; }
  void OnClaimed(const Motion& motion) { claims_.push_back(motion); }

  /// Of the map that was found last, to the view that it was found with.
  const std::optional<Motion>& found() const { return found_; }
  /// Returns what was found before.
  std::optional<Motion> OnFound(const Motion& motion) { return std::exchange(found_, motion); }

  /// What the newest views came to.
  void OnTried(WaitReason wait);
  /// The views did not determine one motion, at some view.
  bool IsDoubtful() const { return doubtful_; }
  /// The pairs agreed the last time, and more views or parallax may suffice.
  bool IsPromising() const { return promising_; }

 private:
  Kind kind_;
  InitializerFrame reference_;
  std::deque<ReferenceView> views_;  ///< in order of time
  std::vector<InitializerFrame> past_frames_;
  std::deque<ReferenceView> past_;
  std::optional<Lead> lead_;
  std::vector<CandidateMap> hypotheses_;
  std::vector<Motion> claims_;
  std::optional<Motion> found_;
  bool doubtful_ = false;
  bool promising_ = false;
};

}  // namespace dmslam
