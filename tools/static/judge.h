#pragma once

#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "dmslam/initialization/initializer.h"
#include "dmslam/initialization/pair_agreement.h"
#include "dmslam/motion_segmentation/static_selector.h"
#include "judged_sequence.h"

namespace dmslam {

/// A selector with the name that the tables give it.
struct NamedSelector {
  std::string name;
  std::unique_ptr<StaticSelector> selector;
};
/// RANSAC, ARSAC (each with F and with E), DLRSAC as the paper writes it, DLRSAC; DLRSAC's own gate on the
/// distribution is off if `gated` is not set. Only those whose name contains `only`; InputError where none
/// does.
std::vector<NamedSelector> AllSelectors(bool gated, const std::string& only);
/// DLRSAC with one of its parts taken away or exchanged, each.
std::vector<NamedSelector> DlrsacAblations();

/// A window: a reference frame against frames some gaps later.
struct WindowOptions {
  std::vector<int> gaps{4, 8, 12};
  AgreementOptions agreement = InitializerOptions().agreement;  ///< the gates of the system
  MatchingOptions matching;
  double min_baseline_m = 0.05;    ///< of the last pair, for a window to count as one with parallax
  double hard_moving_share = 0.3;  ///< of the last pair's matches, for a window to count as hard
};

/// Each prints Markdown tables and returns the same numbers. What lies between frames of which one has no
/// true pose is left out of them; it is told how much that is.
nlohmann::json JudgePairs(JudgedSequence& sequence, int gap, bool window_and_orientation, int count,
                          const std::vector<NamedSelector>& selectors, std::ostream& out);
nlohmann::json JudgeWindows(JudgedSequence& sequence, const WindowOptions& options, int count,
                            const std::vector<NamedSelector>& selectors, std::ostream& out);
/// Frames given to an initialiser: from `past` on they testify, from `first` on they may be chosen.
struct FrameSpan {
  size_t past = 0, first = 0, end = 0;
};
/// A first map, and the frame that made it.
struct FoundMap {
  FirstMap map;
  size_t frame = 0;
};
/// An initialiser and what selects the static matches for it.
struct InitializerChoice {
  InitializerOptions options;
  SelectorMethod method = SelectorMethod::kDlrsac;
};
/// The first map of a span of frames; none if there is none. Counts what the other frames waited for, if
/// asked.
std::optional<FoundMap> FirstMapOf(JudgedSequence& sequence, InitializerChoice choice, const FrameSpan& span,
                                   uint64_t seed, std::map<std::string, int>* waited = nullptr);
/// Flags of map.matches: those with a point.
std::vector<uint8_t> MatchesWithPoint(const FirstMap& map);

/// Windows of the whole initialiser: it is begun at frames spread over the sequence and given `frames` of
/// them; a window is accepted where it makes a first map. Judged are the points of that map.
struct SystemWindowOptions {
  int frames = 60;                 ///< of a window
  int frames_before = 12;          ///< given to the initialiser before the window begins: they testify only
  int hard_gap = 12;               ///< a window is hard by its first frame's matches with that so much later
  double hard_moving_share = 0.3;  ///< share of these matches that moves, for a window to count as hard
  double min_baseline_m = 0.05;    ///< of these two frames, for a window to count as one with parallax
  std::string only;                ///< methods whose name contains this; empty: all
  InitializerOptions initializer;
};
/// Throws InputError where no method has a name that contains options.only.
void RequireMethods(const SystemWindowOptions& options);
nlohmann::json JudgeSystem(JudgedSequence& sequence, const SystemWindowOptions& options, int count,
                           uint64_t seed, std::ostream& out);
/// First maps of an initialiser begun at frames spread over the sequence, beside the true motion.
nlohmann::json JudgeStarts(JudgedSequence& sequence, const InitializerOptions& options, int count,
                           uint64_t seed, std::ostream& out);

/// The bundle adjustment that the initialiser is given.
AdjustFunction MakeAdjustment(const Camera& camera);

}  // namespace dmslam
