#include "evaluate.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "dmslam/dataset/image.h"
#include "dmslam/dataset/trajectory.h"
#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/features/orb_extractor.h"
#include "dmslam/place_recognition/keyframe_database.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/robust/two_view_ransac.h"
#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int64_t kPoseToleranceNs = 20'000'000;

struct View {
  int64_t stamp_ns = 0;
  Rigid3d T_world_cam;
  FeatureSet features;
  BowImage bow;
};

KeyframeId IdOf(size_t view) { return KeyframeId::Make(1, static_cast<uint32_t>(view) + 1); }
size_t ViewOf(KeyframeId id) { return id.frame_index() - 1; }

const StampedPose* NearestPose(const std::vector<StampedPose>& poses, int64_t stamp_ns) {
  const StampedPose* nearest = nullptr;
  for (const StampedPose& pose : poses) {
    const int64_t away = std::abs(pose.stamp_ns - stamp_ns);
    if (away > kPoseToleranceNs) continue;
    if (nearest == nullptr || away < std::abs(nearest->stamp_ns - stamp_ns)) nearest = &pose;
  }
  return nearest;
}

std::vector<View> LoadViews(const PlacesOptions& options, const Vocabulary& vocabulary) {
  const TumSequence sequence(options.sequence);
  if (!sequence.GroundTruthPath()) {
    throw InputError(options.sequence + ": no groundtruth.txt; give a sequence with ground truth");
  }
  const std::vector<StampedPose> poses = ReadTrajectory(*sequence.GroundTruthPath());
  OrbExtractorOptions extraction;
  extraction.num_features = options.features;
  OrbExtractor extractor(extraction);
  std::vector<View> views;
  for (size_t i = 0; i < sequence.size(); i += static_cast<size_t>(options.every)) {
    const StampedPose* pose = NearestPose(poses, sequence.StampNs(i));
    if (pose == nullptr) continue;
    View view{sequence.StampNs(i), pose->T_world_cam, {}, {}};
    const GrayImage image = LoadGray(sequence.Name(i));
    extractor.Extract({image.data.data(), image.width, image.height, image.width}, &view.features);
    view.bow = vocabulary.Transform(view.features.descriptors);
    views.push_back(std::move(view));
  }
  return views;
}

bool SameView(const View& a, const View& b, const PlacesOptions& options) {
  const Rigid3d T_a_b = a.T_world_cam.Inverse() * b.T_world_cam;
  const double angle_rad = Eigen::AngleAxisd(T_a_b.rotation).angle();
  return T_a_b.translation.norm() <= options.max_distance &&
         angle_rad * 180.0 / std::numbers::pi <= options.max_angle_deg;
}

bool FarInTime(const View& a, const View& b, const PlacesOptions& options) {
  return static_cast<double>(std::abs(a.stamp_ns - b.stamp_ns)) * 1e-9 > options.min_gap_s;
}

/// Matches under common nodes that agree on an essential matrix.
int CountVerified(const View& query, const View& place, const PlacesOptions& options, uint64_t seed) {
  const auto matches =
      MatchByNodes({&query.features, &query.bow.nodes, {}}, {&place.features, &place.bow.nodes, {}});
  std::vector<Eigen::Vector2d> x1_px;
  std::vector<Eigen::Vector2d> x2_px;
  std::vector<double> sigma_squared;
  const Pyramid pyramid;
  for (const BowMatch& match : matches) {
    const Keypoint& first = query.features.keypoints[match.a];
    const Keypoint& second = place.features.keypoints[match.b];
    x1_px.emplace_back(first.x_px(), first.y_px());
    x2_px.emplace_back(second.x_px(), second.y_px());
    sigma_squared.push_back(
        std::max(pyramid.SigmaSquared(first.octave), pyramid.SigmaSquared(second.octave)));
  }
  TwoViewRansacOptions ransac;
  ransac.ransac.seed = seed;
  ransac.ransac.max_iterations = 500;
  const auto report = EssentialFromMatches(options.camera, x1_px, x2_px, sigma_squared, ransac);
  return report.success ? report.num_inliers : 0;
}

PlaceAnswer Answer(const std::vector<View>& views, size_t index, const std::vector<PlaceCandidate>& places,
                   const PlacesOptions& options) {
  const View& query = views[index];
  PlaceAnswer answer;
  for (size_t i = 0; i < index; ++i) {
    answer.expected |= FarInTime(query, views[i], options) && SameView(query, views[i], options);
  }
  for (size_t c = 0; c < std::min(places.size(), options.max_candidates); ++c) {
    const View& place = views[ViewOf(places[c].keyframe)];
    const bool right = SameView(query, place, options);
    if (places[c].score > answer.score) {
      answer.score = places[c].score;
      answer.score_right = right;
    }
    const uint64_t seed = DeriveSeed(options.seed, index * 1000 + c, "verify place");
    const int inliers = CountVerified(query, place, options, seed);
    if (inliers > answer.inliers) {
      answer.inliers = inliers;
      answer.inliers_right = right;
    }
  }
  return answer;
}

}  // namespace

PlacesResult EvaluatePlaces(const PlacesOptions& options) {
  const Vocabulary vocabulary = Vocabulary::Load(options.vocabulary);
  const std::vector<View> views = LoadViews(options, vocabulary);
  KeyframeDatabase database;
  PlacesResult result;
  result.num_views = views.size();
  size_t next_to_add = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    while (next_to_add < i && FarInTime(views[i], views[next_to_add], options)) {
      database.Add(IdOf(next_to_add), views[next_to_add].bow.words);
      ++next_to_add;
    }
    const auto start = std::chrono::steady_clock::now();
    const std::vector<PlaceCandidate> places = database.Query(views[i].bow.words);
    const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - start;
    result.query_ms += spent.count() / static_cast<double>(views.size());
    result.answers.push_back(Answer(views, i, places, options));
    result.num_expected += result.answers.back().expected;
  }
  return result;
}

std::vector<CurvePoint> PrecisionRecall(const PlacesResult& result, Confidence confidence) {
  struct Ranked {
    double confidence;
    bool right;
  };
  std::vector<Ranked> ranked;
  for (const PlaceAnswer& answer : result.answers) {
    const bool by_score = confidence == Confidence::kScore;
    const double value = by_score ? answer.score : answer.inliers;
    if (value > 0) ranked.push_back({value, by_score ? answer.score_right : answer.inliers_right});
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Ranked& a, const Ranked& b) { return a.confidence > b.confidence; });
  std::vector<CurvePoint> curve;
  double right = 0;
  for (size_t i = 0; i < ranked.size(); ++i) {
    right += ranked[i].right;
    if (i + 1 < ranked.size() && ranked[i + 1].confidence == ranked[i].confidence) continue;
    curve.push_back({ranked[i].confidence, right / static_cast<double>(i + 1),
                     right / static_cast<double>(std::max<size_t>(1, result.num_expected))});
  }
  return curve;
}

std::optional<CurvePoint> BestWithoutError(const std::vector<CurvePoint>& curve) {
  std::optional<CurvePoint> best;
  for (const CurvePoint& point : curve) {
    if (point.precision < 1.0) break;
    best = point;
  }
  return best;
}

}  // namespace dmslam
