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

/// To the nearest, halves away from zero, as std::lround, which is a call.
int Round(double value) {
  const int whole = static_cast<int>(value);
  const double rest = value - whole;
  return whole + (rest >= 0.5 ? 1 : 0) - (rest <= -0.5 ? 1 : 0);
}

Eigen::Quaterniond Turned(double roll_rad, const Eigen::Vector2d& shift_rad) {
  return Eigen::AngleAxisd(shift_rad.x(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(-shift_rad.y(), Eigen::Vector3d::UnitX()) *
         Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ());
}

}  // namespace

void TurnSearch::ListPairs(const Map& map, const LandmarkVotes& votes, std::span<const LandmarkId> landmarks,
                           const Rigid3d& T_cam_world, double reach_rad, const FrameFeatures& features) {
  landmarks_.clear();
  pairs_.clear();
  const double radius_px = SearchRadiusPx(map.camera(), reach_rad);
  const Viewpoint viewpoint(T_cam_world);
  map.ForEachOf(landmarks, [&](const Landmark& landmark) {
    const std::optional<LandmarkView> view = PredictView(map, landmark, viewpoint);
    if (!view || !votes.HasVote(landmark)) return;
    const SearchArea area = {view->uv_px, radius_px, view->octave - 1, view->octave + 1};
    const std::span<const uint32_t> named = MostAlike(landmark.descriptor, area, features);
    if (named.empty()) return;
    landmarks_.push_back(T_cam_world * landmark.p_world);
    for (const uint32_t feature : named)
      pairs_.push_back({landmarks_.size() - 1, AzimuthElevation(map.camera().Ray(features.uv_px[feature]))});
  });
}

/// The features of the area that look most like the descriptor, and not too unlike, best first.
std::span<const uint32_t> TurnSearch::MostAlike(const Descriptor& descriptor, const SearchArea& area,
                                                const FrameFeatures& features) {
  in_area_.resize(features.size() + FeatureGrid::kSlack);
  distances_.resize(in_area_.size());
  const size_t found = features.grid.CollectInRadius(area.center_px, area.radius_px, area.min_octave,
                                                     area.max_octave, in_area_.data());
  const int near =
      BestHammingKernels().keep_near(descriptor, features.set.descriptors.data(), in_area_.data(),
                                     static_cast<int>(found), kMaxDistance, distances_.data());
  alike_.clear();
  for (size_t k = 0; k < static_cast<size_t>(near); ++k) alike_.emplace_back(distances_[k], in_area_[k]);
  const size_t named = std::min(kMostAlike, alike_.size());
  std::partial_sort(alike_.begin(), alike_.begin() + static_cast<ptrdiff_t>(named), alike_.end());
  for (size_t k = 0; k < named; ++k) in_area_[k] = alike_[k].second;
  return {in_area_.data(), named};
}

/// The shift of azimuth and elevation that most pairs agree on, after a turn about the optical axis.
TurnSearch::Turn TurnSearch::BestShift(double roll_rad, double reach_rad) {
  const int side = 2 * static_cast<int>(std::ceil(reach_rad / kBinRad)) + 3;  // and a rim of one
  const auto at = [side](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(side) + static_cast<size_t>(x);
  };
  counts_.assign(at(0, side), 0);
  shifts_rad_.clear();
  bins_.clear();
  const Eigen::Quaterniond rolled = Turned(roll_rad, Eigen::Vector2d::Zero());
  const auto bin = [side](double shift_rad) { return Round(shift_rad / kBinRad) + side / 2; };
  const auto inside = [side](int b) { return b >= 1 && b < side - 1; };
  expected_.clear();
  for (const Eigen::Vector3d& landmark : landmarks_) expected_.push_back(AzimuthElevation(rolled * landmark));
  for (const Pair& pair : pairs_) {
    shifts_rad_.push_back(pair.feature - expected_[pair.landmark]);
    const int x = bin(shifts_rad_.back().x()), y = bin(shifts_rad_.back().y());
    bins_.emplace_back(x, y);
    if (inside(x) && inside(y)) ++counts_[at(x, y)];
  }
  Turn best{roll_rad, Eigen::Vector2d::Zero(), 0};
  Eigen::Vector2i middle = Eigen::Vector2i::Zero();
  for (int y = 1; y < side - 1; ++y) {
    for (int x = 1; x < side - 1; ++x) {
      int votes = 0;
      for (int row = y - 1; row <= y + 1; ++row) {
        for (int column = x - 1; column <= x + 1; ++column) votes += counts_[at(column, row)];
      }
      if (votes <= best.votes) continue;
      best.votes = votes;
      middle = {x, y};
    }
  }
  for (size_t i = 0; i < bins_.size(); ++i) {
    if (std::abs(bins_[i].x() - middle.x()) <= 1 && std::abs(bins_[i].y() - middle.y()) <= 1)
      best.shift_rad += shifts_rad_[i] / best.votes;
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
