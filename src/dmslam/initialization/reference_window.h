#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "dmslam/initialization/candidate_map.h"

namespace dmslam {

/// A reference frame with the views after it, and frames before it that testify.
class ReferenceWindow {
 public:
  explicit ReferenceWindow(InitializerFrame reference, std::vector<InitializerFrame> past = {})
      : reference_(std::move(reference)), past_frames_(std::move(past)) {}
  // Candidates point to views, which stay where they are when the window is moved.
  ReferenceWindow(const ReferenceWindow&) = delete;
  ReferenceWindow& operator=(const ReferenceWindow&) = delete;
  ReferenceWindow(ReferenceWindow&&) = default;
  ReferenceWindow& operator=(ReferenceWindow&&) = default;

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
  std::optional<Lead> lead;
  /// The two motions that explained the views best when one was found last, the better first.
  std::vector<CandidateMap> hypotheses;
  /// A motion that was better than its rivals, and whose direction was known.
  struct Claim {
    const ReferenceView* view = nullptr;
    Rigid3d T_view_0;
  };
  std::vector<Claim> claims;  ///< in order of time
  /// The motion of the map that was found last, to the view that it was found with.
  struct Found {
    const ReferenceView* view = nullptr;
    Rigid3d T_view_0;
  };
  std::optional<Found> found;
  bool brief = false;      ///< one of those that are kept only while they are young
  bool doubtful = false;   ///< the views did not determine one motion, at some view
  bool promising = false;  ///< the pairs agreed the last time, and more views or parallax may suffice

 private:
  InitializerFrame reference_;
  std::deque<ReferenceView> views_;  ///< in order of time
  std::vector<InitializerFrame> past_frames_;
  std::deque<ReferenceView> past_;
};

}  // namespace dmslam
