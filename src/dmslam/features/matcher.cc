#include "dmslam/features/matcher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

/// Distance and index in one number, which orders by distance and then by index.
uint64_t KeyOf(int distance, uint32_t index) { return (static_cast<uint64_t>(distance) << 32) | index; }
int DistanceOf(uint64_t key) { return static_cast<int>(key >> 32); }
uint32_t IndexOf(uint64_t key) { return static_cast<uint32_t>(key); }

bool ClearlyBetter(int distance, int second_distance, double max_ratio) {
  return max_ratio >= 1.0 || distance < max_ratio * second_distance;
}

/// A candidate farther away [bits] is no match, takes none from another, and is no second best to one.
int FarthestThatCounts(int max_distance, double max_ratio) {
  const double ratio = std::clamp(max_ratio, 0.01, 1.0);
  return std::min(kNoDistance - 1, static_cast<int>(std::ceil(std::max(0, max_distance) / ratio)));
}

int TurnBin(const Keypoint& from, const Keypoint& to) {
  const int turn = (to.angle - from.angle) & 255;
  return (turn * kOrientationBins + 128) / 256 % kOrientationBins;
}

/// Which bins to keep.
std::array<bool, kOrientationBins> FullestBins(const std::array<int, kOrientationBins>& counts) {
  std::array<int, kOrientationBins> order{};
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const int count_a = counts[static_cast<size_t>(a)], count_b = counts[static_cast<size_t>(b)];
    return count_a != count_b ? count_a > count_b : a < b;
  });
  std::array<bool, kOrientationBins> keep{};
  const int fullest = counts[static_cast<size_t>(order[0])];
  for (size_t i = 0; i < kOrientationBinsKept; ++i) {
    const size_t bin = static_cast<size_t>(order[i]);
    keep[bin] = 10 * counts[bin] >= fullest;
  }
  return keep;
}

void CheckSide(const MatchSide& side) {
  DMSLAM_CHECK(side.keypoints.size() == side.size(), "every descriptor needs its keypoint");
  DMSLAM_CHECK(side.usable.empty() || side.usable.size() == side.size(),
               "one usable flag per feature, or none");
}

/// End of the run of entries of the same group that begins at `begin`.
size_t GroupEnd(std::span<const GroupedFeature> groups, size_t begin) {
  size_t end = begin;
  while (end < groups.size() && groups[end].group == groups[begin].group) ++end;
  return end;
}

}  // namespace

void FeatureMatcher::MatchWindow(const MatchSide& a, const MatchSide& b, const FeatureGrid& grid_b,
                                 const WindowMatchOptions& options, std::vector<FeatureMatch>* matches,
                                 std::span<const Eigen::Vector2d> predicted_px) {
  if (predicted_px.empty()) predicted_px = a.uv_px;
  DMSLAM_CHECK(predicted_px.size() == a.size(), "every feature of the first image needs a position");
  Start(a, b, matches);
  const int limit = FarthestThatCounts(options.match.max_distance, options.match.max_ratio);
  for (uint32_t i = 0; i < a.size(); ++i) {
    const int octave = a.keypoints[i].octave;
    if (!a.Usable(i) || octave > options.max_octave0) continue;
    const SearchArea area = {predicted_px[i], options.window_px, octave - options.octave_slack,
                             octave + options.octave_slack};
    CompareInArea(a.descriptors[i], area, b, grid_b, limit);
    Propose(i, options.match, matches);
  }
  Finish(a, b, options.match, matches);
}

void FeatureMatcher::MatchAll(const MatchSide& a, const MatchSide& b, const MatchOptions& options,
                              std::vector<FeatureMatch>* matches) {
  Start(a, b, matches);
  candidates_.clear();
  for (uint32_t j = 0; j < b.size(); ++j) {
    if (b.Usable(j)) candidates_.push_back(j);
  }
  for (uint32_t i = 0; i < a.size(); ++i) {
    if (!a.Usable(i)) continue;
    CompareWithCandidates(a.descriptors[i], b);
    Propose(i, options, matches);
  }
  Finish(a, b, options, matches);
}

void FeatureMatcher::MatchGroups(const MatchSide& a, std::span<const GroupedFeature> groups_a,
                                 const MatchSide& b, std::span<const GroupedFeature> groups_b,
                                 const MatchOptions& options, std::vector<FeatureMatch>* matches) {
  Start(a, b, matches);
  for (size_t begin_a = 0, begin_b = 0; begin_a < groups_a.size() && begin_b < groups_b.size();) {
    const uint32_t group_a = groups_a[begin_a].group, group_b = groups_b[begin_b].group;
    const size_t end_a = GroupEnd(groups_a, begin_a), end_b = GroupEnd(groups_b, begin_b);
    if (group_a == group_b) {
      candidates_.clear();
      for (size_t j = begin_b; j < end_b; ++j) {
        if (b.Usable(groups_b[j].feature)) candidates_.push_back(groups_b[j].feature);
      }
      for (size_t i = begin_a; i < end_a; ++i) {
        const uint32_t feature = groups_a[i].feature;
        if (!a.Usable(feature)) continue;
        CompareWithCandidates(a.descriptors[feature], b);
        Propose(feature, options, matches);
      }
    }
    if (group_a <= group_b) begin_a = end_a;
    if (group_b <= group_a) begin_b = end_b;
  }
  Finish(a, b, options, matches);
}

std::optional<NearestFeatures> FeatureMatcher::FindNearest(const Descriptor& descriptor,
                                                           const SearchArea& area, const MatchSide& side,
                                                           const FeatureGrid& grid) {
  return FindNearestWithin(kNoDistance - 1, descriptor, area, side, grid);
}

std::optional<NearestFeatures> FeatureMatcher::FindNearestWithin(int limit, const Descriptor& descriptor,
                                                                 const SearchArea& area,
                                                                 const MatchSide& side,
                                                                 const FeatureGrid& grid) {
  CompareInArea(descriptor, area, side, grid, limit);
  if (candidates_.empty()) return std::nullopt;
  const BestTwo two = BestTwoOfCandidates();
  NearestFeatures nearest;
  nearest.index = IndexOf(two.best);
  nearest.distance = DistanceOf(two.best);
  nearest.octave = side.keypoints[nearest.index].octave;
  nearest.second_distance = DistanceOf(two.second);
  if (nearest.second_distance < kNoDistance)
    nearest.second_octave = side.keypoints[IndexOf(two.second)].octave;
  return nearest;
}

std::optional<FeatureMatch> FeatureMatcher::FindMatch(const Descriptor& descriptor, const SearchArea& area,
                                                      const MatchSide& side, const FeatureGrid& grid,
                                                      int max_distance, double max_ratio) {
  const std::optional<NearestFeatures> nearest =
      FindNearestWithin(FarthestThatCounts(max_distance, max_ratio), descriptor, area, side, grid);
  if (!nearest || nearest->distance > max_distance) return std::nullopt;
  const bool comparable = nearest->second_distance < kNoDistance && nearest->second_octave == nearest->octave;
  if (comparable && !ClearlyBetter(nearest->distance, nearest->second_distance, max_ratio))
    return std::nullopt;
  return FeatureMatch{0, nearest->index, nearest->distance};
}

void FeatureMatcher::Start(const MatchSide& a, const MatchSide& b, std::vector<FeatureMatch>* matches) {
  CheckSide(a);
  CheckSide(b);
  matches->clear();
  nearest0_.assign(b.size(), KeyOf(kNoDistance, 0));
}

void FeatureMatcher::Propose(uint32_t index0, const MatchOptions& options,
                             std::vector<FeatureMatch>* matches) {
  const auto [best, second] = BestTwoOfCandidates();
  if (options.mutual) {
    for (size_t i = 0; i < candidates_.size(); ++i) NoteForSecondImage(candidates_[i], distances_[i], index0);
  }
  const int distance = DistanceOf(best);
  if (distance > std::min(options.max_distance, kNoDistance - 1)) return;
  if (!ClearlyBetter(distance, DistanceOf(second), options.max_ratio)) return;
  if (!options.mutual) NoteForSecondImage(IndexOf(best), distance, index0);
  matches->push_back({index0, IndexOf(best), distance});
}

FeatureMatcher::BestTwo FeatureMatcher::BestTwoOfCandidates() const {
  BestTwo two{KeyOf(kNoDistance, 0), KeyOf(kNoDistance, 0)};
  for (size_t i = 0; i < candidates_.size(); ++i) {
    const uint64_t key = KeyOf(distances_[i], candidates_[i]);
    two.second = std::min(two.second, std::max(two.best, key));
    two.best = std::min(two.best, key);
  }
  return two;
}

void FeatureMatcher::NoteForSecondImage(uint32_t index1, int distance, uint32_t index0) {
  nearest0_[index1] = std::min(nearest0_[index1], KeyOf(distance, index0));
}

void FeatureMatcher::Finish(const MatchSide& a, const MatchSide& b, const MatchOptions& options,
                            std::vector<FeatureMatch>* matches) {
  std::erase_if(*matches, [this](const FeatureMatch& m) { return IndexOf(nearest0_[m.index1]) != m.index0; });
  if (options.check_orientation) KeepConsistentTurns(a.keypoints, b.keypoints, matches);
  std::sort(matches->begin(), matches->end());
}

size_t FeatureMatcher::FindInArea(const SearchArea& area, const MatchSide& side, const FeatureGrid& grid) {
  DMSLAM_CHECK(grid.size() == side.size(), "the grid must index the features of the side");
  const size_t room = side.size() + FeatureGrid::kSlack;
  if (in_area_.size() < room) in_area_.resize(room);
  uint32_t* const found = in_area_.data();
  uint32_t* const end =
      found + grid.CollectInRadius(area.center_px, area.radius_px, area.min_octave, area.max_octave, found);
  if (side.usable.empty()) return static_cast<size_t>(end - found);
  return static_cast<size_t>(
      std::remove_if(found, end, [&](uint32_t feature) { return !side.Usable(feature); }) - found);
}

void FeatureMatcher::CompareInArea(const Descriptor& descriptor, const SearchArea& area,
                                   const MatchSide& side, const FeatureGrid& grid, int limit) {
  const size_t found = FindInArea(area, side, grid);
  distances_.resize(std::max(distances_.size(), found));
  const int near = kernels_.keep_near(descriptor, side.descriptors.data(), in_area_.data(),
                                      static_cast<int>(found), limit, distances_.data());
  candidates_.assign(in_area_.data(), in_area_.data() + near);
}

void FeatureMatcher::CompareWithCandidates(const Descriptor& descriptor, const MatchSide& side) {
  distances_.resize(candidates_.size());
  kernels_.to_indexed(descriptor, side.descriptors.data(), candidates_.data(),
                      static_cast<int>(candidates_.size()), distances_.data());
}

void KeepConsistentTurns(std::span<const Keypoint> keypoints0, std::span<const Keypoint> keypoints1,
                         std::vector<FeatureMatch>* matches) {
  std::array<int, kOrientationBins> counts{};
  const auto bin_of = [&](const FeatureMatch& match) {
    return static_cast<size_t>(TurnBin(keypoints0[match.index0], keypoints1[match.index1]));
  };
  for (const FeatureMatch& match : *matches) ++counts[bin_of(match)];
  const std::array<bool, kOrientationBins> keep = FullestBins(counts);
  std::erase_if(*matches, [&](const FeatureMatch& match) { return !keep[bin_of(match)]; });
}

}  // namespace dmslam
