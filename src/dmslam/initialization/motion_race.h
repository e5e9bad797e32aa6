#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "dmslam/initialization/candidate_map.h"
#include "dmslam/initialization/reference_window.h"

namespace dmslam {

/// Maps under different motions: the one that explains the views best, and the next best.
struct MotionRace {
  std::optional<CandidateMap> best, runner_up;
  std::vector<Rigid3d> entered;  ///< as they came out, and those that were tried besides

  bool HasRun(const Rigid3d& T_last_0) const;
  void Enter(CandidateMap candidate);
};

/// Finds the camera's motion from a window's reference frame to its newest view. Holds no state but its
/// options.
class MotionSearch {
 public:
  /// The builder must outlive it.
  MotionSearch(const InitializerOptions& options, const Camera& camera, uint64_t seed,
               const CandidateBuilder& builder)
      : options_(options), camera_(camera), seed_(seed), builder_(builder) {}

  /// Every minimum of the newest pair's epipolar cost that is about as low as the lowest is carried through
  /// all views of `window`, and so is what this and older ones of `windows` found before; what the views say
  /// decides. Without a best one, `refused` says why.
  MotionRace Run(const std::deque<ReferenceWindow>& windows, const ReferenceWindow& window,
                 std::span<const uint8_t> is_static, Refused* refused) const;
  /// The best one; none where two different motions explain the views about equally well, or none does well.
  std::optional<CandidateMap> WinnerOf(const MotionRace& race, Refused* refused) const;

 private:
  InitializerOptions options_;
  Camera camera_;
  uint64_t seed_;
  const CandidateBuilder& builder_;
};

/// No other motion comes near.
bool IsAlone(const CandidateMap& candidate, const PairMotionOptions& options);

}  // namespace dmslam
