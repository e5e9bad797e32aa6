#include "mapper/keyframe_settling.h"

#include <utility>

namespace dmslam {

std::optional<KeyframeSettling::Keyframe> KeyframeSettling::OnAnswer(KeyframeId answered) {
  if (answered == awaited_->keyframe.id) return std::exchange(awaited_, std::nullopt)->keyframe;
  // An answer to an earlier one cannot be due: a loop closer has just come, and answers what is newest.
  awaited_->ask_again = true;
  return std::nullopt;
}

void KeyframeSettling::OnLost() {
  if (awaited_) awaited_->ask_again = true;
}

std::optional<KeyframeSettling::Keyframe> KeyframeSettling::TakeQuestion(const Term& loopcloser) {
  if (!awaited_) return std::nullopt;
  // The first one to come hears of it with the map. Another one than was asked does not know what is due.
  const bool is_another = awaited_->asked.valid() && loopcloser != awaited_->asked;
  awaited_->asked = loopcloser;
  if (!std::exchange(awaited_->ask_again, false) && !is_another) return std::nullopt;
  return awaited_->keyframe;
}

}  // namespace dmslam
