#include "dmslam/tracking/pose_jitter.h"

#include <algorithm>
#include <cmath>

namespace dmslam {

void PoseJitter::OnPose(int64_t stamp_ns, MapId map, const Rigid3d& T_cam_world, double depth) {
  if (map != map_) {
    last_.reset();
    position_squared_ = rotation_squared_ = 0;
  }
  map_ = map;
  const double kept = std::exp(-1e-9 * static_cast<double>(stamp_ns - newest_ns_) / options_.memory_s);
  position_squared_ *= kept;
  rotation_squared_ *= kept;
  newest_ns_ = stamp_ns;
  last_ = Follow(stamp_ns, T_cam_world, depth);
}

PoseJitter::Told PoseJitter::Follow(int64_t stamp_ns, const Rigid3d& T_cam_world, double depth) {
  Told now{stamp_ns, T_cam_world, std::nullopt, 0};
  if (!last_) return now;
  const int64_t step_ns = stamp_ns - last_->stamp_ns;
  if (step_ns <= 0 || step_ns > kLongestStepNs) return now;
  now.step_s = 1e-9 * static_cast<double>(step_ns);
  now.T_cam_before = T_cam_world * last_->T_cam_world.Inverse();
  if (!last_->T_cam_before) return now;
  // Along the axes of the camera in the middle.
  const double longer = now.step_s / last_->step_s;
  const Eigen::Vector3d went = now.T_cam_before->Center(), turned = LogSo3(now.T_cam_before->rotation);
  const Eigen::Vector3d goes = -last_->T_cam_before->translation,
                        turns = LogSo3(last_->T_cam_before->rotation);
  const double own = std::pow(options_.acceleration * now.step_s * now.step_s, 2);
  position_squared_ =
      std::max(position_squared_, (went - longer * goes).squaredNorm() / (depth * depth) - own);
  rotation_squared_ = std::max(rotation_squared_, (turned - longer * turns).squaredNorm() - own);
  return now;
}

Matrix6d PoseJitter::Covariance(double depth) const {
  const double share = options_.gain * options_.gain;
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << Eigen::Vector3d::Constant(share * rotation_squared_),
      Eigen::Vector3d::Constant(share * position_squared_ * depth * depth);
  return covariance;
}

Matrix6d PoseJitter::Beyond(const Matrix6d& told, double depth) const {
  Matrix6d beyond = Covariance(depth);
  for (const int block : {0, 3}) {
    auto of_block = beyond.diagonal().segment<3>(block);
    of_block = (of_block.array() - told.diagonal().segment<3>(block).mean()).max(0.0);
  }
  return beyond;
}

}  // namespace dmslam
