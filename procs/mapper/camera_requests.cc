#include "mapper/camera_requests.h"

#include <utility>

namespace dmslam {

void CameraRequests::OnTurn(CameraId camera, int64_t epoch, const TurnRequest& request) {
  const Version asked{epoch, request.frame_index};
  if (cameras_[camera].given != asked) cameras_[camera].turn = request;
}

std::optional<CameraRequests::Turn> CameraRequests::TakeTurn(
    const HasEnded& has_ended, const std::function<int64_t(CameraId)>& epoch_of) {
  const auto when = [this](CameraId c) -> const TurnTime& { return cameras_[c].turn->time; };
  std::optional<CameraId> next;
  for (CameraId camera = 0; camera < cameras_.size(); ++camera) {
    if (IsDone(camera, has_ended)) continue;
    if (!cameras_[camera].turn) return std::nullopt;
    if (!next || when(camera).ComesBefore(when(*next))) next = camera;
  }
  if (!next) return std::nullopt;
  const TurnRequest request = *std::exchange(cameras_[*next].turn, std::nullopt);
  cameras_[*next].given = {epoch_of(*next), request.frame_index};
  return Turn{*next, request.frame_index};
}

std::vector<AdjustRequest> CameraRequests::TakeAdjust(const HasEnded& has_ended) {
  std::vector<AdjustRequest> requests;
  for (CameraId camera = 0; camera < cameras_.size(); ++camera) {
    if (!IsDone(camera, has_ended)) return {};
    const std::optional<uint32_t>& request = cameras_[camera].adjust;
    if (request && !has_ended(camera))
      requests.push_back({*request, "the sequences have ended", std::nullopt, camera});
  }
  for (Camera& camera : cameras_) camera.adjust.reset();
  return requests;
}

}  // namespace dmslam
