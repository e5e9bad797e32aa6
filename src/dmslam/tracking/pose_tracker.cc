#include "dmslam/tracking/pose_tracker.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>

#include "dmslam/dynamics/found_share.h"
#include "dmslam/dynamics/motion_belief.h"
#include "dmslam/robust/pose_from_matches.h"

namespace dmslam {
namespace {

constexpr int kCellColumns = 8, kCellRows = 6;
constexpr int kTurnBins = 30;
constexpr int kStreakWithoutVote = 3;  // frames in a row seen elsewhere: no vote, before the mapper says so
constexpr int kMaxKeyframeDistance = 50;
constexpr double kFrontalCos = 0.998;
constexpr int kNeighboursOfLocal = 10;
constexpr double kWiderAfterRelocalization = 2.0;  // times the radius of the search
constexpr double kWiderAroundPrediction = 4.0;

size_t CellOf(const Eigen::Vector2d& uv_px, const Camera& camera) {
  const int column =
      std::clamp(static_cast<int>(uv_px.x() * kCellColumns / camera.width_px), 0, kCellColumns - 1);
  const int row = std::clamp(static_cast<int>(uv_px.y() * kCellRows / camera.height_px), 0, kCellRows - 1);
  return static_cast<size_t>(row * kCellColumns + column);
}

}  // namespace

PoseTracker::PoseTracker(const TrackingOptions& options, const Camera& camera, const Pyramid& pyramid)
    : options_(options), camera_(camera), pyramid_(pyramid), witnesses_(camera) {}

void PoseTracker::Reset() {
  reference_ = {};
  local_keyframes_.clear();
  local_landmarks_.clear();
  recent_motion_.clear();
  evidence_.clear();
}

void PoseTracker::SetMotionPrior(const std::optional<Rigid3d>& T_cam_world, double depth, double frames) {
  prior_.reset();
  if (!T_cam_world) return;
  PosePrior prior;
  prior.T_cam_world = *T_cam_world;
  const double rotation = 1.0 / (options_.prior_rotation_rad * frames);
  const double translation = 1.0 / (options_.prior_translation * depth * frames);
  prior.information.diagonal() << Eigen::Vector3d::Constant(rotation * rotation),
      Eigen::Vector3d::Constant(translation * translation);
  prior_ = prior;
}

bool PoseTracker::HasVote(const Landmark& landmark) const {
  if (!options_.motion_belief) return true;
  if (!IsStatic(&landmark)) return false;
  const auto recent = recent_motion_.find(landmark.id);
  return recent == recent_motion_.end() || recent->second.streak < kStreakWithoutVote;
}

double PoseTracker::Trust(const Landmark& landmark, int64_t stamp_ns) const {
  if (!options_.motion_belief) return 1.0;
  const double age_s = static_cast<double>(stamp_ns - landmark.first_ns) * 1e-9;
  const double grown = std::clamp(age_s / options_.trusted_age_s, 0.0, 1.0);
  return options_.young_trust + (1.0 - options_.young_trust) * grown;
}

// ---- First guess ----

void PoseTracker::MatchByProjection(const Map& map, const TrackedFrame& last, const Rigid3d& T_cam_world,
                                    double radius_px, const TrackedFrame& frame) {
  matches_.clear();
  match_turns_.clear();
  taken_.assign(frame.features->size(), 0);
  for (size_t i = 0; i < last.landmarks.size(); ++i) {
    if (!last.landmarks[i].valid()) continue;
    const std::optional<LandmarkId> id = map.Resolve(last.landmarks[i]);
    if (!id) continue;
    const Landmark& landmark = *map.FindLandmark(*id);
    if (!HasVote(landmark)) continue;
    const std::optional<Eigen::Vector2d> uv = camera_.Project(T_cam_world * landmark.p_world);
    if (!uv) continue;
    const Keypoint& seen = last.features->set.keypoints[i];
    const FeatureHit hit =
        FindFeature(*frame.features, *uv, radius_px * pyramid_.Scale(seen.octave), seen.octave - 1,
                    seen.octave + 1, last.features->set.descriptors[i], taken_);
    if (hit.feature < 0 || hit.distance > options_.max_descriptor_distance) continue;
    const size_t feature = static_cast<size_t>(hit.feature);
    taken_[feature] = 1;
    matches_.push_back({*id, static_cast<uint16_t>(feature)});
    match_turns_.push_back(
        static_cast<float>(static_cast<uint8_t>(frame.features->set.keypoints[feature].angle - seen.angle)));
  }
}

/// Keeps the matches whose keypoints turned as most others did (three best of thirty bins, as in ORB-SLAM2).
void PoseTracker::KeepConsistentTurns(const TrackedFrame&, const TrackedFrame&) {
  std::array<int, kTurnBins> counts{};
  const auto bin_of = [](float turn) { return static_cast<size_t>(turn * kTurnBins / 256.0F) % kTurnBins; };
  for (const float turn : match_turns_) ++counts[bin_of(turn)];
  std::array<int, kTurnBins> sorted = counts;
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  const int least = std::max(sorted[2], sorted[0] / 10);
  size_t kept = 0;
  for (size_t i = 0; i < matches_.size(); ++i) {
    if (counts[bin_of(match_turns_[i])] >= std::max(1, least)) matches_[kept++] = matches_[i];
  }
  matches_.resize(kept);
}

bool PoseTracker::TrackFromFrame(const Map& map, const TrackedFrame& last, const Rigid3d& T_predicted,
                                 TrackedFrame* frame) {
  double radius_px = options_.motion_radius_px;
  for (int attempt = 0; attempt < 2; ++attempt, radius_px *= 2) {
    MatchByProjection(map, last, T_predicted, radius_px, *frame);
    KeepConsistentTurns(last, *frame);
    if (static_cast<int>(matches_.size()) >= options_.min_motion_matches) break;
  }
  if (static_cast<int>(matches_.size()) < options_.min_motion_matches) return false;
  frame->ClearMatches();
  for (const Match& match : matches_) frame->landmarks[match.feature] = match.landmark;
  frame->T_cam_world = T_predicted;
  return OptimizeMatches(map, frame) >= options_.min_motion_inliers;
}

bool PoseTracker::TrackFromKeyframe(const Map& map, KeyframeId keyframe_id, uint64_t seed,
                                    TrackedFrame* frame) {
  const Keyframe* keyframe = map.FindKeyframe(keyframe_id);
  if (keyframe == nullptr) return false;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<double> inv_sigma_squared;
  matches_.clear();
  taken_.assign(frame->features->size(), 0);
  for (size_t i = 0; i < keyframe->landmarks.size(); ++i) {
    const Landmark* landmark =
        keyframe->landmarks[i].valid() ? map.FindLandmark(keyframe->landmarks[i]) : nullptr;
    if (landmark == nullptr || !HasVote(*landmark)) continue;
    const FeatureHit hit = FindFeature(*frame->features, {camera_.width_px / 2.0, camera_.height_px / 2.0},
                                       2.0 * camera_.width_px, 0, pyramid_.levels,
                                       keyframe->features->set.descriptors[i], taken_);
    if (hit.feature < 0 || hit.distance > kMaxKeyframeDistance || hit.distance > 0.75 * hit.second_distance)
      continue;
    const size_t feature = static_cast<size_t>(hit.feature);
    taken_[feature] = 1;
    matches_.push_back({landmark->id, static_cast<uint16_t>(feature)});
    points.push_back(landmark->p_world);
    pixels.push_back(frame->features->uv_px[feature]);
    inv_sigma_squared.push_back(1.0 / pyramid_.SigmaSquared(frame->features->set.keypoints[feature].octave));
  }
  if (matches_.size() < 15) return false;
  PoseRansacOptions ransac;
  ransac.seed = seed;
  const auto report = PoseFromMatches(camera_.Ideal(), points, pixels, inv_sigma_squared, ransac);
  if (!report.success) return false;
  frame->ClearMatches();
  for (const Match& match : matches_) frame->landmarks[match.feature] = match.landmark;
  frame->T_cam_world = report.model;
  return OptimizeMatches(map, frame) >= options_.min_motion_inliers;
}

/// The landmarks that stood still for longest decide first; the others only refine what agrees with them, and
/// never weigh more. People who stood still while they were mapped are younger than the room around them, so
/// they cannot carry the camera away when they walk on, however much of the image they fill.
void PoseTracker::OptimizeElders(const TrackedFrame& frame, const PoseOptimizationOptions& options) {
  std::vector<double>& sorted = sorted_ages_s_;
  sorted = ages_s_;
  const size_t wanted =
      std::max(static_cast<size_t>(options_.min_elders),
               static_cast<size_t>(options_.elder_share * static_cast<double>(sorted.size())));
  if (sorted.size() <= wanted) return;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<ptrdiff_t>(wanted), sorted.end(),
                   std::greater<>());
  const double elder_age_s = std::min(sorted[wanted], options_.trusted_age_s);
  elders_.clear();
  for (size_t i = 0; i < matches_.size(); ++i) {
    if (ages_s_[i] >= elder_age_s) elders_.push_back(observations_[i]);
  }
  if (elders_.size() == observations_.size()) return;
  OptimizePose(camera_.Ideal(), frame.T_cam_world, elders_, options, optimized_);
  const int needed = static_cast<int>(options_.elder_agreement * static_cast<double>(elders_.size()));
  if (!optimized_.usable || optimized_.num_inliers < needed) return;
  KeepWhatAgrees(optimized_.T_cam_world, elder_age_s, optimized_.num_inliers);
}

void PoseTracker::KeepWhatAgrees(const Rigid3d& T_cam_world, double elder_age_s, int elders) {
  size_t kept = 0;
  int young = 0;
  for (size_t i = 0; i < matches_.size(); ++i) {
    const PoseObservation& o = observations_[i];
    const double chi2 =
        ReprojectionErrorSquared(camera_.Ideal(), T_cam_world, o.p_world, o.uv_px) * o.inv_sigma_squared;
    if (ages_s_[i] < elder_age_s) {
      if (chi2 > options_.elder_chi2) {
        rejected_.push_back({matches_[i], chi2});
        continue;
      }
      ++young;
    }
    matches_[kept] = matches_[i];
    ages_s_[kept] = ages_s_[i];
    observations_[kept++] = o;
  }
  matches_.resize(kept);
  ages_s_.resize(kept);
  observations_.resize(kept);
  const double factor = std::min(1.0, options_.young_to_elder_weight * elders / std::max(1, young));
  for (size_t i = 0; i < kept; ++i) {
    if (ages_s_[i] < elder_age_s) observations_[i].weight *= factor;
  }
}

int PoseTracker::OptimizeMatches(const Map& map, TrackedFrame* frame) {
  observations_.clear();
  matches_.clear();
  ages_s_.clear();
  rejected_.clear();
  for (size_t i = 0; i < frame->landmarks.size(); ++i) {
    if (!frame->landmarks[i].valid()) continue;
    const Landmark* landmark = map.FindLandmark(frame->landmarks[i]);
    if (landmark == nullptr) continue;
    matches_.push_back({landmark->id, static_cast<uint16_t>(i)});
    ages_s_.push_back(static_cast<double>(frame->stamp_ns - landmark->first_ns) * 1e-9);
    observations_.push_back({landmark->p_world, frame->features->uv_px[i],
                             1.0 / pyramid_.SigmaSquared(frame->features->set.keypoints[i].octave),
                             Trust(*landmark, frame->stamp_ns)});
  }
  PoseOptimizationOptions options;
  options.max_chi2 = options_.chi2;
  options.prior = prior_;
  if (options_.motion_belief) OptimizeElders(*frame, options);
  OptimizePose(camera_.Ideal(), frame->T_cam_world, observations_, options, optimized_);
  if (!optimized_.usable) return 0;
  frame->T_cam_world = optimized_.T_cam_world;
  for (size_t i = 0; i < matches_.size(); ++i) {
    if (optimized_.inliers[i] != 0) {
      frame->classes[matches_[i].feature] = FeatureClass::kUsed;
    } else {
      rejected_.push_back({matches_[i], optimized_.chi2[i]});
    }
  }
  for (const Rejected& rejected : rejected_) {
    frame->classes[rejected.match.feature] = FeatureClass::kRejected;
    frame->landmarks[rejected.match.feature] = LandmarkId{};
  }
  return optimized_.num_inliers;
}

// ---- Local map ----

/// The keyframes that see most of the frame's landmarks, most first.
void PoseTracker::RankByVotes(const Map& map, const TrackedFrame& frame) {
  votes_.clear();
  for (const LandmarkId id : frame.landmarks) {
    const Landmark* landmark = id.valid() ? map.FindLandmark(id) : nullptr;
    if (landmark == nullptr) continue;
    for (const Observation& o : landmark->observations) votes_.push_back(o.keyframe);
  }
  std::sort(votes_.begin(), votes_.end());
  ranked_.clear();
  for (auto begin = votes_.begin(); begin != votes_.end();) {
    const auto end = std::find_if(begin, votes_.end(), [begin](KeyframeId other) { return other != *begin; });
    ranked_.emplace_back(-static_cast<int>(end - begin), *begin);
    begin = end;
  }
  std::sort(ranked_.begin(), ranked_.end());
}

/// The best neighbour of a local keyframe that is not local yet; invalid: none.
KeyframeId PoseTracker::NewNeighbour(const Map& map, KeyframeId of) {
  ranked_.clear();
  for (const auto& [other, shared] : map.FindKeyframe(of)->covisible) {
    if (shared >= 1) ranked_.emplace_back(-shared, other);
  }
  const auto asked = ranked_.begin() + std::min<ptrdiff_t>(kNeighboursOfLocal, std::ssize(ranked_));
  std::partial_sort(ranked_.begin(), asked, ranked_.end());
  const auto found = std::find_if(ranked_.begin(), asked, [this](const auto& item) {
    return !std::binary_search(listed_.begin(), listed_.end(), item.second);
  });
  return found == asked ? KeyframeId() : found->second;
}

void PoseTracker::CollectLocalMap(const Map& map, const TrackedFrame& frame) {
  RankByVotes(map, frame);
  const size_t most = static_cast<size_t>(options_.max_local_keyframes);
  const size_t direct = std::min(ranked_.size(), most);
  local_keyframes_.clear();
  for (size_t i = 0; i < direct; ++i) local_keyframes_.push_back(ranked_[i].second);
  if (direct > 0) reference_ = local_keyframes_.front();
  listed_ = local_keyframes_;
  std::sort(listed_.begin(), listed_.end());
  for (size_t i = 0; i < direct && local_keyframes_.size() < most; ++i) {
    const KeyframeId neighbour = NewNeighbour(map, local_keyframes_[i]);
    if (!neighbour.valid()) continue;
    listed_.insert(std::lower_bound(listed_.begin(), listed_.end(), neighbour), neighbour);
    local_keyframes_.push_back(neighbour);
  }
  local_landmarks_.clear();
  for (const KeyframeId id : local_keyframes_) {
    for (const LandmarkId landmark : map.FindKeyframe(id)->landmarks) {
      if (landmark.valid()) local_landmarks_.push_back(landmark);
    }
  }
  std::sort(local_landmarks_.begin(), local_landmarks_.end());
  local_landmarks_.erase(std::unique(local_landmarks_.begin(), local_landmarks_.end()),
                         local_landmarks_.end());
}

void PoseTracker::SearchLocalLandmarks(const Map& map, double wider, TrackedFrame* frame) {
  std::vector<LandmarkId>& matched = known_;
  matched.clear();
  taken_.assign(frame->features->size(), 0);
  for (size_t i = 0; i < frame->landmarks.size(); ++i) {
    if (!frame->landmarks[i].valid()) continue;
    matched.push_back(frame->landmarks[i]);
    taken_[i] = 1;
  }
  std::sort(matched.begin(), matched.end());
  visible_.clear();
  for (const LandmarkId id : local_landmarks_) {
    const Landmark& landmark = *map.FindLandmark(id);
    const std::optional<LandmarkView> view = PredictView(map, landmark, frame->T_cam_world);
    if (!view) continue;
    visible_.emplace_back(id, *view);
    if (!HasVote(landmark) || std::binary_search(matched.begin(), matched.end(), id)) continue;
    const double radius =
        wider * (view->view_cos > kFrontalCos ? options_.local_radius_frontal : options_.local_radius);
    const FeatureHit hit = FindFeature(*frame->features, view->uv_px, radius * pyramid_.Scale(view->octave),
                                       view->octave - 1, view->octave, landmark.descriptor, taken_);
    if (hit.feature < 0 || hit.distance > options_.max_descriptor_distance) continue;
    if (hit.octave == hit.second_octave && hit.distance > options_.local_ratio * hit.second_distance)
      continue;
    frame->landmarks[static_cast<size_t>(hit.feature)] = id;
    taken_[static_cast<size_t>(hit.feature)] = 1;
  }
}

/// What is found where little else of the map is found is mostly found by chance, on whoever hides the map:
/// within the search radius, and so in agreement with any pose, right or wrong. It must look like its
/// landmark more closely than a match among many others.
void PoseTracker::DropMatchesOfHiddenPlaces(const Map& map, TrackedFrame* frame) {
  std::vector<LandmarkId>& matched = known_;
  matched.clear();
  for (const LandmarkId id : frame->landmarks) {
    if (id.valid()) matched.push_back(id);
  }
  std::sort(matched.begin(), matched.end());
  FoundShare share(camera_);
  for (const auto& [id, view] : visible_) {
    if (!HasVote(*map.FindLandmark(id))) continue;
    share.Add(view.uv_px, std::binary_search(matched.begin(), matched.end(), id));
  }
  for (size_t i = 0; i < frame->landmarks.size(); ++i) {
    const Landmark* landmark = frame->landmarks[i].valid() ? map.FindLandmark(frame->landmarks[i]) : nullptr;
    if (landmark == nullptr) continue;
    const double allowed =
        options_.hidden_distance + options_.hidden_distance_slope * share.Around(frame->features->uv_px[i]);
    if (HammingDistance(landmark->descriptor, frame->features->set.descriptors[i]) > allowed) {
      frame->landmarks[i] = LandmarkId{};
    }
  }
}

void PoseTracker::FindMoved(const Map& map, TrackedFrame* frame) {
  std::vector<LandmarkId>& used = known_;
  used.clear();
  taken_.assign(frame->features->size(), 0);
  for (size_t i = 0; i < frame->landmarks.size(); ++i) {
    if (!frame->landmarks[i].valid()) continue;
    used.push_back(frame->landmarks[i]);
    taken_[i] = 1;
  }
  moved_.clear();
  for (const Rejected& rejected : rejected_) {
    const Landmark* landmark = map.FindLandmark(rejected.match.landmark);
    const size_t feature = rejected.match.feature;
    const int distance = HammingDistance(landmark->descriptor, frame->features->set.descriptors[feature]);
    if (rejected.chi2 < options_.moved_near_chi2 || distance > options_.moved_near_distance) continue;
    moved_.push_back(rejected.match.landmark);
    used.push_back(rejected.match.landmark);
    taken_[feature] = 1;
    frame->classes[feature] = FeatureClass::kMoving;
  }
  std::sort(used.begin(), used.end());
  for (const auto& [id, guess] : visible_) {
    if (std::binary_search(used.begin(), used.end(), id)) continue;
    const Landmark& landmark = *map.FindLandmark(id);
    const std::optional<Eigen::Vector2d> uv = camera_.Project(frame->T_cam_world * landmark.p_world);
    if (!uv) continue;
    const FeatureHit hit = FindFeature(*frame->features, *uv, options_.moved_radius_px, guess.octave - 1,
                                       guess.octave + 1, landmark.descriptor, taken_);
    if (hit.feature < 0 || hit.distance > options_.moved_max_distance ||
        hit.distance > options_.moved_ratio * hit.second_distance) {
      continue;
    }
    if (NormalizedErrorSquared(*frame->features, hit.feature, *uv, pyramid_) < options_.moved_chi2) continue;
    moved_.push_back(id);
    frame->classes[static_cast<size_t>(hit.feature)] = FeatureClass::kMoving;
  }
}

PoseTracker::Witnesses::Witnesses(const Camera& camera)
    : cell_width_(static_cast<double>(camera.width_px) / kSeenColumns),
      cell_height_(static_cast<double>(camera.height_px) / kSeenRows) {}

void PoseTracker::Witnesses::Clear() {
  for (auto& cell : cells_) cell.clear();
}

void PoseTracker::Witnesses::Add(const Witness& witness) {
  cells_[Index(Column(witness.uv_px.x()), Row(witness.uv_px.y()))].push_back(witness);
}

template <typename Visit>
void PoseTracker::Witnesses::ForEachNear(const Eigen::Vector2d& uv_px, double reach_px,
                                         const Visit& visit) const {
  for (int row = Row(uv_px.y() - reach_px); row <= Row(uv_px.y() + reach_px); ++row) {
    for (int column = Column(uv_px.x() - reach_px); column <= Column(uv_px.x() + reach_px); ++column) {
      for (const Witness& witness : cells_[Index(column, row)]) {
        if ((witness.uv_px - uv_px).squaredNorm() <= reach_px * reach_px) visit(witness);
      }
    }
  }
}

int PoseTracker::Witnesses::Column(double x) const {
  return std::clamp(static_cast<int>(x / cell_width_), 0, kSeenColumns - 1);
}

int PoseTracker::Witnesses::Row(double y) const {
  return std::clamp(static_cast<int>(y / cell_height_), 0, kSeenRows - 1);
}

/// Judges the landmarks that are missing by what is seen around them. What lies behind is seen: nothing hides
/// them, they have gone. Their neighbours move: they go together. Something nearer is seen: they are hidden,
/// and nothing is said.
void PoseTracker::JudgeMissing(const Map& map, const TrackedFrame& frame) {
  witnesses_.Clear();
  std::vector<LandmarkId>& known = known_;
  known = moved_;
  for (size_t i = 0; i < frame.landmarks.size(); ++i) {
    if (!frame.landmarks[i].valid()) continue;
    known.push_back(frame.landmarks[i]);
    const double depth = (frame.T_cam_world * map.FindLandmark(frame.landmarks[i])->p_world).z();
    witnesses_.Add({frame.features->uv_px[i], depth, false});
  }
  for (const LandmarkId id : moved_) {
    const Eigen::Vector3d p_cam = frame.T_cam_world * map.FindLandmark(id)->p_world;
    if (const auto uv = camera_.Project(p_cam)) witnesses_.Add({*uv, p_cam.z(), true});
  }
  std::sort(known.begin(), known.end());
  gone_.clear();
  hidden_.clear();
  for (const auto& [id, view] : visible_) {
    if (std::binary_search(known.begin(), known.end(), id)) continue;
    int behind = 0, beside = 0, before = 0, moving_beside = 0;
    witnesses_.ForEachNear(view.uv_px, options_.seen_through_px,
                           [&, depth = view.depth](const Witness& witness) {
                             const bool farther = witness.depth > options_.seen_through_depth * depth;
                             const bool nearer = witness.depth * options_.seen_through_depth < depth;
                             if (witness.moves) {
                               if (!farther && !nearer) ++moving_beside;
                               if (nearer) ++before;
                               return;
                             }
                             ++(farther ? behind : nearer ? before : beside);
                           });
    const bool seen_through = behind >= options_.seen_through_min && beside == 0;
    const bool goes_with_others = moving_beside >= options_.moving_together_min && moving_beside > 2 * beside;
    if (seen_through || goes_with_others) {
      gone_.push_back(id);
    } else if (before > 0 && beside == 0) {
      hidden_.push_back(id);
    }
  }
}

void PoseTracker::CountEvidence(const Map& map, const TrackedFrame& frame) {
  for (const auto& [id, view] : visible_) {
    if (std::binary_search(hidden_.begin(), hidden_.end(), id)) continue;
    FrameEvidence::Item& item = evidence_[id];
    item.landmark = id;
    ++item.visible;
  }
  for (const LandmarkId id : moved_) {
    evidence_[id].landmark = id;
    ++evidence_[id].moved;
    ++recent_motion_[id].streak;
  }
  for (const LandmarkId id : gone_) {
    evidence_[id].landmark = id;
    ++evidence_[id].moved;
  }
  for (size_t i = 0; i < frame.landmarks.size(); ++i) {
    const LandmarkId id = frame.landmarks[i];
    const Landmark* landmark = id.valid() ? map.FindLandmark(id) : nullptr;
    if (landmark == nullptr) continue;
    FrameEvidence::Item& item = evidence_[id];
    if (item.visible == 0) item.visible = 1;
    item.landmark = id;
    ++item.found;
    recent_motion_.erase(id);
  }
}

TrackingReport PoseTracker::Summarize(const TrackedFrame& frame, int inliers, bool relocalized) const {
  TrackingReport report;
  std::array<int, kCellColumns * kCellRows> fixed{}, moving{};
  for (size_t i = 0; i < frame.classes.size(); ++i) {
    const size_t cell = CellOf(frame.features->uv_px[i], camera_);
    if (frame.classes[i] == FeatureClass::kUsed) {
      ++fixed[cell];
    } else if (frame.classes[i] == FeatureClass::kMoving) {
      ++moving[cell];
      ++report.num_moving;
    } else if (frame.classes[i] == FeatureClass::kRejected) {
      ++report.num_unknown;
    }
  }
  int occupied = 0, mostly_moving = 0;
  for (size_t cell = 0; cell < fixed.size(); ++cell) {
    if (fixed[cell] > 0) ++report.cells;
    if (fixed[cell] + moving[cell] > 0) ++occupied;
    if (moving[cell] > fixed[cell]) ++mostly_moving;
  }
  report.moving_share = occupied == 0 ? 0.0 : static_cast<double>(mostly_moving) / occupied;
  report.num_static = inliers;
  report.mean_chi2 = optimized_.mean_chi2;
  const int needed = relocalized ? options_.min_inliers_after_relocalization : options_.min_local_inliers;
  if (inliers < needed) {
    report.reason = "too few static features match the map";
  } else if (report.cells < options_.min_cells) {
    report.reason = "the static features lie in too small a part of the image";
  } else {
    report.ok = true;
  }
  return report;
}

int PoseTracker::TrackFromPrediction(const Map& map, const Rigid3d& T_predicted, TrackedFrame* frame) {
  std::erase_if(local_landmarks_, [&](LandmarkId id) { return map.FindLandmark(id) == nullptr; });
  frame->ClearMatches();
  frame->T_cam_world = T_predicted;
  SearchLocalLandmarks(map, kWiderAroundPrediction, frame);
  if (options_.motion_belief) DropMatchesOfHiddenPlaces(map, frame);
  return OptimizeMatches(map, frame);
}

TrackingReport PoseTracker::TrackLocalMap(const Map& map, bool relocalized, TrackedFrame* frame) {
  CollectLocalMap(map, *frame);
  SearchLocalLandmarks(map, relocalized ? kWiderAfterRelocalization : 1.0, frame);
  if (options_.motion_belief) DropMatchesOfHiddenPlaces(map, frame);
  const int inliers = OptimizeMatches(map, frame);
  FindMoved(map, frame);
  JudgeMissing(map, *frame);
  TrackingReport report = Summarize(*frame, inliers, relocalized);
  if (report.ok) CountEvidence(map, *frame);
  return report;
}

FrameEvidence PoseTracker::TakeEvidence(int64_t stamp_ns, MapId map_id) {
  FrameEvidence evidence;
  evidence.stamp_ns = stamp_ns;
  evidence.map_id = map_id;
  for (const auto& [id, item] : evidence_) evidence.items.push_back(item);
  std::sort(evidence.items.begin(), evidence.items.end(),
            [](const auto& a, const auto& b) { return a.landmark < b.landmark; });
  evidence_.clear();
  return evidence;
}

}  // namespace dmslam
