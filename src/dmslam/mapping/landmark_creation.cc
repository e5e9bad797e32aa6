#include "dmslam/mapping/landmark_creation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "dmslam/camera/image_scale.h"
#include "dmslam/features/hamming.h"
#include "dmslam/geometry/triangulation.h"
#include "dmslam/map/projection.h"

namespace dmslam {
namespace {

constexpr double kPi = std::numbers::pi;

/// Directions of features in the frame of the pencil of planes through both camera centres: the baseline is
/// its axis.
struct Pencil {
  Eigen::Vector3d axis, u, v;

  static Pencil Through(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    Pencil pencil;
    pencil.axis = (to - from).normalized();
    const Eigen::Vector3d helper =
        std::abs(pencil.axis.y()) < 0.9 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
    pencil.u = pencil.axis.cross(helper).normalized();
    pencil.v = pencil.axis.cross(pencil.u);
    return pencil;
  }
};

struct PlaneEntry {
  double angle = 0;      ///< of the epipolar plane [rad]
  double across = 0;     ///< of the ray's direction, across the baseline...
  double along = 0;      ///< ...and along it
  double slope = 0;      ///< along / across
  double tolerance = 0;  ///< angle that one standard deviation of the feature spans [rad]
  uint16_t feature = 0;
  uint8_t octave = 0;
};

std::vector<PlaneEntry> PlaneEntries(const Keyframe& keyframe, const std::vector<uint8_t>& use,
                                     const Pencil& pencil, const Map& map) {
  const Camera& camera = map.camera();
  const Eigen::Matrix3d R_world_cam = keyframe.T_cam_world.rotation.conjugate().toRotationMatrix();
  std::vector<PlaneEntry> entries;
  entries.reserve(keyframe.features->size());
  for (size_t i = 0; i < keyframe.features->size(); ++i) {
    if (use[i] == 0) continue;
    const Eigen::Vector3d ray = (R_world_cam * camera.Ray(keyframe.features->uv_px[i])).normalized();
    const double x = ray.dot(pencil.u), y = ray.dot(pencil.v);
    const double across = std::hypot(x, y);
    if (across < 0.02) continue;  // nearly along the baseline: any plane would do
    const uint8_t octave = keyframe.features->set.keypoints[i].octave;
    const double sigma_px = map.pyramid().Sigma(octave);
    const double along = ray.dot(pencil.axis);
    entries.push_back({std::atan2(y, x), across, along, along / across, sigma_px / (camera.fx_px * across),
                       static_cast<uint16_t>(i), octave});
  }
  return entries;
}

bool ByAngle(const PlaneEntry& a, const PlaneEntry& b) {
  return a.angle != b.angle ? a.angle < b.angle : a.feature < b.feature;
}

/// Sorted by angle, with copies beyond both ends so that a window never wraps around.
std::vector<PlaneEntry> SortedWithWrap(std::vector<PlaneEntry> entries, double margin) {
  const size_t count = entries.size();
  for (size_t i = 0; i < count; ++i) {
    PlaneEntry copy = entries[i];
    if (copy.angle > kPi - margin) {
      copy.angle -= 2 * kPi;
      entries.push_back(copy);
    } else if (copy.angle < -kPi + margin) {
      copy.angle += 2 * kPi;
      entries.push_back(copy);
    }
  }
  std::sort(entries.begin(), entries.end(), ByAngle);
  return entries;
}

struct PairGeometry {
  const Keyframe& a;
  const Keyframe& b;
  const Map& map;
  const LandmarkCreationOptions& options;
  double max_parallax_cos = 1;
};

constexpr double kClear = 1e-9;  // what differs by so much does so for the exact functions, too
constexpr int kMaxOctavesApart = 3;

/// Whether the two planes differ by no more than `sigmas` of both tolerances together.
bool SamePlane(const PlaneEntry& a, const PlaneEntry& b, double sigmas) {
  const double apart = std::abs(a.angle - b.angle);
  const double apart_squared = apart * apart;
  const double bound_squared = sigmas * sigmas * (a.tolerance * a.tolerance + b.tolerance * b.tolerance);
  if (apart_squared < bound_squared * (1 - kClear)) return true;
  return apart <= sigmas * std::hypot(a.tolerance, b.tolerance);
}

/// Whether the ray of b makes a wider angle with the baseline, so that both converge in front of the cameras.
bool Converge(const PlaneEntry& a, const PlaneEntry& b) {
  if (b.slope < a.slope - kClear) return true;
  return std::atan2(b.across, b.along) > std::atan2(a.across, a.along);
}

/// Finds the best partner of one feature of a after the other among the entries of b. What is clear is
/// decided without branches and without the much slower hypot and atan2.
class PartnerSearch {
 public:
  PartnerSearch(const PairGeometry& pair, std::vector<PlaneEntry> sorted_b)
      : pair_(pair),
        sorted_b_(std::move(sorted_b)),
        sigmas_(std::sqrt(pair.options.epipolar_sigmas_squared)),
        near_(sorted_b_.size()),
        distances_(sorted_b_.size()) {}

  /// The feature of b; none: no one fits, or several do.
  std::optional<uint16_t> Best(const PlaneEntry& entry) {
    const size_t count = KeepFitting(entry, CollectNear(entry));
    const auto& set_b = pair_.b.features->set;
    hamming_.to_indexed(pair_.a.features->set.descriptors[entry.feature], set_b.descriptors.data(),
                        near_.data(), static_cast<int>(count), distances_.data());
    int best = kNoDistance, second = kNoDistance;
    std::optional<uint16_t> best_feature;
    for (size_t k = 0; k < count; ++k) {
      const int distance = distances_[k];
      if (distance < best) {
        second = best;
        best = distance;
        best_feature = static_cast<uint16_t>(near_[k]);
      } else if (distance < second) {
        second = distance;
      }
    }
    const bool unambiguous = best < pair_.options.descriptor_ratio * second;
    return best <= pair_.options.max_descriptor_distance && unambiguous ? best_feature : std::nullopt;
  }

 private:
  /// Positions in b's entries of those in the window that are not clearly unfit, into near_.
  size_t CollectNear(const PlaneEntry& entry) {
    const double reach = 6.0 * entry.tolerance + 0.02;
    const double tolerance_squared = entry.tolerance * entry.tolerance;
    const double factor = sigmas_ * sigmas_ * (1 + kClear), steepest = entry.slope + kClear;
    PlaneEntry first;
    first.angle = entry.angle - reach;
    const auto begin = std::lower_bound(sorted_b_.begin(), sorted_b_.end(), first, ByAngle);
    size_t count = 0;
    for (size_t i = static_cast<size_t>(begin - sorted_b_.begin()); i < sorted_b_.size(); ++i) {
      const PlaneEntry& other = sorted_b_[i];
      if (other.angle > entry.angle + reach) break;
      const double apart = other.angle - entry.angle;
      const bool same = apart * apart <= factor * (tolerance_squared + other.tolerance * other.tolerance);
      const bool fits = std::abs(other.octave - entry.octave) <= kMaxOctavesApart;
      near_[count] = static_cast<uint32_t>(i);
      count += static_cast<size_t>(same & (other.slope <= steepest) & fits);
    }
    return count;
  }

  /// Leaves of the first `count` of near_ those that fit indeed, now by their features. Returns how many.
  /// The error lies in the other image as in ORB-SLAM2, with this feature's own error added.
  size_t KeepFitting(const PlaneEntry& entry, size_t count) {
    size_t kept = 0;
    for (size_t k = 0; k < count; ++k) {
      const PlaneEntry& other = sorted_b_[near_[k]];
      if (SamePlane(other, entry, sigmas_) && Converge(entry, other)) near_[kept++] = other.feature;
    }
    return kept;
  }

  const PairGeometry& pair_;
  std::vector<PlaneEntry> sorted_b_;
  double sigmas_;
  const HammingKernels& hamming_ = BestHammingKernels();
  std::vector<uint32_t> near_;       ///< workspace
  std::vector<uint16_t> distances_;  ///< workspace
};

/// Tests one candidate: parallax, depth, reprojection and scale (paper 2.2; ORB-SLAM2's constants).
std::optional<Eigen::Vector3d> Triangulate(const PairGeometry& pair, uint16_t feature_a, uint16_t feature_b,
                                           CreationDiagnostics* diagnostics) {
  const Camera& camera = pair.map.camera();
  const Pyramid& pyramid = pair.map.pyramid();
  const Eigen::Vector3d ray_a = camera.Ray(pair.a.features->uv_px[feature_a]);
  const Eigen::Vector3d ray_b = camera.Ray(pair.b.features->uv_px[feature_b]);
  const Eigen::Vector3d world_a = pair.a.T_cam_world.rotation.conjugate() * ray_a;
  const Eigen::Vector3d world_b = pair.b.T_cam_world.rotation.conjugate() * ray_b;
  const double parallax_cos = world_a.dot(world_b) / (world_a.norm() * world_b.norm());
  if (!(parallax_cos > 0 && parallax_cos < pair.max_parallax_cos)) {
    ++diagnostics->refused_parallax;
    return std::nullopt;
  }
  std::optional<Eigen::Vector3d> point =
      TriangulatePoint(pair.a.T_cam_world, pair.b.T_cam_world, ray_a, ray_b);
  const auto uv_a = point ? camera.Project(pair.a.T_cam_world * *point) : std::nullopt;
  const auto uv_b = point ? camera.Project(pair.b.T_cam_world * *point) : std::nullopt;
  if (!uv_a || !uv_b) {
    ++diagnostics->refused_depth;
    return std::nullopt;
  }
  if (NormalizedErrorSquared(*pair.a.features, feature_a, *uv_a, pyramid) >
          pair.options.reprojection_sigmas_squared ||
      NormalizedErrorSquared(*pair.b.features, feature_b, *uv_b, pyramid) >
          pair.options.reprojection_sigmas_squared) {
    ++diagnostics->refused_reprojection;
    return std::nullopt;
  }
  const double distance_ratio =
      (*point - pair.b.T_cam_world.Center()).norm() / (*point - pair.a.T_cam_world.Center()).norm();
  const double octave_ratio = pyramid.Scale(pair.a.features->set.keypoints[feature_a].octave) /
                              pyramid.Scale(pair.b.features->set.keypoints[feature_b].octave);
  const double slack = pair.options.scale_ratio_slack * pyramid.scale_factor;
  if (distance_ratio * slack < octave_ratio || distance_ratio > octave_ratio * slack) {
    ++diagnostics->refused_scale;
    return std::nullopt;
  }
  return point;
}

/// Features without a landmark.
std::vector<uint8_t> FreeFeatures(const Keyframe& keyframe) {
  std::vector<uint8_t> use(keyframe.features->size(), 1);
  for (size_t i = 0; i < use.size(); ++i) {
    if (keyframe.landmarks[i].valid()) use[i] = 0;
  }
  return use;
}

/// Those of them that were not seen to move.
std::vector<uint8_t> FreeStillFeatures(const Keyframe& keyframe, const std::vector<uint16_t>& moving,
                                       CreationDiagnostics* diagnostics) {
  std::vector<uint8_t> use = FreeFeatures(keyframe);
  for (const uint16_t feature : moving) {
    if (feature >= use.size() || use[feature] == 0) continue;
    use[feature] = 0;
    ++diagnostics->refused_motion;
  }
  return use;
}

/// The gate of Algorithm 1: one candidate per neighbourhood, at most alpha * Ln of them.
class MutualExclusion {
 public:
  MutualExclusion(const LandmarkCreationOptions& options, const Camera& camera, int tracked_landmarks)
      : options_(options),
        neighbourhood_px_(options.neighbourhood_rad * FocalPx(camera)),
        limit_(std::max(options.min_candidates, static_cast<int>(options.alpha * tracked_landmarks))) {}

  bool Admit(const Eigen::Vector2d& uv_px, CreationDiagnostics* diagnostics) {
    if (!options_.mutual_exclusion) return true;
    if (static_cast<int>(accepted_.size()) >= limit_) {
      ++diagnostics->refused_count;
      return false;
    }
    for (const Eigen::Vector2d& other : accepted_) {
      if ((uv_px - other).cwiseAbs().maxCoeff() <= neighbourhood_px_) {
        ++diagnostics->refused_neighbourhood;
        return false;
      }
    }
    accepted_.push_back(uv_px);
    return true;
  }

 private:
  const LandmarkCreationOptions& options_;
  double neighbourhood_px_;
  int limit_;
  std::vector<Eigen::Vector2d> accepted_;
};

}  // namespace

CreationDiagnostics& CreationDiagnostics::operator+=(const CreationDiagnostics& other) {
  refused_motion += other.refused_motion;
  matched += other.matched;
  refused_parallax += other.refused_parallax;
  refused_depth += other.refused_depth;
  refused_reprojection += other.refused_reprojection;
  refused_scale += other.refused_scale;
  refused_neighbourhood += other.refused_neighbourhood;
  refused_count += other.refused_count;
  created += other.created;
  return *this;
}

std::vector<std::pair<uint16_t, uint16_t>> MatchAlongEpipolarPlanes(
    const Keyframe& a, const std::vector<uint8_t>& use_a, const Keyframe& b,
    const std::vector<uint8_t>& use_b, const Map& map, const LandmarkCreationOptions& options) {
  const Pencil pencil = Pencil::Through(a.T_cam_world.Center(), b.T_cam_world.Center());
  const std::vector<PlaneEntry> entries_a = PlaneEntries(a, use_a, pencil, map);
  const PairGeometry pair{a, b, map, options};
  PartnerSearch search(pair, SortedWithWrap(PlaneEntries(b, use_b, pencil, map), 0.5));
  std::vector<std::optional<uint16_t>> partner_of_b(b.features->size());
  std::vector<int> distance_of_b(b.features->size(), kNoDistance);
  for (const PlaneEntry& entry : entries_a) {
    const std::optional<uint16_t> partner = search.Best(entry);
    if (!partner) continue;
    const size_t index = *partner;
    const int distance =
        HammingDistance(a.features->set.descriptors[entry.feature], b.features->set.descriptors[index]);
    if (distance < distance_of_b[index]) {
      distance_of_b[index] = distance;
      partner_of_b[index] = entry.feature;
    }
  }
  std::vector<std::pair<uint16_t, uint16_t>> matches;
  for (size_t i = 0; i < partner_of_b.size(); ++i) {
    if (partner_of_b[i]) matches.emplace_back(*partner_of_b[i], static_cast<uint16_t>(i));
  }
  std::sort(matches.begin(), matches.end());
  return matches;
}

namespace {

/// A feature of the new keyframe matched with one of a neighbour, and the point they make.
struct PairCandidate {
  NeighbourFeature seen_by;
  Eigen::Vector3d p_world;
  double parallax_cos;
};

struct Candidate {
  NewLandmark landmark;
  bool confirmed = false;  ///< in enough views, over enough time
};

/// A camera that turns more than it moves sees nothing under a large angle for long, and is lost where
/// people hide what it knows: a point whose depth is hardly known still holds its rotation, and the next
/// keyframes mend it. Where the map grows into the past nothing hurries.
double MinParallaxRad(const Map& map, const Keyframe& keyframe, const LandmarkCreationOptions& options) {
  const bool newest = map.NewestKeyframeOf(keyframe.id.camera()) == &keyframe;
  return newest ? options.min_parallax_rad : options.min_past_parallax_rad;
}

/// All pairs of every free feature of a keyframe, by feature.
std::vector<std::vector<PairCandidate>> MatchNeighbours(const Map& map, const Keyframe& keyframe,
                                                        const std::vector<uint16_t>& moving,
                                                        const LandmarkCreationOptions& options,
                                                        CreationDiagnostics* diagnostics) {
  const std::vector<uint8_t> use = FreeStillFeatures(keyframe, moving, diagnostics);
  const double max_parallax_cos = std::cos(MinParallaxRad(map, keyframe, options));
  std::vector<std::vector<PairCandidate>> pairs(keyframe.features->size());
  for (const Keyframe* neighbour : map.BestCovisible(keyframe, options.neighbours, 1)) {
    const double baseline = (keyframe.T_cam_world.Center() - neighbour->T_cam_world.Center()).norm();
    const std::optional<double> depth = map.MedianDepth(*neighbour);
    if (!depth || baseline < options.min_baseline_over_depth * *depth) continue;
    const PairGeometry pair{keyframe, *neighbour, map, options, max_parallax_cos};
    for (const auto& [feature, other] :
         MatchAlongEpipolarPlanes(keyframe, use, *neighbour, FreeFeatures(*neighbour), map, options)) {
      ++diagnostics->matched;
      const std::optional<Eigen::Vector3d> point = Triangulate(pair, feature, other, diagnostics);
      if (!point) continue;
      const Eigen::Vector3d a = *point - keyframe.T_cam_world.Center(),
                            b = *point - neighbour->T_cam_world.Center();
      pairs[feature].push_back({{neighbour, other}, *point, a.dot(b) / (a.norm() * b.norm())});
    }
  }
  return pairs;
}

/// The point of the pair with the widest parallax, with all pairs of the feature that see it where they
/// should.
Candidate CombinePairs(const Map& map, const Keyframe& keyframe, uint16_t feature,
                       const std::vector<PairCandidate>& pairs, const LandmarkCreationOptions& options) {
  const auto widest = std::min_element(
      pairs.begin(), pairs.end(),
      [](const PairCandidate& a, const PairCandidate& b) { return a.parallax_cos < b.parallax_cos; });
  Candidate candidate{{feature, {widest->seen_by}, widest->p_world}, false};
  int64_t first_ns = keyframe.stamp_ns, last_ns = first_ns;
  for (auto pair = pairs.begin(); pair != pairs.end(); ++pair) {
    const Keyframe& neighbour = *pair->seen_by.keyframe;
    const auto uv_px = map.camera().Project(neighbour.T_cam_world * widest->p_world);
    const bool agrees = uv_px && NormalizedErrorSquared(*neighbour.features, pair->seen_by.feature, *uv_px,
                                                        map.pyramid()) <= options.reprojection_sigmas_squared;
    if (pair != widest && !agrees) continue;
    if (pair != widest) candidate.landmark.seen_by.push_back(pair->seen_by);
    first_ns = std::min(first_ns, neighbour.stamp_ns);
    last_ns = std::max(last_ns, neighbour.stamp_ns);
  }
  candidate.confirmed = options.confirmed_views > 0 &&
                        static_cast<int>(candidate.landmark.seen_by.size()) + 1 >= options.confirmed_views &&
                        static_cast<double>(last_ns - first_ns) * 1e-9 >= options.confirmed_span_s;
  return candidate;
}

}  // namespace

std::vector<NewLandmark> ProposeLandmarks(const Map& map, const Keyframe& keyframe,
                                          const std::vector<uint16_t>& moving,
                                          const LandmarkCreationOptions& options,
                                          CreationDiagnostics* diagnostics) {
  std::vector<Candidate> candidates;
  const auto pairs = MatchNeighbours(map, keyframe, moving, options, diagnostics);
  for (size_t feature = 0; feature < pairs.size(); ++feature) {
    if (pairs[feature].empty()) continue;
    candidates.push_back(
        CombinePairs(map, keyframe, static_cast<uint16_t>(feature), pairs[feature], options));
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.landmark.seen_by.size() > b.landmark.seen_by.size();
  });
  MutualExclusion gate(options, map.camera(), map.CountTracked(keyframe, 1));
  std::vector<NewLandmark> proposed;
  for (const Candidate& candidate : candidates) {
    const Eigen::Vector2d& uv_px = keyframe.features->uv_px[candidate.landmark.feature];
    if (candidate.confirmed || gate.Admit(uv_px, diagnostics)) proposed.push_back(candidate.landmark);
  }
  diagnostics->created += static_cast<uint32_t>(proposed.size());
  return proposed;
}

void CreateLandmarks(MapEditor& map, const Keyframe& keyframe, const std::vector<uint16_t>& moving,
                     const LandmarkCreationOptions& options, LandmarkMaker& maker,
                     CreationDiagnostics* diagnostics) {
  const auto taken = [](const NeighbourFeature& seen_by) {
    return seen_by.keyframe->landmarks[seen_by.feature].valid();
  };
  for (const NewLandmark& proposed : ProposeLandmarks(map, keyframe, moving, options, diagnostics)) {
    if (taken(proposed.seen_by.front())) continue;
    const Landmark& landmark = maker.Add(map, keyframe, keyframe, proposed.p_world);
    map.SetObservation(keyframe, proposed.feature, landmark);
    for (const NeighbourFeature& seen_by : proposed.seen_by) {
      if (!taken(seen_by)) map.SetObservation(*seen_by.keyframe, seen_by.feature, landmark);
    }
    map.UpdateDescriptor(landmark);
  }
}

}  // namespace dmslam
