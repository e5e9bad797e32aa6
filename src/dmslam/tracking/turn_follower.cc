#include "dmslam/tracking/turn_follower.h"

#include <algorithm>
#include <array>

#include "dmslam/camera/image_cells.h"
#include "dmslam/camera/image_scale.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/motion_segmentation/match_frames.h"
#include "dmslam/motion_segmentation/turn.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr double kLongestGapS = 0.3;     // between frames that are compared
constexpr double kFastestRadPerS = 3.0;  // pictures that pass by faster are a blur
constexpr double kNearRad = 0.08;        // where a camera that goes on turning will see what it saw
constexpr double kProvenS = 0.2;         // so long one turn must explain the pictures to be believed
constexpr size_t kLeastMatches = 60;     // that tell a turn
constexpr double kMostAsideRad = 0.003;  // from where the turn puts it, of a match that the turn explains...
constexpr double kMostAside = 1.5;   // ...but no finer than features are found [px of the finest level]...
constexpr double kLeastShare = 0.7;  // ...of the matches...
constexpr size_t kLeastCells = kNumCells / 2;  // ...in so many cells of the image
constexpr double kOverlap = 0.5;  // of the matches that were there at first: with fewer a new picture begins

}  // namespace

void TurnFollower::Begin(const TrackedFrame& frame) {
  R_anchor_begun_ = R_now_anchor_ = Eigen::Quaterniond::Identity();
  rad_per_s_.setZero();
  proven_ = false;
  begun_ns_ = newest_ns_ = frame.stamp_ns;
  MoveAnchor(frame);
}

void TurnFollower::MoveAnchor(const TrackedFrame& frame) {
  R_anchor_begun_ = R_now_begun();
  R_now_anchor_.setIdentity();
  anchor_ = frame.features;
  anchor_ns_ = frame.stamp_ns;
  first_matches_.reset();
}

/// The camera goes on turning as it did.
Eigen::Quaterniond TurnFollower::Predicted(int64_t stamp_ns) const {
  return ExpSo3(rad_per_s_ * SecondsFromTo(newest_ns_, stamp_ns)) * R_now_anchor_;
}

bool TurnFollower::IsTurn(const std::vector<Match>& matches, const Eigen::Quaterniond& R_1_0) const {
  std::array<bool, kNumCells> seen{};
  const double most_aside =
      std::max(kMostAsideRad, kMostAside * FinestPx(camera_.width_px, camera_.height_px) / FocalPx(camera_));
  size_t explained = 0;
  for (const Match& match : matches) {
    const Eigen::Vector3d turned = R_1_0 * camera_.Ray(match.uv0_px).normalized();
    if ((camera_.Ray(match.uv1_px).normalized() - turned).norm() > most_aside) continue;
    ++explained;
    seen[CellOf(camera_, match.uv1_px)] = true;
  }
  const auto cells = static_cast<size_t>(std::ranges::count(seen, true));
  return static_cast<double>(explained) >= kLeastShare * static_cast<double>(matches.size()) &&
         cells >= kLeastCells;
}

void TurnFollower::Follow(const TrackedFrame& frame) {
  const double since_s = SecondsFromTo(newest_ns_, frame.stamp_ns);
  if (!anchor_ || since_s <= 0 || since_s > kLongestGapS) return Begin(frame);
  const Eigen::Quaterniond predicted = Predicted(frame.stamp_ns);
  const bool is_speed_known = newest_ns_ > begun_ns_;
  MatchingOptions matching;
  matching.window_rad = is_speed_known ? kNearRad : std::min(matching.window_rad, kFastestRadPerS * since_s);
  const std::vector<Match> matches = MatchFrames(*anchor_, *frame.features, camera_, matching, &matcher_,
                                                 Turned(anchor_->uv_px, camera_, predicted));
  const Eigen::Quaterniond R_1_0 = FitTurn(matches, camera_, predicted);
  if (matches.size() < kLeastMatches || !IsTurn(matches, R_1_0)) return Begin(frame);
  rad_per_s_ = LogSo3(R_1_0 * R_now_anchor_.conjugate()) / since_s;
  R_now_anchor_ = R_1_0;
  newest_ns_ = frame.stamp_ns;
  proven_ = proven_ || SecondsFromTo(anchor_ns_, frame.stamp_ns) >= kProvenS;
  if (!first_matches_) first_matches_ = matches.size();
  if (static_cast<double>(matches.size()) < kOverlap * static_cast<double>(*first_matches_))
    MoveAnchor(frame);
}

}  // namespace dmslam
