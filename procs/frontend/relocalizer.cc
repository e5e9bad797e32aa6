#include "frontend/relocalizer.h"

#include "dmslam/optimization/pose_optimization.h"
#include "dmslam/robust/pose_from_matches.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr size_t kMaxCandidates = 8;
constexpr size_t kMinWordMatches = 15;
constexpr int kMinInliers = 12;

}  // namespace

Relocalizer::Relocalizer(std::shared_ptr<const Vocabulary> vocabulary, const Camera& camera, const Pyramid& pyramid)
    : vocabulary_(std::move(vocabulary)), camera_(camera), pyramid_(pyramid) {}

void Relocalizer::Clear() {
  database_.Clear();
  nodes_.clear();
}

void Relocalizer::Update(const Map& map) {
  if (!vocabulary_) return;
  for (const KeyframeId id : map.applied_removed_keyframes()) {
    database_.Remove(id);
    nodes_.erase(id);
  }
  for (const KeyframeId id : map.applied_new_keyframes()) {
    const Keyframe* keyframe = map.FindKeyframe(id);
    if (keyframe == nullptr) continue;
    BowImage image = vocabulary_->Transform(keyframe->features->set.descriptors);
    database_.Add(id, std::move(image.words));
    nodes_[id] = std::move(image.nodes);
  }
}

std::vector<KeyframeId> Relocalizer::Candidates(const Map& map, MapId map_id, const BowImage& image) const {
  PlaceQuery query;
  query.excluded = [&](KeyframeId id) {
    const Keyframe* keyframe = map.FindKeyframe(id);
    return keyframe == nullptr || (map_id != 0 && keyframe->map_id != map_id);
  };
  query.neighbours = [&](KeyframeId id) { return map.BestCovisible(id, 10, 15); };
  std::vector<KeyframeId> ids;
  for (const PlaceCandidate& candidate : database_.Query(image.words, query)) {
    if (ids.size() < kMaxCandidates) ids.push_back(candidate.keyframe);
  }
  return ids;
}

bool Relocalizer::TryKeyframe(const Map& map, const Keyframe& keyframe, const BowImage& image, uint64_t seed,
                              TrackedFrame* frame) const {
  std::vector<uint8_t> usable(keyframe.landmarks.size(), 0);
  for (size_t i = 0; i < usable.size(); ++i) {
    const Landmark* landmark = keyframe.landmarks[i].valid() ? map.FindLandmark(keyframe.landmarks[i]) : nullptr;
    usable[i] = landmark != nullptr && landmark->evidence.motion_belief <= 0.0F;
  }
  const std::vector<BowMatch> matches = MatchByNodes({&keyframe.features->set, &nodes_.at(keyframe.id), usable},
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
  options.seed = DeriveSeed(seed, keyframe.id.value, "relocalize");
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

bool Relocalizer::Relocalize(const Map& map, MapId map_id, uint64_t seed, PoseTracker* tracker, TrackedFrame* frame) const {
  if (!vocabulary_) return false;
  const BowImage image = vocabulary_->Transform(frame->features->set.descriptors);
  for (const KeyframeId id : Candidates(map, map_id, image)) {
    if (!TryKeyframe(map, *map.FindKeyframe(id), image, seed, frame)) continue;
    if (tracker->TrackLocalMap(map, true, frame).ok) return true;
  }
  return false;
}

}  // namespace dmslam
