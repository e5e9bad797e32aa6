#include "dmslam/triangulation/epipolar_matches.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>

#include "dmslam/features/hamming.h"

namespace dmslam {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kMargin = 0.5;  // beyond both ends of the circle of planes [rad]

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
    if (!(across >= 0.02)) continue;  // nearly along the baseline: any plane would do
    const uint8_t octave = keyframe.features->set.keypoints[i].octave;
    const double sigma_px = map.pyramid().Sigma(octave);
    const double along = ray.dot(pencil.axis);
    entries.push_back({std::atan2(y, x), across, along, along / across, sigma_px / (camera.fx_px * across),
                       static_cast<uint16_t>(i), octave});
  }
  return entries;
}

/// With copies beyond both ends, so that a window of angles never wraps around.
std::vector<PlaneEntry> WithWrap(std::vector<PlaneEntry> entries) {
  const size_t count = entries.size();
  for (size_t i = 0; i < count; ++i) {
    PlaneEntry copy = entries[i];
    if (copy.angle > kPi - kMargin) {
      copy.angle -= 2 * kPi;
      entries.push_back(copy);
    } else if (copy.angle < -kPi + kMargin) {
      copy.angle += 2 * kPi;
      entries.push_back(copy);
    }
  }
  return entries;
}

constexpr double kBucketsPerRad = 150.0;
constexpr size_t kNumBuckets = 1100;

size_t BucketOf(double angle) {
  const double position = (angle + kPi + kMargin) * kBucketsPerRad;
  return static_cast<size_t>(std::clamp(position, 0.0, static_cast<double>(kNumBuckets - 1)));
}

/// Positions in `entries` of some of them, in order of their angles but for those in the same bucket.
class ByAngle {
 public:
  ByAngle(const std::vector<PlaneEntry>& entries, const std::vector<uint32_t>& some)
      : starts_(kNumBuckets + 1), order_(some.size()) {
    for (const uint32_t i : some) ++starts_[BucketOf(entries[i].angle) + 1];
    std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
    std::vector<uint32_t> next(starts_.begin(), starts_.end() - 1);
    for (const uint32_t i : some) order_[next[BucketOf(entries[i].angle)]++] = i;
  }
  std::span<const uint32_t> order() const { return order_; }
  /// Of the buckets between two angles: the first in order, and the one behind the last.
  std::pair<uint32_t, uint32_t> Between(double low, double high) const {
    return {starts_[BucketOf(low)], starts_[BucketOf(high) + 1]};
  }

 private:
  std::vector<uint32_t> starts_;  ///< of each bucket, in order
  std::vector<uint32_t> order_;
};

std::vector<uint32_t> AllOf(const std::vector<PlaneEntry>& entries) {
  std::vector<uint32_t> all(entries.size());
  std::iota(all.begin(), all.end(), 0U);
  return all;
}

/// Entries of like tolerance: a window is no wider than these need. Without groups a few rays near the
/// baseline, on whose planes almost anything lies, would widen the window of all others.
class PlaneGroup {
 public:
  /// What decides whether an entry may fit, close together.
  struct Key {
    double angle, tolerance_squared, slope;
    uint32_t entry;
    uint8_t octave;
  };
  PlaneGroup(const std::vector<PlaneEntry>& entries, const std::vector<uint32_t>& members)
      : by_angle_(entries, members) {
    keys_.reserve(members.size());
    for (const uint32_t i : by_angle_.order()) {
      const PlaneEntry& entry = entries[i];
      const double tolerance_squared = entry.tolerance * entry.tolerance;
      keys_.push_back({entry.angle, tolerance_squared, entry.slope, i, entry.octave});
      max_tolerance_squared_ = std::max(max_tolerance_squared_, tolerance_squared);
    }
  }
  double max_tolerance_squared() const { return max_tolerance_squared_; }
  /// Those within `reach` of an angle, and some beyond.
  std::span<const Key> Near(double angle, double reach) const {
    const auto [begin, end] = by_angle_.Between(angle - reach, angle + reach);
    return std::span(keys_).subspan(begin, end - begin);
  }

 private:
  ByAngle by_angle_;
  std::vector<Key> keys_;
  double max_tolerance_squared_ = 0;
};

constexpr size_t kNumGroups = 5;  // each with up to twice the tolerance of the one before; the last with any

std::vector<PlaneGroup> GroupByTolerance(const std::vector<PlaneEntry>& entries) {
  double least = std::numeric_limits<double>::infinity();
  for (const PlaneEntry& entry : entries) least = std::min(least, entry.tolerance);
  std::array<std::vector<uint32_t>, kNumGroups> members;
  for (uint32_t i = 0; i < entries.size(); ++i) {
    size_t group = 0;
    for (double most = 2 * least; group + 1 < kNumGroups && entries[i].tolerance > most; most *= 2) ++group;
    members[group].push_back(i);
  }
  std::vector<PlaneGroup> groups;
  for (const std::vector<uint32_t>& some : members) {
    if (!some.empty()) groups.emplace_back(entries, some);
  }
  return groups;
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
                std::vector<PlaneEntry> entries_b)
      : a_(a),
        b_(b),
        options_(options),
        entries_b_(std::move(entries_b)),
        groups_(GroupByTolerance(entries_b_)),
        sigmas_(std::sqrt(options.sigmas_squared)),
        near_(entries_b_.size()),
        distances_(entries_b_.size()) {}

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
  /// Positions in b's entries of those in the window that are not clearly unfit, into near_. Returns how
  /// many.
  size_t CollectNear(const PlaneEntry& entry) {
    const double tolerance_squared = entry.tolerance * entry.tolerance;
    const double factor = sigmas_ * sigmas_ * (1 + kClear), steepest = entry.slope + kClear;
    size_t count = 0;
    for (const PlaneGroup& group : groups_) {
      const double widest = std::sqrt(factor * (tolerance_squared + group.max_tolerance_squared())) + kClear;
      const double reach = std::min(6.0 * entry.tolerance + 0.02, widest);
      for (const PlaneGroup::Key& other : group.Near(entry.angle, reach)) {
        const double apart = std::abs(other.angle - entry.angle);
        const bool same = apart * apart <= factor * (tolerance_squared + other.tolerance_squared);
        const bool fits = std::abs(other.octave - entry.octave) <= kMaxOctavesApart;
        near_[count] = other.entry;
        count += static_cast<size_t>(same & (apart <= reach) & (other.slope <= steepest) & fits);
      }
    }
    return count;
  }

  /// Leaves of the first `count` of near_ those that fit indeed, now by their features. Returns how many.
  /// The error lies in the other image as in ORB-SLAM2, with this feature's own error added.
  size_t KeepFitting(const PlaneEntry& entry, size_t count) {
    size_t kept = 0;
    for (size_t k = 0; k < count; ++k) {
      const PlaneEntry& other = entries_b_[near_[k]];
      if (SamePlane(other, entry, sigmas_) && Converge(entry, other)) near_[kept++] = other.feature;
    }
    return kept;
  }

  const Keyframe& a_;
  const Keyframe& b_;
  const EpipolarMatchOptions& options_;
  std::vector<PlaneEntry> entries_b_;
  std::vector<PlaneGroup> groups_;  ///< of b's
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
  PartnerSearch search(a, b, options, WithWrap(PlaneEntries(b, use_b, pencil, map)));
  std::vector<std::optional<uint16_t>> partner_of_b(b.features->size());
  std::vector<int> distance_of_b(b.features->size(), kNoDistance);
  // By their angles, as neighbours among them have the same neighbours in b.
  const ByAngle a_by_angle(entries_a, AllOf(entries_a));
  for (const uint32_t i : a_by_angle.order()) {
    const PlaneEntry& entry = entries_a[i];
    const std::optional<uint16_t> partner = search.Best(entry);
    if (!partner) continue;
    const size_t index = *partner;
    const int distance =
        HammingDistance(a.features->set.descriptors[entry.feature], b.features->set.descriptors[index]);
    const bool better = distance < distance_of_b[index] ||
                        (distance == distance_of_b[index] && entry.feature < *partner_of_b[index]);
    if (!better) continue;
    distance_of_b[index] = distance;
    partner_of_b[index] = entry.feature;
  }
  std::vector<std::pair<uint16_t, uint16_t>> matches;
  for (size_t i = 0; i < partner_of_b.size(); ++i) {
    if (partner_of_b[i]) matches.emplace_back(*partner_of_b[i], static_cast<uint16_t>(i));
  }
  std::sort(matches.begin(), matches.end());
  return matches;
}

}  // namespace dmslam
