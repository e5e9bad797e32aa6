#include "dmslam/triangulation/epipolar_matches.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "dmslam/features/hamming.h"

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
  PartnerSearch(const Keyframe& a, const Keyframe& b, const EpipolarMatchOptions& options,
                std::vector<PlaneEntry> sorted_b)
      : a_(a),
        b_(b),
        options_(options),
        sorted_b_(std::move(sorted_b)),
        sigmas_(std::sqrt(options.sigmas_squared)),
        near_(sorted_b_.size()),
        distances_(sorted_b_.size()) {}

  /// The feature of b; none: no one fits, or several do.
  std::optional<uint16_t> Best(const PlaneEntry& entry) {
    const size_t count = KeepFitting(entry, CollectNear(entry));
    const auto& set_b = b_.features->set;
    hamming_.to_indexed(a_.features->set.descriptors[entry.feature], set_b.descriptors.data(), near_.data(),
                        static_cast<int>(count), distances_.data());
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
    const bool unambiguous = best < options_.descriptor_ratio * second;
    return best <= options_.max_descriptor_distance && unambiguous ? best_feature : std::nullopt;
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

  const Keyframe& a_;
  const Keyframe& b_;
  const EpipolarMatchOptions& options_;
  std::vector<PlaneEntry> sorted_b_;
  double sigmas_;
  const HammingKernels& hamming_ = BestHammingKernels();
  std::vector<uint32_t> near_;       ///< workspace
  std::vector<uint16_t> distances_;  ///< workspace
};

}  // namespace

std::vector<std::pair<uint16_t, uint16_t>> MatchAlongEpipolarPlanes(
    const Keyframe& a, const std::vector<uint8_t>& use_a, const Keyframe& b,
    const std::vector<uint8_t>& use_b, const Map& map, const EpipolarMatchOptions& options) {
  const Pencil pencil = Pencil::Through(a.T_cam_world.Center(), b.T_cam_world.Center());
  const std::vector<PlaneEntry> entries_a = PlaneEntries(a, use_a, pencil, map);
  PartnerSearch search(a, b, options, SortedWithWrap(PlaneEntries(b, use_b, pencil, map), 0.5));
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

}  // namespace dmslam
