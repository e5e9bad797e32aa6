#include "frontend/camera_turns.h"

namespace dmslam {

std::optional<TurnRequest> CameraTurns::Ask(uint32_t frame_index, const TurnTime& time, const Term& mapper) {
  if (!camera_ || !mapper.valid() || (asked_ == frame_index && asked_of_ == mapper)) return std::nullopt;
  asked_ = frame_index;
  given_.reset();
  asked_of_ = mapper;
  return TurnRequest{frame_index, time, *camera_};
}

void CameraTurns::OnTurn(KeyframeId frame) {
  if (camera_ == frame.camera() && asked_ == frame.frame_index()) given_ = asked_;
}

}  // namespace dmslam
