#pragma once

#include <optional>

#include "dmslam/messaging/types.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// In lock-step a keyframe settles when the loop closer has answered it: which one waits for that, by which
/// answer it settles, and when the loop closer is asked again.
class KeyframeSettling {
 public:
  struct Keyframe {
    KeyframeId id;
    MapId map_id = 0;
    Version version;  ///< of the record that brought it
  };

  /// The keyframe settles with the answer to it. `loopcloser`: the term of the one who hears of it.
  void Await(const Keyframe& keyframe, const Term& loopcloser) { awaited_ = {keyframe, loopcloser, false}; }
  bool Awaits() const { return awaited_.has_value(); }
  /// An answer was applied; one is awaited. Returns the keyframe that settles by it; none: it was the answer
  /// to another.
  std::optional<Keyframe> OnAnswer(KeyframeId answered);
  /// Something was lost that the loop closer has said: it may have been the answer.
  void OnLost();
  /// The keyframe of which the loop closer is to be told again; it counts as told. None: there is nothing to
  /// be said. `loopcloser`: the term of the one who is there.
  std::optional<Keyframe> TakeQuestion(const Term& loopcloser);

  void OnSettled(KeyframeId id) { last_settled_ = id; }
  std::optional<KeyframeId> last_settled() const { return last_settled_; }

 private:
  struct Awaited {
    Keyframe keyframe;
    Term asked;  ///< of the loop closer; not valid: none was there
    bool ask_again = false;
  };
  std::optional<Awaited> awaited_;
  std::optional<KeyframeId> last_settled_;
};

}  // namespace dmslam
