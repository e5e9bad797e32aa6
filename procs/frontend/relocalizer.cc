#include "frontend/relocalizer.h"

#include <algorithm>
#include <optional>

#include "dmslam/features/matcher.h"
#include "dmslam/robust/pose_from_matches.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr size_t kMaxCandidates = 8;
constexpr size_t kMinMatches = 15;
constexpr int kMinInliers = 12;
constexpr int kMaxIterations = 1000;
constexpr int kMinCovisibility = 15;
constexpr int kNeighboursOfLast = 4;
constexpr int kMaxRounds = 4;  // of the search in the local map
// Where no single keyframe gives enough matches: what the first places and the
// keyframe seen last show together with their neighbours.
constexpr ptrdiff_t kPlacesTogether = 3;
constexpr int kNeighboursTogether = 5;
constexpr MatchOptions kMatchTogether = {.max_ratio = 0.8, .check_orientation = false};

}  // namespace

Relocalizer::Relocalizer(std::shared_ptr<const Vocabulary> vocabulary, const Camera& camera,
                         const Pyramid& pyramid)
    : camera_(camera), pyramid_(pyramid), places_(std::move(vocabulary)) {}

void Relocalizer::Clear() { places_.Clear(); }

void Relocalizer::Update(const Map& map) { places_.Update(map); }

std::vector<KeyframeId> Relocalizer::Candidates(const Map& map, MapId map_id, KeyframeId last_seen,
                                                const BowImage& image) const {
  const auto of_another_map = [&](const Keyframe& keyframe) {
    return map_id != 0 && keyframe.map_id != map_id;
  };
  std::vector<KeyframeId> ids;
  for (const PlaceCandidate& candidate :
       places_.Query(map, image.words, 0.0, kMinCovisibility, of_another_map)) {
    if (ids.size() < kMaxCandidates) ids.push_back(candidate.keyframe);
  }
  const auto add = [&](KeyframeId id) {
    if (std::find(ids.begin(), ids.end(), id) == ids.end()) ids.push_back(id);
  };
  if (const std::optional<KeyframeId> last = map.ResolveKeyframe(last_seen)) {
    add(*last);
    for (const KeyframeId id : map.BestCovisible(*last, kNeighboursOfLast, kMinCovisibility)) add(id);
  }
  return ids;
}

bool Relocalizer::TryKeyframe(const Map& map, const Keyframe& keyframe, const BowImage& image, uint64_t seed,
                              TrackedFrame* frame) const {
  const std::vector<uint8_t> usable = StaticFeatures(map, keyframe);
  const std::vector<BowMatch> matches =
      MatchByNodes({&keyframe.features->set, places_.Nodes(keyframe.id), usable},
                   {&frame->features->set, &image.nodes, {}});
  std::vector<Match> seen;
  for (const BowMatch& match : matches) seen.push_back({keyframe.landmarks[match.a], match.b});
  return FindPose(map, seen, DeriveSeed(seed, keyframe.id.frame_index(), "relocalize"), frame);
}

bool Relocalizer::TryTogether(const Map& map, const std::vector<KeyframeId>& places, uint64_t seed,
                              TrackedFrame* frame) const {
  std::vector<LandmarkId> ids;
  for (const KeyframeId place : places) {
    std::vector<KeyframeId> around = map.BestCovisible(place, kNeighboursTogether, kMinCovisibility);
    around.push_back(place);
    for (const KeyframeId id : around) {
      for (const LandmarkId landmark : map.FindKeyframe(id)->landmarks) {
        if (landmark.valid() && IsStatic(map.FindLandmark(landmark))) ids.push_back(landmark);
      }
    }
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  std::vector<Descriptor> descriptors;
  for (const LandmarkId id : ids) descriptors.push_back(map.FindLandmark(id)->descriptor);
  std::vector<FeatureMatch> matches;
  const std::vector<Keypoint> anywhere(ids.size());
  FeatureMatcher().MatchAll({anywhere, descriptors},
                            {frame->features->set.keypoints, frame->features->set.descriptors},
                            kMatchTogether, &matches);
  std::vector<Match> seen;
  for (const FeatureMatch& match : matches) seen.push_back({ids[match.index0], match.index1});
  return FindPose(map, seen, DeriveSeed(seed, frame->index, "relocalize_together"), frame);
}

/// The pose on which most of the matches agree, with those that do.
bool Relocalizer::FindPose(const Map& map, const std::vector<Match>& matches, uint64_t seed,
                           TrackedFrame* frame) const {
  if (matches.size() < kMinMatches) return false;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<double> inv_sigma_squared;
  for (const Match& match : matches) {
    points.push_back(map.FindLandmark(match.landmark)->p_world);
    pixels.push_back(frame->features->uv_px[match.feature]);
    inv_sigma_squared.push_back(1.0 /
                                pyramid_.SigmaSquared(frame->features->set.keypoints[match.feature].octave));
  }
  PoseRansacOptions options;
  options.seed = seed;
  options.min_inliers = kMinInliers;
  options.max_iterations = kMaxIterations;
  const auto report = PoseFromMatches(camera_.Ideal(), points, pixels, inv_sigma_squared, options);
  if (!report.success) return false;
  frame->ClearMatches();
  frame->T_cam_world = report.model;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (report.inliers[i]) frame->landmarks[matches[i].feature] = matches[i].landmark;
  }
  return true;
}

/// Against the local map, and again from there as long as each round finds more
/// of it: the matches with one keyframe alone may put the camera a little
/// beside its place, where the first search misses much.
bool Relocalizer::Refine(const Map& map, PoseTracker* tracker, TrackedFrame* frame) {
  int found = 0;
  for (int round = 0; round < kMaxRounds; ++round) {
    const TrackingReport report = tracker->TrackLocalMap(map, true, frame);
    if (report.ok) return true;
    if (report.num_static <= found) return false;
    found = report.num_static;
  }
  return false;
}

bool Relocalizer::Relocalize(const Map& map, MapId map_id, KeyframeId last_seen, uint64_t seed,
                             PoseTracker* tracker, TrackedFrame* frame) const {
  if (!places_.usable()) return false;
  const BowImage image = places_.Transform(frame->features->set);
  const std::vector<KeyframeId> candidates = Candidates(map, map_id, last_seen, image);
  for (const KeyframeId id : candidates) {
    if (!TryKeyframe(map, *map.FindKeyframe(id), image, seed, frame)) continue;
    if (Refine(map, tracker, frame)) return true;
  }
  std::vector<KeyframeId> places(
      candidates.begin(), candidates.begin() + std::min<ptrdiff_t>(kPlacesTogether, std::ssize(candidates)));
  if (const std::optional<KeyframeId> last = map.ResolveKeyframe(last_seen)) places.push_back(*last);
  return TryTogether(map, places, seed, frame) && Refine(map, tracker, frame);
}

}  // namespace dmslam
