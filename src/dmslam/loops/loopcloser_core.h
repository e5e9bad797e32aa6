#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "dmslam/loops/loop_detector.h"
#include "dmslam/loops/loop_options.h"
#include "dmslam/loops/loop_verifier.h"
#include "dmslam/loops/sightings.h"
#include "dmslam/map/proposals.h"
#include "dmslam/map/replica.h"
#include "dmslam/place_recognition/map_places.h"

namespace dmslam {

struct LoopcloserCounters {
  uint64_t checked = 0;
  uint64_t candidates = 0;           ///< places named by words
  uint64_t refused_consistency = 0;  ///< of them, not named by the keyframes before
  uint64_t refused_geometry = 0;     ///< of the others
  uint64_t loops = 0;
  uint64_t global_adjustments = 0;
  std::optional<KeyframeId> last_keyframe;
  std::optional<KeyframeId> last_loop_keyframe;
};

/// Finds loops in a replica of the map and works out corrections (Mur-Artal, Montiel, Tardos, "ORB-SLAM: a
/// versatile and accurate monocular SLAM system", T-RO 2015, section VII; DM-SLAM keeps it unchanged). Knows
/// no bus, no clock and no thread.
class LoopcloserCore {
 public:
  LoopcloserCore(const LoopcloserOptions& options, const Camera& camera, const Pyramid& pyramid,
                 uint64_t seed, std::shared_ptr<const Vocabulary> vocabulary);

  /// Asked now and then during long work; true: finish early. May be empty (lock-step).
  void SetInterrupt(std::function<bool()> interrupt) { interrupt_ = std::move(interrupt); }
  /// What a check does next, for who has a clock: places are named, geometry is asked about them, and a
  /// correction is worked out.
  enum class Step : uint8_t { kNamePlaces, kVerify, kCorrect };
  /// Told of every step as it begins. May be empty.
  void SetOnStep(std::function<void(Step)> on_step) { on_step_ = std::move(on_step); }
  void ApplyMapDelta(const MapDelta& delta);
  /// The replica is void: a fresh map stream, or a snapshot, begins.
  void ForgetMap();
  /// The answer to a keyframe whose local mapping is done: a correction, or none. The first keyframe after a
  /// loop is in the map is answered with the global adjustment of what the loop has left. A loop that the
  /// mapper refused may be found again.
  LoopAnswer Check(KeyframeId keyframe);

  /// See Map; to be said before the first record.
  void KeepFeaturesIn(std::shared_ptr<FeatureStore> store) { map_.KeepFeaturesIn(std::move(store)); }
  const Map& map() const { return map_; }
  const LoopcloserCounters& counters() const { return counters_; }
  /// Whether a loop was proposed on which the mapper's word has not been heard.
  bool AwaitsMapper() const { return std::holds_alternative<Proposed>(last_loop_); }
  /// A place that words named consistently, or that an earlier keyframe proposed, and what geometry said of
  /// it.
  struct Verdict {
    KeyframeId place;
    bool confirms = false;  ///< an earlier proposal
    bool accepted = false;  ///< as a proposal, or for good when it confirms one
    std::string why;        ///< the numbers
  };
  /// Of the newest keyframe checked, in the order in which they were asked.
  const std::vector<Verdict>& verdicts() const { return verdicts_; }

 private:
  /// A loop on which the mapper's word has not been heard.
  struct Proposed {
    uint64_t correction_id;
    KeyframeId keyframe;
    std::optional<KeyframeId> loop_before;  ///< the last one that is in the map
  };
  /// A loop is in the map, and the next keyframe's answer adjusts what it has left.
  struct AdjustmentDue {
    KeyframeId keyframe;  ///< that closed it
  };
  struct Settled {};

  void Begin(Step step) const;
  void HearOfCorrection(const Proposed& loop, const MapDelta& delta);
  void OnLoopInMap(KeyframeId keyframe);
  LoopAnswer FindCorrection(const Keyframe& keyframe);
  std::vector<const Keyframe*> NamePlaces(const Keyframe& keyframe);
  std::vector<const Keyframe*> NamePlacesInOtherMaps(const Keyframe& keyframe) const;
  void ForgetUnconfirmed(int64_t now_ns);
  /// Follows what earlier keyframes proposed: a loop that enough of them have confirmed for long enough.
  std::optional<VerifiedLoop> ConfirmProposed(const Keyframe& keyframe);
  /// The first of the candidates that geometry bears out is kept as a proposal. A place of another map is a
  /// loop at once where keyframes that are there already confirm it.
  std::optional<VerifiedLoop> ProposePlace(const Keyframe& keyframe,
                                           const std::vector<const Keyframe*>& candidates);
  /// Keyframes of maps that the camera has left see places that were not there when they came.
  std::optional<VerifiedLoop> AskAgain(const Keyframe& newest);
  std::optional<VerifiedLoop> FindInOtherMaps(const Keyframe& keyframe);
  std::vector<const Keyframe*> NextToAsk(const Keyframe& newest) const;
  /// Whether what was found of another map is enough to join the two.
  bool MayJoin(const VerifiedLoop& loop) const;
  bool IsConfirmedAround(const VerifiedLoop& loop) const;
  LoopAnswer Close(const VerifiedLoop& loop);
  LoopAnswer AdjustAfterLoop(KeyframeId loop, const Keyframe& keyframe);

  LoopcloserOptions options_;
  Camera camera_;
  Pyramid pyramid_;
  std::function<bool()> interrupt_;
  std::function<void(Step)> on_step_;
  Replica map_;
  MapPlaces places_;
  LoopDetector detector_;
  LoopVerifier verifier_;
  /// A loop that waits for later keyframes to confirm it.
  struct Proposal {
    LoopClaim claim;  ///< as the last of them measured it
    int64_t first_ns = 0, last_ns = 0;
    int confirmations = 0;
  };
  std::vector<Proposal> proposals_;          ///< oldest first
  std::optional<KeyframeId> asked_again_;    ///< the last one
  Sightings sightings_;                      ///< of one map in another
  std::optional<int> keyframes_since_loop_;  ///< none: no loop was closed
  std::variant<Settled, Proposed, AdjustmentDue> last_loop_;
  std::vector<Verdict> verdicts_;
  LoopcloserCounters counters_;
};

}  // namespace dmslam
