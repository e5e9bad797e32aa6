#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "dmslam/map/proposals.h"
#include "dmslam/messaging/types.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// What the frontends of several cameras ask of one map, and when each is answered: in lock-step their frames
/// take turns by stamp, then by camera; at the end the maps are adjusted when no camera adds to them any
/// more.
class CameraRequests {
 public:
  explicit CameraRequests(CameraId num_cameras) : cameras_(num_cameras) {}

  /// A frontend of a camera begins its stream: what one before it asked for is void.
  void OnBegin(CameraId camera) {
    cameras_[camera].turn.reset();
    cameras_[camera].adjust.reset();
  }
  /// The next frame of a camera waits for its turn. `epoch`: of the frontend that says so. What was answered
  /// already is not answered again.
  void OnTurn(CameraId camera, int64_t epoch, const TurnRequest& request);
  /// No frame of a camera follows: it asks for its maps to be adjusted.
  void OnAdjust(CameraId camera, uint32_t request) { cameras_[camera].adjust = request; }

  /// Whether a camera's frontend waits for an answer, which the other cameras hold back.
  bool Waits(CameraId camera) const { return cameras_[camera].turn || cameras_[camera].adjust; }

  /// Whether a camera's stream has ended.
  using HasEnded = std::function<bool(CameraId)>;
  struct Turn {
    CameraId camera = 0;
    uint32_t frame_index = 0;
  };
  /// The frame whose turn it is: known when every camera that goes on has named its own. It counts as given;
  /// `epoch_of`: in which epoch its camera's frontend writes.
  std::optional<Turn> TakeTurn(const HasEnded& has_ended, const std::function<int64_t(CameraId)>& epoch_of);
  /// The requests to adjust the maps that are not answered, when all cameras are done; empty before. Of a
  /// camera that has ended since there is none: it had its answer, and had asked again while that was on its
  /// way.
  std::vector<AdjustRequest> TakeAdjust(const HasEnded& has_ended);

 private:
  struct Camera {
    std::optional<TurnRequest> turn;  ///< its next frame, which waits
    Version given;                    ///< the request that was answered last: its epoch and frame
    std::optional<uint32_t> adjust;   ///< not answered yet
  };
  /// No frame of it follows, and nothing that changes the map.
  bool IsDone(CameraId camera, const HasEnded& has_ended) const {
    return cameras_[camera].adjust || has_ended(camera);
  }

  std::vector<Camera> cameras_;
};

}  // namespace dmslam
