#include "evaluate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "dmslam/dataset/image.h"
#include "dmslam/dataset/trajectory.h"
#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/features/orb_extractor.h"
#include "dmslam/geometry/triangulation.h"
#include "dmslam/place_recognition/keyframe_database.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/robust/pose_from_matches.h"
#include "dmslam/robust/two_view_ransac.h"
#include "dmslam/util/check.h"
#include "dmslam/util/chi_squared.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int64_t kPoseToleranceNs = 20'000'000;

struct View {
  int64_t stamp_ns = 0;
  Rigid3d T_world_cam;
  FeatureSet features;
  std::vector<Eigen::Vector2d> uv_px;
  FeatureGrid grid;
  BowImage bow;
  std::vector<uint8_t> has_point;             ///< per feature
  std::vector<Eigen::Vector3d> points_world;  ///< per feature; meaningful where has_point
};

Eigen::Vector2d PixelOf(const Keypoint& keypoint) { return {keypoint.x_px(), keypoint.y_px()}; }

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
    View view{sequence.StampNs(i), pose->T_world_cam, {}, {}, {}, {}, {}, {}};
    const GrayImage image = LoadGray(sequence.Name(i));
    extractor.Extract({image.data.data(), image.width, image.height, image.width}, &view.features);
    for (const Keypoint& keypoint : view.features.keypoints) view.uv_px.push_back(PixelOf(keypoint));
    view.grid.Build(view.uv_px, view.features.keypoints, image.width, image.height);
    view.bow = vocabulary.Transform(view.features.descriptors);
    views.push_back(std::move(view));
  }
  return views;
}

bool Within(const Rigid3d& T_a_b, double distance, double angle_deg) {
  const double angle_rad = LogSo3(T_a_b.rotation).norm();
  return T_a_b.translation.norm() <= distance && angle_rad * 180.0 / std::numbers::pi <= angle_deg;
}

bool SameView(const Rigid3d& T_a_b, const PlacesOptions& options) {
  return Within(T_a_b, options.max_distance, options.max_angle_deg);
}

Rigid3d Between(const View& a, const View& b) { return a.T_world_cam.Inverse() * b.T_world_cam; }

bool FarInTime(const View& a, const View& b, const PlacesOptions& options) {
  return static_cast<double>(std::abs(a.stamp_ns - b.stamp_ns)) * 1e-9 > options.min_gap_s;
}

/// Gives the features of `view` points by its matches with `other`.
void TriangulateWith(const View& other, const PlacesOptions& options, View& view) {
  constexpr double kMinParallaxRad = 0.02;
  const Pyramid pyramid;
  const Rigid3d T_view_world = view.T_world_cam.Inverse();
  const Rigid3d T_other_world = other.T_world_cam.Inverse();
  for (const BowMatch& match :
       MatchByNodes({&view.features, &view.bow.nodes, {}}, {&other.features, &other.bow.nodes, {}})) {
    if (view.has_point[match.a]) continue;
    const Keypoint& first = view.features.keypoints[match.a];
    const Keypoint& second = other.features.keypoints[match.b];
    const auto point = TriangulatePoint(T_view_world, T_other_world, options.camera.Ray(PixelOf(first)),
                                        options.camera.Ray(PixelOf(second)));
    if (!point) continue;
    const auto error = [&](const Rigid3d& T_cam_world, const Keypoint& keypoint) {
      return ReprojectionErrorSquared(options.camera, T_cam_world, *point, PixelOf(keypoint)) /
             pyramid.SigmaSquared(keypoint.octave);
    };
    if (error(T_view_world, first) > kChiSquared2Dof || error(T_other_world, second) > kChiSquared2Dof)
      continue;
    if (ParallaxAngle(view.T_world_cam.translation, other.T_world_cam.translation, *point) <
        kMinParallaxRad) {
      continue;
    }
    view.points_world[match.a] = *point;
    view.has_point[match.a] = 1;
  }
}

/// Points for every view, from up to ten views before and after within a second.
void TriangulateAll(const PlacesOptions& options, std::vector<View>& views) {
  constexpr size_t kReach = 10;
  constexpr int64_t kMostApartNs = 1'000'000'000;
  for (size_t i = 0; i < views.size(); ++i) {
    views[i].has_point.assign(views[i].features.size(), 0);
    views[i].points_world.resize(views[i].features.size());
    for (size_t step = 1; step <= kReach; ++step) {
      for (const size_t j : {i - step, i + step}) {
        if (j >= views.size() || std::abs(views[j].stamp_ns - views[i].stamp_ns) > kMostApartNs) continue;
        TriangulateWith(views[j], options, views[i]);
      }
    }
  }
}

/// Matches under common nodes that agree on an essential matrix.
int CountOnEssential(const View& query, const View& place, const PlacesOptions& options, uint64_t seed) {
  std::vector<Eigen::Vector2d> x1_px;
  std::vector<Eigen::Vector2d> x2_px;
  std::vector<double> sigma_squared;
  const Pyramid pyramid;
  for (const BowMatch& match :
       MatchByNodes({&query.features, &query.bow.nodes, {}}, {&place.features, &place.bow.nodes, {}})) {
    const Keypoint& first = query.features.keypoints[match.a];
    const Keypoint& second = place.features.keypoints[match.b];
    x1_px.push_back(PixelOf(first));
    x2_px.push_back(PixelOf(second));
    sigma_squared.push_back(
        std::max(pyramid.SigmaSquared(first.octave), pyramid.SigmaSquared(second.octave)));
  }
  TwoViewRansacOptions ransac;
  ransac.ransac.seed = seed;
  ransac.ransac.max_iterations = 500;
  const auto report = EssentialFromMatches(options.camera, x1_px, x2_px, sigma_squared, ransac);
  return report.success ? report.num_inliers : 0;
}

/// Points of a place and where the query sees them.
struct PointMatches {
  std::vector<Eigen::Vector3d> points_world;
  std::vector<Eigen::Vector2d> uv_px;
  std::vector<double> inv_sigma_squared;

  void Add(const View& place, uint32_t place_feature, const View& query, uint32_t query_feature) {
    const Keypoint& keypoint = query.features.keypoints[query_feature];
    points_world.push_back(place.points_world[place_feature]);
    uv_px.push_back(PixelOf(keypoint));
    inv_sigma_squared.push_back(1.0 / Pyramid{}.SigmaSquared(keypoint.octave));
  }
};

/// Matches to the points of a place near where a pose shows them.
PointMatches SearchAround(const Rigid3d& T_cam_world, const View& query, const View& place,
                          const PlacesOptions& options) {
  constexpr double kRadiusPx = 6.0;
  constexpr int kMaxDistance = 64;
  constexpr double kMaxRatio = 0.9;
  const MatchSide side = {query.features.keypoints, query.features.descriptors, query.uv_px, {}};
  FeatureMatcher matcher;
  PointMatches found;
  for (uint32_t i = 0; i < place.features.size(); ++i) {
    const Eigen::Vector3d p_cam = T_cam_world * place.points_world[i];
    if (!place.has_point[i] || p_cam.z() <= 0) continue;
    const int octave = place.features.keypoints[i].octave;
    const SearchArea area = {options.camera.Project(p_cam), kRadiusPx * Pyramid{}.Scale(octave), octave - 1,
                             octave + 1};
    const auto match =
        matcher.FindMatch(place.features.descriptors[i], area, side, query.grid, kMaxDistance, kMaxRatio);
    if (match) found.Add(place, i, query, match->index1);
  }
  return found;
}

/// What was found out about the camera of a query.
struct PoseEstimate {
  Rigid3d T_cam_world;
  int inliers = 0;  ///< 0: no pose
};

/// Pose of the query from its matches to the points of a place: by words, then around their projections.
PoseEstimate PoseFromPlace(const View& query, const View& place, const PlacesOptions& options,
                           uint64_t seed) {
  PointMatches by_words;
  for (const BowMatch& match : MatchByNodes({&query.features, &query.bow.nodes, {}},
                                            {&place.features, &place.bow.nodes, place.has_point})) {
    by_words.Add(place, match.b, query, match.a);
  }
  PoseRansacOptions ransac;
  ransac.seed = seed;
  auto report = PoseFromMatches(options.camera, by_words.points_world, by_words.uv_px,
                                by_words.inv_sigma_squared, ransac);
  for (int round = 0; round < 2 && report.success; ++round) {
    const PointMatches around = SearchAround(report.model, query, place, options);
    report =
        PoseFromMatches(options.camera, around.points_world, around.uv_px, around.inv_sigma_squared, ransac);
  }
  return {report.model, report.success ? report.num_inliers : 0};
}

/// Answers one query from its candidates.
class Answerer {
 public:
  Answerer(const PlacesOptions& options, const View& query) : options_(options), query_(query) {}

  void Consider(const View& place, double score, uint64_t seed) {
    const Rigid3d T_query_place = Between(query_, place);
    Offer(Stage::kScore, score, T_query_place);
    Offer(Stage::kEssential, CountOnEssential(query_, place, options_, seed), T_query_place);
    const PoseEstimate pose = PoseFromPlace(query_, place, options_, seed);
    if (pose.inliers > 0 && IsAccepted(pose.T_cam_world * place.T_world_cam)) {
      Offer(Stage::kPose, pose.inliers, T_query_place);
    }
  }
  const std::array<PlaceAnswer, kNumStages>& answers() const { return answers_; }

 private:
  bool IsAccepted(const Rigid3d& T_query_place) const {
    const double share = 1.0 - options_.accept_margin;
    return Within(T_query_place, share * options_.max_distance, share * options_.max_angle_deg);
  }

  void Offer(Stage stage, double confidence, const Rigid3d& T_query_place) {
    PlaceAnswer& answer = answers_[static_cast<size_t>(stage)];
    if (confidence <= answer.confidence) return;
    answer = {confidence, SameView(T_query_place, options_),
              Within(T_query_place, options_.near_distance, options_.near_angle_deg)};
  }

  const PlacesOptions& options_;
  const View& query_;
  std::array<PlaceAnswer, kNumStages> answers_;
};

PlacesResult::Query Answer(const std::vector<View>& views, size_t index,
                           const std::vector<PlaceCandidate>& places, const PlacesOptions& options) {
  const View& query = views[index];
  PlacesResult::Query result;
  for (size_t i = 0; i < index; ++i) {
    result.expected |= FarInTime(query, views[i], options) && SameView(Between(query, views[i]), options);
  }
  Answerer answerer(options, query);
  for (size_t c = 0; c < std::min(places.size(), options.max_candidates); ++c) {
    answerer.Consider(views[ViewOf(places[c].keyframe)], places[c].score,
                      DeriveSeed(options.seed, index * 1000 + c, "verify place"));
  }
  result.answers = answerer.answers();
  return result;
}

}  // namespace

PlacesResult EvaluatePlaces(const PlacesOptions& options) {
  const Vocabulary vocabulary = LoadOrbVocabulary(options.vocabulary);
  std::vector<View> views = LoadViews(options, vocabulary);
  TriangulateAll(options, views);
  KeyframeDatabase database;
  PlacesResult result;
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
    result.queries.push_back(Answer(views, i, places, options));
    result.num_expected += result.queries.back().expected;
  }
  return result;
}

std::vector<CurvePoint> PrecisionRecall(const PlacesResult& result, Stage stage) {
  std::vector<PlaceAnswer> ranked;
  for (const PlacesResult::Query& query : result.queries) {
    const PlaceAnswer& answer = query.answers[static_cast<size_t>(stage)];
    if (answer.confidence > 0) ranked.push_back(answer);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const PlaceAnswer& a, const PlaceAnswer& b) { return a.confidence > b.confidence; });
  std::vector<CurvePoint> curve;
  double right = 0;
  double near = 0;
  for (size_t i = 0; i < ranked.size(); ++i) {
    right += ranked[i].right;
    near += ranked[i].near && !ranked[i].right;
    if (i + 1 < ranked.size() && ranked[i + 1].confidence == ranked[i].confidence) continue;
    const auto answers = static_cast<double>(i + 1);
    curve.push_back({ranked[i].confidence, right / answers, answers > near ? right / (answers - near) : 1.0,
                     right / static_cast<double>(std::max<size_t>(1, result.num_expected))});
  }
  return curve;
}

CurvePoint BestWithoutError(const std::vector<CurvePoint>& curve, bool place) {
  CurvePoint best;
  for (const CurvePoint& point : curve) {
    if ((place ? point.place_precision : point.precision) < 1.0) break;
    best = point;
  }
  return best;
}

}  // namespace dmslam
