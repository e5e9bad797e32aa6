#include "dmslam/tracking/turn_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dmslam/camera/image_scale.h"
#include "dmslam/features/hamming.h"
#include "dmslam/map/projection.h"

namespace dmslam {
namespace {

constexpr int kMaxDistance = 80;  // bits: blur changes many
constexpr size_t kMostAlike = 5;  // features that a landmark names
constexpr double kBinRad = 0.02;  // of azimuth and elevation; three by three bins make a turn
constexpr double kRollStepRad = 0.05;
constexpr int kRollSteps = 2;  // to either side
constexpr int kLeastVotes = 10;

Eigen::Vector2d AzimuthElevation(const Eigen::Vector3d& direction) {
  return {std::atan2(direction.x(), direction.z()),
          std::atan2(direction.y(), std::hypot(direction.x(), direction.z()))};
}

Eigen::Quaterniond Turned(double roll_rad, const Eigen::Vector2d& shift_rad) {
  return Eigen::AngleAxisd(shift_rad.x(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(-shift_rad.y(), Eigen::Vector3d::UnitX()) *
         Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ());
}

}  // namespace

void TurnSearch::ListPairs(const Map& map, const LandmarkVotes& votes, std::span<const LandmarkId> landmarks,
                           const Rigid3d& T_cam_world, double reach_rad, const FrameFeatures& features) {
  pairs_.clear();
  const double radius_px = SearchRadiusPx(map.camera(), reach_rad);
  const Viewpoint viewpoint(T_cam_world);
  for (const LandmarkId id : landmarks) {
    const Landmark& landmark = *map.FindLandmark(id);
    const std::optional<LandmarkView> view = PredictView(map, landmark, viewpoint);
    if (!view || !votes.HasVote(landmark)) continue;
    alike_.clear();
    features.grid.ForEachInRadius(
        view->uv_px, radius_px, view->octave - 1, view->octave + 1, [&](uint32_t i) {
          const int distance = HammingDistance(landmark.descriptor, features.set.descriptors[i]);
          if (distance <= kMaxDistance) alike_.emplace_back(distance, i);
        });
    const size_t named = std::min(kMostAlike, alike_.size());
    std::partial_sort(alike_.begin(), alike_.begin() + static_cast<ptrdiff_t>(named), alike_.end());
    const Eigen::Vector3d p_cam = T_cam_world * landmark.p_world;
    for (size_t k = 0; k < named; ++k) {
      pairs_.push_back({p_cam, AzimuthElevation(map.camera().Ray(features.uv_px[alike_[k].second]))});
    }
  }
}

/// The shift of azimuth and elevation that most pairs agree on, after a turn about the optical axis.
TurnSearch::Turn TurnSearch::BestShift(double roll_rad, double reach_rad) {
  const int side = 2 * static_cast<int>(std::ceil(reach_rad / kBinRad)) + 3;  // and a rim of one
  counts_.assign(static_cast<size_t>(side * side), 0);
  shifts_rad_.clear();
  const Eigen::Quaterniond rolled = Turned(roll_rad, Eigen::Vector2d::Zero());
  const auto bin = [side](double shift_rad) {
    return static_cast<int>(std::lround(shift_rad / kBinRad)) + side / 2;
  };
  const auto inside = [side](int b) { return b >= 1 && b < side - 1; };
  for (const Pair& pair : pairs_) {
    shifts_rad_.push_back(pair.feature - AzimuthElevation(rolled * pair.landmark));
    const int x = bin(shifts_rad_.back().x()), y = bin(shifts_rad_.back().y());
    if (inside(x) && inside(y)) ++counts_[static_cast<size_t>(y * side + x)];
  }
  Turn best{roll_rad, Eigen::Vector2d::Zero(), 0};
  Eigen::Vector2i middle = Eigen::Vector2i::Zero();
  for (int y = 1; y < side - 1; ++y) {
    for (int x = 1; x < side - 1; ++x) {
      int votes = 0;
      for (int row = y - 1; row <= y + 1; ++row) {
        for (int column = x - 1; column <= x + 1; ++column)
          votes += counts_[static_cast<size_t>(row * side + column)];
      }
      if (votes <= best.votes) continue;
      best.votes = votes;
      middle = {x, y};
    }
  }
  for (const Eigen::Vector2d& shift_rad : shifts_rad_) {
    if (std::abs(bin(shift_rad.x()) - middle.x()) <= 1 && std::abs(bin(shift_rad.y()) - middle.y()) <= 1)
      best.shift_rad += shift_rad / best.votes;
  }
  return best;
}

std::optional<Rigid3d> TurnSearch::Find(const Map& map, const LandmarkVotes& votes,
                                        std::span<const LandmarkId> landmarks, const Rigid3d& T_cam_world,
                                        double reach_rad, const FrameFeatures& features) {
  ListPairs(map, votes, landmarks, T_cam_world, reach_rad, features);
  Turn best;
  for (int step = -kRollSteps; step <= kRollSteps; ++step) {
    const Turn turn = BestShift(step * kRollStepRad, reach_rad);
    if (turn.votes > best.votes) best = turn;
  }
  if (best.votes < kLeastVotes) return std::nullopt;
  const Eigen::Quaterniond turned = Turned(best.roll_rad, best.shift_rad);
  return Rigid3d(turned * T_cam_world.rotation, turned * T_cam_world.translation);
}

}  // namespace dmslam
