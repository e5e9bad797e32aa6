#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>

#include "dmslam/evaluation/alignment.h"

namespace dmslam {

/// How far a pose lies from the ground truth while a run goes on, for eyes and plots: the distance after all
/// that was tracked so far is aligned (similarity, Umeyama 1991). Nothing that estimates reads it.
class OnlineError {
 public:
  /// Where the camera truly was at a frame [m].
  void OnTruth(uint32_t frame_index, const Eigen::Vector3d& p_world);
  /// Where it is believed to be [map units]. None where the truth is not known or too little was tracked to
  /// align it.
  std::optional<double> OnPose(uint32_t frame_index, const Eigen::Vector3d& p_map);
  /// Another map: its units and its origin have nothing to do with the last one's.
  void Reset();

 private:
  std::map<uint32_t, Eigen::Vector3d> truth_;  ///< of frames that were not yet tracked
  PointPairs pairs_;                           ///< tracked, and where that truly was
};

}  // namespace dmslam
