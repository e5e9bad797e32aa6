#include "dmslam/loops/loop_verifier.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstdio>
#include <map>

#include "dmslam/camera/image_cells.h"
#include "dmslam/camera/image_scale.h"
#include "dmslam/dynamics/motion_belief.h"
#include "dmslam/dynamics/proven.h"
#include "dmslam/loops/chain_drift.h"
#include "dmslam/loops/same_time.h"
#include "dmslam/map/conventions.h"
#include "dmslam/map/neighbourhood.h"
#include "dmslam/map/projection.h"
#include "dmslam/optimization/sim3_optimization.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int kPlaceNeighboursMatched = 5;
constexpr int kMaxPoseIterations = 1000;
constexpr size_t kMinDepthRatios = 5;
constexpr double kMaxScaleError = 0.03;  // standard error of a scale to be taken, as a share of it
constexpr ViewLimits kSurelySeen{.min_view_cos = 0.7, .distance_slack = 1.0, .border_px = 0};

/// What should be seen in each cell of the image, and is.
struct CellCounts {
  std::array<int, kNumCells> expected{}, found{};

  void Tell(PlaceSupport* support) const {
    constexpr int kSeveral = 3;
    constexpr double kGoodPart = 0.2;
    for (int cell = 0; cell < kCellColumns * kCellRows; ++cell) {
      const auto i = static_cast<size_t>(cell);
      if (expected[i] < kSeveral) continue;
      const int column = cell % kCellColumns, row = cell / kCellColumns;
      const int agrees = found[i] >= kGoodPart * expected[i] ? 1 : 0;
      ++support->anywhere.told;
      support->anywhere.agreeing += agrees;
      if (column > 0 && column + 1 < kCellColumns && row > 0 && row + 1 < kCellRows) continue;
      ++support->at_rim.told;
      support->at_rim.agreeing += agrees;
    }
  }
};

/// How a keyframe sees a landmark.
struct LandmarkSight {
  const Keyframe& keyframe;
  size_t feature;
  const Landmark& landmark;
};

/// A landmark of each keyframe that should be the same one.
Sim3Match MakeMatch(const Pyramid& pyramid, const LandmarkSight& a, const LandmarkSight& b) {
  Sim3Match match;
  match.p_cam1 = a.keyframe.T_cam_world * a.landmark.p_world;
  match.p_cam2 = b.keyframe.T_cam_world * b.landmark.p_world;
  match.uv1_px = a.keyframe.features->uv_px[a.feature];
  match.uv2_px = b.keyframe.features->uv_px[b.feature];
  match.inv_sigma_squared1 = 1.0 / a.keyframe.features->Variance(a.feature, pyramid);
  match.inv_sigma_squared2 = 1.0 / b.keyframe.features->Variance(b.feature, pyramid);
  return match;
}

/// The keyframe that sees most of what was found and is no neighbour of `keyframe`; null where there is none.
/// A few landmarks in common make no neighbour: local mapping may have fused some across the loop already.
const Keyframe* BestObserver(const Map& map, const Keyframe& keyframe, const SeenPlace& seen,
                             int min_covisibility) {
  std::map<KeyframeId, int> votes;
  const auto is_neighbour = [&](KeyframeId other) {
    const auto shared = keyframe.covisible.find(other);
    return other == keyframe.id || (shared != keyframe.covisible.end() && shared->second >= min_covisibility);
  };
  for (const LandmarkMatch& match : seen.matches) {
    for (const Observation& o : match.landmark->observations) {
      if (!is_neighbour(o.keyframe)) ++votes[o.keyframe];
    }
  }
  const auto best = std::max_element(votes.begin(), votes.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  return best == votes.end() ? nullptr : &map.At(best->first);
}

/// Where the camera has come back to nearly the same place, pixels do not tell the scale: the farther the
/// points, the farther the image, and nothing moves. The landmarks' distances do: the median of their ratios.
Sim3d WithScaleOfDepths(const std::vector<Sim3Match>& matches, const Sim3Report& report) {
  const Sim3d& S = report.S_cam1_cam2;
  std::vector<double> ratios;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!report.inliers[i]) continue;
    const Eigen::Vector3d ray = S.rotation * matches[i].p_cam2 + S.translation / S.scale;
    ratios.push_back(matches[i].p_cam1.dot(ray) / ray.squaredNorm());
  }
  const auto middle = ratios.begin() + static_cast<ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return Sim3d(S.rotation, S.translation * (*middle / S.scale), *middle);
}

/// How much larger the keyframe's own map is than the place's: from landmarks of both on the same features.
/// None where these are too few or do not agree.
std::optional<double> ScaleOfPairs(const Map& map, const Keyframe& keyframe, const Rigid3d& T_cam_world,
                                   const std::vector<LandmarkMatch>& matches) {
  std::vector<double> ratios;
  for (const LandmarkMatch& match : matches) {
    const Landmark* mine = map.LandmarkSeenBy(keyframe, match.feature);
    if (!IsStatic(mine)) continue;
    const double depth_mine = (keyframe.T_cam_world * mine->p_world).z();
    const double depth_theirs = (T_cam_world * match.landmark->p_world).z();
    if (depth_mine > 0 && depth_theirs > 0) ratios.push_back(depth_mine / depth_theirs);
  }
  if (ratios.size() < kMinDepthRatios) return std::nullopt;
  std::sort(ratios.begin(), ratios.end());
  const double median = ratios[ratios.size() / 2];
  const double quartiles = ratios[ratios.size() * 3 / 4] - ratios[ratios.size() / 4];
  const double error =
      0.93 * quartiles / std::sqrt(static_cast<double>(ratios.size()));  // of a normal median
  return error <= kMaxScaleError * median ? std::optional(median) : std::nullopt;
}

template <typename... Values>
std::string Text(const char* format, Values... values) {
  char text[240];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

/// The numbers, as a sentence.
std::string Describe(const VerifiedLoop& loop) {
  std::string text = Text(
      "%d of %d landmarks found in %d cells (%d of %d, rim %d of %d), share %.2f; proven %d of %d in %d, "
      "share %.2f",
      loop.support.found, loop.support.expected, loop.support.cells, loop.support.anywhere.agreeing,
      loop.support.anywhere.told, loop.support.at_rim.agreeing, loop.support.at_rim.told, loop.share,
      loop.proven.found, loop.proven.expected, loop.proven.cells, loop.proven_share);
  if (loop.counter_share)
    text += Text("; seen from there %d of %d, share %.2f", loop.counter.found, loop.counter.expected,
                 *loop.counter_share);
  if (loop.joins) text += loop.at_same_time ? "; two maps, at the same time" : "; two maps";
  text += Text("; scale %.3f", 1.0 / loop.S_keyframe_world.scale);
  if (loop.drift_sigmas) text += Text("; drift %.1f sigma", *loop.drift_sigmas);
  return text;
}

}  // namespace

std::vector<const Landmark*> StaticLandmarksAround(const Map& map, const Keyframe& keyframe, int neighbours,
                                                   int min_shared) {
  std::vector<const Keyframe*> around = map.BestCovisible(keyframe, neighbours, min_shared);
  around.push_back(&keyframe);
  std::vector<const Landmark*> landmarks = LandmarksSeenBy(map, around);
  KeepStatic(&landmarks);
  return landmarks;
}

std::optional<Sim3d> LoopVerifier::FirstSimilarity(const Map& map, const MapPlaces& places,
                                                   const Keyframe& keyframe, const Keyframe& place,
                                                   std::string* why) const {
  if (const auto similarity = SimilarityFromWords(map, places, keyframe, place, why)) return similarity;
  std::string why_not;
  const auto similarity = SimilarityFromFeatures(map, keyframe, place, &why_not);
  *why += "; " + why_not;
  return similarity;
}

/// Where the keyframe has few landmarks of its own yet, as behind people: its features against the landmarks
/// of the place and its neighbours, without words.
std::optional<Sim3d> LoopVerifier::SimilarityFromFeatures(const Map& map, const Keyframe& keyframe,
                                                          const Keyframe& place, std::string* why) const {
  const std::vector<LandmarkMatch> matches =
      MatchLandmarks(StaticLandmarksAround(map, place, kPlaceNeighboursMatched, options_.min_covisibility),
                     keyframe.features->set);
  const bool one_map = keyframe.map_id == place.map_id;
  if (one_map) return SimilarityFromPose(map, keyframe, place, matches, 1.0, options_.min_pose_inliers, why);
  return SimilarityFromPose(map, keyframe, place, matches, {}, options_.joining.min_pose_inliers, why);
}

/// Landmarks of the place on features of the keyframe give its pose; features that show landmarks of both
/// tell the scale, and where they are too few, `scale` is taken, if it is known: within one map the drift is
/// small, and what the loop joins corrects it in the adjustment that follows.
std::optional<Sim3d> LoopVerifier::SimilarityFromPose(const Map& map, const Keyframe& keyframe,
                                                      const Keyframe& place,
                                                      std::vector<LandmarkMatch> matches,
                                                      std::optional<double> scale, int min_inliers,
                                                      std::string* why) const {
  std::erase_if(matches, [&](const LandmarkMatch& match) {
    const Landmark* mine = map.LandmarkSeenBy(keyframe, match.feature);
    return mine != nullptr && !IsStatic(mine);
  });
  PoseRansacOptions options;
  options.min_inliers = min_inliers;
  options.max_iterations = kMaxPoseIterations;
  options.seed = DeriveSeed(seed_, keyframe.id.frame_index(), "loop_pose");
  const auto pose = PoseFromLandmarks(map, *keyframe.features, matches, options);
  if (!pose.success) {
    *why = Text("%d of %zu landmarks agree on a pose", pose.num_inliers, matches.size());
    return std::nullopt;
  }
  std::vector<LandmarkMatch> agreeing;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (pose.inliers[i]) agreeing.push_back(matches[i]);
  }
  if (const auto measured = ScaleOfPairs(map, keyframe, pose.model, agreeing)) scale = measured;
  if (!scale) {
    *why = Text("too few of %zu landmarks tell the scale of the two maps", agreeing.size());
    return std::nullopt;
  }
  const double s = *scale;
  return Sim3d(pose.model.rotation, pose.model.translation * s, s) * Sim3d(place.T_cam_world).Inverse();
}

std::optional<Sim3d> LoopVerifier::SimilarityFromWords(const Map& map, const MapPlaces& places,
                                                       const Keyframe& keyframe, const Keyframe& place,
                                                       std::string* why) const {
  const std::vector<uint8_t> usable1 = StaticFeatures(map, keyframe), usable2 = StaticFeatures(map, place);
  const std::vector<BowMatch> pairs =
      MatchByNodes({&keyframe.features->set, places.Nodes(keyframe.id), usable1},
                   {&place.features->set, places.Nodes(place.id), usable2});
  if (static_cast<int>(pairs.size()) < options_.min_word_matches) {
    *why = Text("%zu matches by words", pairs.size());
    return std::nullopt;
  }
  std::vector<Sim3Match> matches;
  for (const BowMatch& pair : pairs) {
    matches.push_back(MakeMatch(map.pyramid(), {keyframe, pair.a, *map.LandmarkSeenBy(keyframe, pair.a)},
                                {place, pair.b, *map.LandmarkSeenBy(place, pair.b)}));
  }
  Sim3RansacOptions options;
  options.min_inliers = options_.min_sim3_inliers;
  options.seed = DeriveSeed(seed_, keyframe.id.frame_index(), "loop");
  const Pinhole camera = map.camera().Ideal();
  const Sim3Report report = EstimateSim3Ransac(camera, camera, matches, options);
  if (!report.success) {
    *why = Text("%d of %zu matches agree on a similarity", report.num_inliers, matches.size());
    return std::nullopt;
  }
  return report.S_cam1_cam2;
}

/// Landmarks of the place, looked for where the similarity says, with what the keyframe itself sees there:
/// pairs of landmarks, of which both sides must agree.
std::optional<Sim3d> LoopVerifier::RefinedSimilarity(const Map& map, const Keyframe& keyframe,
                                                     const Keyframe& place, const Sim3d& S_keyframe_place,
                                                     std::string* why) const {
  std::vector<const Landmark*> theirs = LandmarksSeenBy(map, std::vector{&place});
  KeepStatic(&theirs);
  const Rigid3d T_cam_world = (S_keyframe_place * Sim3d(place.T_cam_world)).ToRigid();
  const SeenPlace seen =
      Look(map, keyframe, T_cam_world, theirs, SearchRadiusPx(map.camera(), options_.search_radius_rad));
  std::vector<Sim3Match> matches;
  for (const auto& [feature, landmark] : seen.matches) {
    const Landmark* mine = map.LandmarkSeenBy(keyframe, feature);
    if (!IsStatic(mine)) continue;
    matches.push_back(MakeMatch(map.pyramid(), {keyframe, feature, *mine},
                                {place, landmark->SeenBy(place.id)->feature, *landmark}));
  }
  const Pinhole camera = map.camera().Ideal();
  Sim3OptimizationOptions options;
  options.min_inliers = options_.min_sim3_inliers;
  Sim3Report report = OptimizeSim3(camera, camera, matches, S_keyframe_place, options);
  if (report.success) {
    options.fix_scale = true;
    report = OptimizeSim3(camera, camera, matches, WithScaleOfDepths(matches, report), options);
  }
  if (report.success) return report.S_cam1_cam2;
  const std::string pairs =
      Text("%d of %zu pairs of landmarks agree on both sides", report.num_inliers, matches.size());
  const bool joins = keyframe.map_id != place.map_id;
  if (static_cast<int>(matches.size()) >= options_.min_sim3_inliers && !joins) {
    *why = pairs;
    return std::nullopt;
  }
  const int enough = joins ? options_.joining.min_pose_inliers : options_.min_pose_inliers;
  const auto similarity =
      SimilarityFromPose(map, keyframe, place, seen.matches, S_keyframe_place.scale, enough, why);
  if (!similarity) *why = pairs + "; " + *why;
  return similarity;
}

SeenPlace LoopVerifier::Look(const Map& map, const Keyframe& keyframe, const Rigid3d& T_cam_world,
                             const std::vector<const Landmark*>& landmarks, double radius_px) const {
  SeenPlace seen;
  std::vector<uint8_t> taken(keyframe.features->size(), 0);
  std::bitset<kCellColumns * kCellRows> cells;
  CellCounts counts;
  const Viewpoint viewpoint(T_cam_world);
  for (const Landmark* landmark : landmarks) {
    const std::optional<LandmarkView> view = PredictView(map, *landmark, viewpoint, kSurelySeen);
    if (!view) continue;
    ++seen.support.expected;
    const size_t cell = CellOf(map.camera(), view->uv_px);
    ++counts.expected[cell];
    const std::optional<FeatureHit> hit =
        FindFeature(*keyframe.features, view->uv_px, radius_px * map.pyramid().SearchScale(view->octave),
                    std::max(0, view->octave - 1), view->octave + 1, landmark->descriptor, taken);
    if (!hit || hit->distance > options_.max_descriptor_distance) continue;
    const size_t feature = static_cast<size_t>(hit->feature);
    taken[feature] = 1;
    seen.matches.push_back({static_cast<uint16_t>(feature), landmark});
    cells.set(CellOf(map.camera(), keyframe.features->uv_px[feature]));
    ++counts.found[cell];
  }
  counts.Tell(&seen.support);
  std::ranges::sort(seen.matches, {}, &LandmarkMatch::feature);
  seen.support.found = static_cast<int>(seen.matches.size());
  seen.support.cells = static_cast<int>(cells.count());
  return seen;
}

VerifiedLoop LoopVerifier::Measure(const Map& map, const Keyframe& keyframe, const Keyframe& place,
                                   const Sim3d& S_keyframe_place, std::string* why) const {
  VerifiedLoop loop;
  loop.keyframe = &keyframe;
  loop.place = &place;
  loop.S_keyframe_place = S_keyframe_place;
  loop.S_keyframe_world = S_keyframe_place * Sim3d(place.T_cam_world);
  loop.joins = keyframe.map_id != place.map_id;
  loop.at_same_time = AreAtSameTime(keyframe, place, options_.same_time_s);
  loop.landmarks = StaticLandmarksAround(map, place, kPlaceNeighbours, options_.min_covisibility);
  const double radius_px = SearchRadiusPx(map.camera(), options_.search_radius_rad);
  loop.support = Look(map, keyframe, loop.S_keyframe_world.ToRigid(), loop.landmarks, radius_px).support;
  const std::vector<const Landmark*> around =
      StaticLandmarksAround(map, keyframe, kPlaceNeighbours, options_.min_covisibility);
  const PlaceSupport own = Look(map, keyframe, keyframe.T_cam_world, around, radius_px).support;
  loop.share = loop.support.ShareOver(own);
  MeasureProven(map, around, own, &loop);
  const auto drift = DriftAlongChain(map, place, keyframe, options_.drift);
  if (drift) loop.drift_sigmas = SigmasOf(*drift, keyframe.T_cam_world, loop.S_keyframe_world);
  *why = Describe(loop);
  if (drift) *why += Text(" (%d links, sigma %.3f)", drift->links, drift->position);
  return loop;
}

/// What outlasts people, asked from both sides: of the place in the keyframe, and of the keyframe's
/// surroundings (`around`, of which it shows `own`) in the place's keyframe.
void LoopVerifier::MeasureProven(const Map& map, const std::vector<const Landmark*>& around,
                                 const PlaceSupport& own, VerifiedLoop* loop) const {
  const double radius_px = SearchRadiusPx(map.camera(), options_.search_radius_rad);
  const auto look = [&](const Keyframe& keyframe, const Rigid3d& T_cam_world,
                        const std::vector<const Landmark*>& landmarks) {
    return Look(map, keyframe, T_cam_world, landmarks, radius_px).support;
  };
  const Keyframe &keyframe = *loop->keyframe, &place = *loop->place;
  const std::vector<const Landmark*> here = ProvenOf(map, around), there = ProvenOf(map, loop->landmarks);
  const PlaceSupport own_here = look(keyframe, keyframe.T_cam_world, here);
  PlaceSupport own_there = look(place, place.T_cam_world, there);
  // A young map has nothing that is proven: then by all that stands there.
  if (loop->joins && own_there.expected < options_.min_told)
    own_there = look(place, place.T_cam_world, loop->landmarks);
  loop->proven = look(keyframe, loop->S_keyframe_world.ToRigid(), there);
  loop->proven_share = loop->proven.ShareOver(own_here.expected >= options_.min_told ? own_here : own);
  const Sim3d S_place_world = loop->S_keyframe_place.Inverse() * Sim3d(keyframe.T_cam_world);
  loop->counter = look(place, S_place_world.ToRigid(), here);
  if (loop->counter.expected >= options_.min_told) loop->counter_share = loop->counter.ShareOver(own_there);
}

std::vector<const Landmark*> LoopVerifier::ProvenOf(const Map& map,
                                                    std::vector<const Landmark*> landmarks) const {
  std::erase_if(landmarks,
                [&](const Landmark* landmark) { return !IsProven(map, *landmark, options_.proven); });
  return landmarks;
}

/// Seen all over the image and around whoever may stand in it, and nothing that outlasts people says
/// otherwise.
bool LoopVerifier::FillsTheImage(const VerifiedLoop& loop) const {
  const PlaceSupport& seen = loop.support;
  const bool contradicted =
      loop.proven.expected >= options_.min_told / 2 && loop.proven_share < options_.min_share;
  return !contradicted &&
         seen.anywhere.Hold(options_.joining.min_filled_cells, options_.joining.min_filled_share) &&
         seen.at_rim.Hold(options_.joining.min_filled_rim_cells, options_.joining.min_filled_share);
}

bool LoopVerifier::IsMuchProven(const PlaceSupport& proven, double share, double min_share) const {
  return proven.found >= options_.min_proven && proven.cells >= options_.min_proven_cells &&
         share >= min_share;
}

/// Within one map only what is proven around the place says so. Between two either side may: one of them may
/// be too young to have anything proven. Where both are, the place must fill the image. At the same time
/// somebody who stands there is as good as a wall.
bool LoopVerifier::IsNoPerson(const VerifiedLoop& loop, double min_share) const {
  if (options_.min_proven == 0 || IsMuchProven(loop.proven, loop.proven_share, min_share)) return true;
  return loop.joins &&
         (loop.at_same_time || IsMuchProven(loop.counter, loop.counter_share.value_or(0.0), min_share) ||
          FillsTheImage(loop));
}

bool LoopVerifier::Holds(const VerifiedLoop& loop, double min_share) const {
  const bool seen = loop.support.found >= options_.min_matches && loop.support.cells >= options_.min_cells &&
                    loop.share >= min_share;
  const bool agreed = loop.counter_share.value_or(1.0) >= min_share;
  const bool plausible = loop.drift_sigmas.value_or(0.0) <= options_.max_drift_sigmas;
  return seen && IsNoPerson(loop, min_share) && agreed && plausible;
}

/// Most of what should be seen is, or, where people hide the rest, much of what is proven.
bool LoopVerifier::HoldsBetweenMaps(const VerifiedLoop& loop) const {
  const bool much_is_proven = loop.proven.found >= options_.joining.min_proven &&
                              loop.proven.cells >= options_.min_cells &&
                              loop.proven_share >= options_.joining.min_proven_share;
  return Holds(loop, options_.joining.min_share) || (much_is_proven && Holds(loop, options_.min_share));
}

bool LoopVerifier::HoldsAmongOthers(const VerifiedLoop& loop) const {
  const bool is_room = FillsTheImage(loop) || IsMuchProven(loop.proven, loop.proven_share,
                                                           options_.joining.min_proven_share_among_others);
  return HoldsBetweenMaps(loop) || (is_room && Holds(loop, options_.min_confirmed_share));
}

std::optional<VerifiedLoop> LoopVerifier::Propose(const Map& map, const MapPlaces& places,
                                                  const Keyframe& keyframe, const Keyframe& place,
                                                  std::string* why) const {
  const std::optional<Sim3d> first = FirstSimilarity(map, places, keyframe, place, why);
  if (!first) return std::nullopt;
  const std::optional<Sim3d> refined = RefinedSimilarity(map, keyframe, place, *first, why);
  if (!refined) return std::nullopt;
  VerifiedLoop loop = Measure(map, keyframe, place, *refined, why);
  if (!Holds(loop, options_.min_share)) return std::nullopt;
  return loop;
}

std::optional<VerifiedLoop> LoopVerifier::Confirm(const Map& map, const Keyframe& keyframe,
                                                  const LoopClaim& earlier, std::string* why) const {
  const Keyframe* before = map.FindKeyframe(earlier.keyframe);
  const Keyframe* place_before = map.FindKeyframe(earlier.place);
  if (before == nullptr || place_before == nullptr || before->map_id != keyframe.map_id) {
    *why = "the keyframes of the proposal are gone";
    return std::nullopt;
  }
  const Sim3d S_before_world = earlier.S_keyframe_place * Sim3d(place_before->T_cam_world);
  const Sim3d S_keyframe_world = Sim3d(keyframe.T_cam_world * before->T_cam_world.Inverse()) * S_before_world;
  const SeenPlace seen =
      Look(map, keyframe, S_keyframe_world.ToRigid(),
           StaticLandmarksAround(map, *place_before, kPlaceNeighbours, options_.min_covisibility),
           2 * SearchRadiusPx(map.camera(), options_.search_radius_rad));
  const Keyframe* place = BestObserver(map, keyframe, seen, options_.min_covisibility);
  if (place == nullptr) {
    *why = "nothing of the place is seen";
    return std::nullopt;
  }
  const Sim3d S_keyframe_place = S_keyframe_world * Sim3d(place->T_cam_world).Inverse();
  const std::optional<Sim3d> refined = RefinedSimilarity(map, keyframe, *place, S_keyframe_place, why);
  if (!refined) return std::nullopt;
  VerifiedLoop loop = Measure(map, keyframe, *place, *refined, why);
  if (!(loop.joins ? HoldsBetweenMaps(loop) : Holds(loop, options_.min_confirmed_share))) return std::nullopt;
  return loop;
}

}  // namespace dmslam
