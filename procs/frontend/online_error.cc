#include "frontend/online_error.h"

#include <iterator>
#include <optional>

namespace dmslam {
namespace {

constexpr size_t kMinAligned = 10;
constexpr size_t kMaxWaiting = 1000;

}  // namespace

void OnlineError::OnTruth(uint32_t frame_index, const Eigen::Vector3d& p_world) {
  truth_.emplace(frame_index, p_world);
  if (truth_.size() > kMaxWaiting) truth_.erase(truth_.begin());
}

std::optional<double> OnlineError::OnPose(uint32_t frame_index, const Eigen::Vector3d& p_map) {
  const auto truth = truth_.find(frame_index);
  if (truth == truth_.end()) return std::nullopt;
  const Eigen::Vector3d p_true = truth->second;
  pairs_.Add(p_map, p_true);
  truth_.erase(truth_.begin(), std::next(truth));
  if (pairs_.count() < kMinAligned) return std::nullopt;
  const std::optional<Sim3d> true_from_map = pairs_.Align(Alignment::kSim3);
  if (!true_from_map) return std::nullopt;
  return (*true_from_map * p_map - p_true).norm();
}

void OnlineError::Reset() { pairs_ = {}; }

}  // namespace dmslam
