#include "frontend/relocalizer.h"

#include <algorithm>
#include <optional>

#include "dmslam/robust/pose_from_matches.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr size_t kMaxCandidates = 8;
constexpr size_t kMinWordMatches = 15;
constexpr int kMinInliers = 12;
constexpr int kMinCovisibility = 15;
constexpr int kNeighboursOfLast = 4;

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
  if (matches.size() < kMinWordMatches) return false;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<double> inv_sigma_squared;
  for (const BowMatch& match : matches) {
    points.push_back(map.FindLandmark(keyframe.landmarks[match.a])->p_world);
    pixels.push_back(frame->features->uv_px[match.b]);
    inv_sigma_squared.push_back(1.0 / pyramid_.SigmaSquared(frame->features->set.keypoints[match.b].octave));
  }
  PoseRansacOptions options;
  options.seed = DeriveSeed(seed, keyframe.id.frame_index(), "relocalize");
  options.min_inliers = kMinInliers;
  const auto report = PoseFromMatches(camera_.Ideal(), points, pixels, inv_sigma_squared, options);
  if (!report.success) return false;
  frame->ClearMatches();
  frame->T_cam_world = report.model;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (report.inliers[i]) frame->landmarks[matches[i].b] = keyframe.landmarks[matches[i].a];
  }
  return true;
}

bool Relocalizer::Relocalize(const Map& map, MapId map_id, KeyframeId last_seen, uint64_t seed,
                             PoseTracker* tracker, TrackedFrame* frame) const {
  if (!places_.usable()) return false;
  const BowImage image = places_.Transform(frame->features->set);
  for (const KeyframeId id : Candidates(map, map_id, last_seen, image)) {
    if (!TryKeyframe(map, *map.FindKeyframe(id), image, seed, frame)) continue;
    if (tracker->TrackLocalMap(map, true, frame).ok) return true;
  }
  return false;
}

}  // namespace dmslam
