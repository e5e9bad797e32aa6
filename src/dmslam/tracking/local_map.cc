#include "dmslam/tracking/local_map.h"

#include <algorithm>
#include <bit>
#include <cstdint>

namespace dmslam {
namespace {

constexpr int kNeighboursAsked = 10;

/// Ids that lie closer than this are marked in a table; it is smaller than the list and never compares.
constexpr uint64_t kWidestRange = 64;  // ids between the ends, for each in the list
/// The same of those that are counted.
constexpr uint64_t kWidestCounted = 8;

/// All that are in any of the lists, sorted, each once. `marks` is workspace.
void Unite(std::span<const std::span<const LandmarkId>> lists, std::vector<uint64_t>* marks,
           std::vector<LandmarkId>* united) {
  united->clear();
  uint64_t first = UINT64_MAX, last = 0;
  size_t count = 0;
  for (const std::span<const LandmarkId> ids : lists) {
    count += ids.size();
    for (const LandmarkId id : ids) {
      first = std::min(first, id.value);
      last = std::max(last, id.value);
    }
  }
  if (count == 0) return;
  const uint64_t range = last - first;
  if (range / kWidestRange >= count) {
    for (const std::span<const LandmarkId> ids : lists) united->insert(united->end(), ids.begin(), ids.end());
    std::sort(united->begin(), united->end());
    united->erase(std::unique(united->begin(), united->end()), united->end());
    return;
  }
  marks->assign(range / 64 + 1, 0);
  for (const std::span<const LandmarkId> ids : lists) {
    for (const LandmarkId id : ids)
      (*marks)[(id.value - first) / 64] |= uint64_t{1} << ((id.value - first) % 64);
  }
  for (size_t word = 0; word < marks->size(); ++word) {
    for (uint64_t left = (*marks)[word]; left != 0; left &= left - 1)
      united->push_back({first + 64 * word + static_cast<uint64_t>(std::countr_zero(left))});
  }
}

/// Calls visit(id, count) for each id of the list, in their order. `counts` is workspace; sorts the list
/// where it is too wide to count.
template <typename Visit>
void CountEach(std::vector<KeyframeId>* ids, std::vector<int>* counts, const Visit& visit) {
  if (ids->empty()) return;
  const auto [least, most] = std::minmax_element(ids->begin(), ids->end());
  const uint64_t first = least->value, range = most->value - first;
  if (range / kWidestCounted < ids->size()) {
    counts->assign(range + 1, 0);
    for (const KeyframeId id : *ids) ++(*counts)[id.value - first];
    for (uint64_t at = 0; at <= range; ++at) {
      if ((*counts)[at] > 0) visit(KeyframeId{first + at}, (*counts)[at]);
    }
    return;
  }
  std::sort(ids->begin(), ids->end());
  for (auto begin = ids->begin(); begin != ids->end();) {
    const auto end = std::find_if(begin, ids->end(), [begin](KeyframeId other) { return other != *begin; });
    visit(*begin, static_cast<int>(end - begin));
    begin = end;
  }
}

}  // namespace

void LocalMap::Reset() {
  reference_.reset();
  keyframes_.clear();
  landmarks_.clear();
}

/// The keyframes that see most of the frame's landmarks, most first; as many as the local map may have.
void LocalMap::RankByVotes(const Map& map, const TrackedFrame& frame) {
  votes_.clear();
  for (const LandmarkId id : frame.landmarks) {
    const Landmark* landmark = id.valid() ? map.FindLandmark(id) : nullptr;
    if (landmark == nullptr) continue;
    for (const Observation& o : landmark->observations) votes_.push_back(o.keyframe);
  }
  ranked_.clear();
  CountEach(&votes_, &counts_, [this](KeyframeId id, int count) { ranked_.emplace_back(-count, id); });
  const auto asked = ranked_.begin() + static_cast<ptrdiff_t>(std::min(ranked_.size(), max_keyframes_));
  std::partial_sort(ranked_.begin(), asked, ranked_.end());
}

/// The best neighbour of a local keyframe that is not local yet.
std::optional<KeyframeId> LocalMap::NewNeighbour(const Map& map, KeyframeId of) {
  ranked_.clear();
  for (const auto& [other, shared] : map.At(of).covisible) {
    ranked_.emplace_back(-shared, other);
  }
  const auto asked = ranked_.begin() + std::min<ptrdiff_t>(kNeighboursAsked, std::ssize(ranked_));
  std::partial_sort(ranked_.begin(), asked, ranked_.end());
  const auto found = std::find_if(ranked_.begin(), asked, [this](const auto& item) {
    return !std::binary_search(listed_.begin(), listed_.end(), item.second);
  });
  return found == asked ? std::nullopt : std::optional(found->second);
}

void LocalMap::AddNeighbours(const Map& map) {
  listed_ = keyframes_;
  std::sort(listed_.begin(), listed_.end());
  const size_t direct = keyframes_.size();
  for (size_t i = 0; i < direct && keyframes_.size() < max_keyframes_; ++i) {
    const std::optional<KeyframeId> neighbour = NewNeighbour(map, keyframes_[i]);
    if (!neighbour) continue;
    listed_.insert(std::lower_bound(listed_.begin(), listed_.end(), *neighbour), *neighbour);
    keyframes_.push_back(*neighbour);
  }
}

void LocalMap::ListLandmarks(const Map& map) {
  seen_.clear();
  for (const KeyframeId id : keyframes_) seen_.emplace_back(map.At(id).seen);
  Unite(seen_, &marks_, &landmarks_);
}

void LocalMap::Collect(const Map& map, const TrackedFrame& frame) {
  RankByVotes(map, frame);
  keyframes_.clear();
  for (size_t i = 0; i < std::min(ranked_.size(), max_keyframes_); ++i)
    keyframes_.push_back(ranked_[i].second);
  if (!keyframes_.empty()) reference_ = keyframes_.front();
  AddNeighbours(map);
  ListLandmarks(map);
}

void LocalMap::DropGone(const Map& map) {
  std::erase_if(landmarks_, [&](LandmarkId id) { return map.FindLandmark(id) == nullptr; });
}

}  // namespace dmslam
