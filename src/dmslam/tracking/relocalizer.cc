#include "dmslam/tracking/relocalizer.h"

#include <algorithm>
#include <optional>

#include "dmslam/dynamics/motion_belief.h"
#include "dmslam/dynamics/proven.h"
#include "dmslam/map/conventions.h"
#include "dmslam/map/neighbourhood.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr size_t kMaxCandidates = 8;
constexpr size_t kMinMatches = 15;
constexpr int kMinInliers = 12;
constexpr int kMinUnmappedInliers = 20;  // there are more matches, so more agree by chance
constexpr int kMaxIterations = 1000;
constexpr int kNeighboursOfLast = 4;
constexpr int kMaxRounds = 4;  // of the search in the local map
// Where no single keyframe gives enough matches: what the first places and the
// keyframe seen last show together with their neighbours.
constexpr ptrdiff_t kPlacesTogether = 3;
constexpr int kNeighboursTogether = 5;
// Of places together: so many landmarks that are proven to be no person speak alone (of one: kManyProven).
constexpr ptrdiff_t kEnoughProvenTogether = 150;

/// One entry per feature of a keyframe: 1 where it sees a landmark that may say where the camera is.
std::vector<uint8_t> SpeakingFeatures(const Map& map, const Keyframe& keyframe) {
  const std::vector<uint8_t> still = StaticFeatures(map, keyframe);
  std::vector<uint8_t> proven = still;
  for (size_t i = 0; i < proven.size(); ++i) {
    if (proven[i] != 0) proven[i] = IsProven(map, map.At(keyframe.landmarks[i]), {}) ? 1 : 0;
  }
  return std::count(proven.begin(), proven.end(), 1) >= kManyProven ? proven : still;
}

}  // namespace

Relocalizer::Relocalizer(std::shared_ptr<const Vocabulary> vocabulary) : places_(std::move(vocabulary)) {}

void Relocalizer::Clear() {
  places_.Clear();
  unmapped_.Clear();
}

void Relocalizer::Update(const Replica& map) {
  places_.Update(map);
  unmapped_.Clear();
}

std::vector<KeyframeId> Relocalizer::Candidates(const Map& map, const Keyframe* last,
                                                const BowImage& image) const {
  const auto none = [](const Keyframe&) { return false; };
  std::vector<KeyframeId> ids;
  for (const PlaceCandidate& candidate : places_.Query(map, image.words, 0.0, kMinCovisibility, none)) {
    if (ids.size() < kMaxCandidates) ids.push_back(candidate.keyframe);
  }
  const auto add = [&](KeyframeId id) {
    if (std::find(ids.begin(), ids.end(), id) == ids.end()) ids.push_back(id);
  };
  if (last != nullptr) {
    add(last->id);
    for (const Keyframe* beside : map.BestCovisible(*last, kNeighboursOfLast, kMinCovisibility))
      add(beside->id);
  }
  return ids;
}

bool Relocalizer::TryKeyframe(const Map& map, const Keyframe& keyframe, const BowImage& image, uint64_t seed,
                              TrackedFrame* frame) const {
  const std::vector<uint8_t> usable = SpeakingFeatures(map, keyframe);
  const std::vector<BowMatch> matches =
      MatchByNodes({&keyframe.features->set, places_.Nodes(keyframe.id), usable},
                   {&frame->features->set, &image.nodes, {}});
  std::vector<LandmarkMatch> seen;
  seen.reserve(matches.size());
  for (const BowMatch& match : matches)
    seen.push_back({static_cast<uint16_t>(match.b), map.LandmarkSeenBy(keyframe, match.a)});
  const uint64_t own_seed = DeriveSeed(seed, keyframe.id.frame_index(), "relocalize");
  return FindPose(map, seen, {kMinInliers, own_seed}, frame);
}

bool Relocalizer::TryTogether(const Map& map, const std::vector<KeyframeId>& places, uint64_t seed,
                              TrackedFrame* frame) const {
  std::vector<const Keyframe*> keyframes;
  for (const KeyframeId id : places) {
    const Keyframe& place = map.At(id);
    keyframes.push_back(&place);
    for (const Keyframe* neighbour : map.BestCovisible(place, kNeighboursTogether, kMinCovisibility))
      keyframes.push_back(neighbour);
  }
  std::vector<const Landmark*> landmarks = LandmarksSeenBy(map, keyframes);
  KeepStatic(&landmarks);
  std::vector<const Landmark*> proven = landmarks;
  std::erase_if(proven, [&](const Landmark* landmark) { return !IsProven(map, *landmark, {}); });
  if (std::ssize(proven) >= kEnoughProvenTogether) landmarks = std::move(proven);
  const std::vector<LandmarkMatch> seen = MatchLandmarks(landmarks, frame->features->set);
  return FindPose(map, seen, {kMinInliers, DeriveSeed(seed, frame->index, "relocalize_together")}, frame);
}

bool Relocalizer::TryUnmapped(const Map& map, const Keyframe& keyframe, uint64_t seed, TrackedFrame* frame) {
  std::vector<const Landmark*> points = LandmarksSeenBy(map, {&keyframe});
  KeepStatic(&points);
  for (const Landmark& point : unmapped_.Of(map, keyframe)) points.push_back(&point);
  const std::vector<LandmarkMatch> seen = MatchLandmarks(points, frame->features->set);
  const uint64_t own_seed = DeriveSeed(seed, keyframe.id.frame_index(), "relocalize_unmapped");
  return FindPose(map, seen, {kMinUnmappedInliers, own_seed}, frame);
}

/// The pose on which most of the matches agree, with those of them that show landmarks.
bool Relocalizer::FindPose(const Map& map, const std::vector<LandmarkMatch>& matches, const Vote& vote,
                           TrackedFrame* frame) const {
  if (matches.size() < kMinMatches) return false;
  PoseRansacOptions options;
  options.seed = vote.seed;
  options.min_inliers = vote.min_inliers;
  options.max_iterations = kMaxIterations;
  const auto report = PoseFromLandmarks(map, *frame->features, matches, options);
  if (!report.success) return false;
  frame->ClearMatches();
  frame->T_cam_world = report.model;
  for (size_t i = 0; i < matches.size(); ++i) {
    const LandmarkId id = matches[i].landmark->id;
    if (report.inliers[i] && id.valid()) frame->landmarks[matches[i].feature] = id;
  }
  return true;
}

/// Against the local map, and again from there as long as each round finds more
/// of it: the matches with one keyframe alone may put the camera a little
/// beside its place, where the first search misses much.
std::optional<TrackingReport> Relocalizer::Refine(const Map& map, PoseSearch* search, TrackedFrame* frame) {
  int found = 0;
  for (int round = 0; round < kMaxRounds; ++round) {
    const TrackingReport report = search->InLocalMap(map, true, std::nullopt, frame);
    if (report.IsTracked()) return report;
    if (report.num_static <= found) return std::nullopt;
    found = report.num_static;
  }
  return std::nullopt;
}

bool Relocalizer::Relocalize(const Map& map, const Request& request, PoseSearch* search,
                             TrackedFrame* frame) {
  if (!places_.usable()) return false;
  const auto fits = [&](bool may_be_chance) {
    const std::optional<TrackingReport> report = Refine(map, search, frame);
    return report && (may_be_chance || !report->MayMatchByChance()) &&
           (!request.credible || request.credible(*frame, *report));
  };
  const BowImage image = places_.Transform(frame->features->set);
  const Keyframe* last = request.last_seen ? map.Resolve(*request.last_seen) : nullptr;
  const std::vector<KeyframeId> candidates = Candidates(map, last, image);
  for (const KeyframeId id : candidates) {
    if (TryKeyframe(map, map.At(id), image, request.seed, frame) && fits(true)) return true;
  }
  std::vector<KeyframeId> places(
      candidates.begin(), candidates.begin() + std::min<ptrdiff_t>(kPlacesTogether, std::ssize(candidates)));
  if (last != nullptr && std::ranges::find(places, last->id) == places.end()) places.push_back(last->id);
  if (TryTogether(map, places, request.seed, frame) && fits(true)) return true;
  if (!request.by_unmapped || places.empty()) return false;
  // It takes long, so the places take turns from frame to frame. The pose rests on what is no landmark: what
  // matches by chance must not confirm it.
  const Keyframe& place = map.At(places[frame->index % places.size()]);
  return TryUnmapped(map, place, request.seed, frame) && fits(false);
}

}  // namespace dmslam
