#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dmslam/util/ids.h"

namespace dmslam {

/// Landmarks that are asked for by id, thousands of times each frame. The landmarks around a frame were made
/// one after the other, so their ids lie close together: each has a bit in a table. Where they lie too far
/// apart they are sorted. Does not ask the heap for memory once it has grown.
class LandmarkSet {
 public:
  void Clear() {
    ids_.clear();
    is_ready_ = false;
  }
  /// A valid one, that may be in it already. Until the next Finish nothing may be asked.
  void Add(LandmarkId id) {
    ids_.push_back(id);
    is_ready_ = false;
  }
  /// All are added; more may be added after it, and that be finished again.
  void Finish() {
    if (is_ready_) return;
    is_ready_ = true;
    if (ids_.empty()) {
      range_ = 0;
      marks_.assign(1, 0);
      return;
    }
    const auto [least, most] = std::ranges::minmax_element(ids_);
    first_ = least->value;
    range_ = most->value - first_;
    if (range_ / kWidestRange < ids_.size()) {
      marks_.assign(range_ / 64 + 1, 0);
      for (const LandmarkId id : ids_) marks_[(id.value - first_) / 64] |= Bit(id);
    } else {
      marks_.clear();
      std::sort(ids_.begin(), ids_.end());
    }
  }
  /// How many were added.
  size_t size() const { return ids_.size(); }

  bool Holds(LandmarkId id) const {
    const uint64_t offset = id.value - first_;
    if (offset > range_) return false;
    if (marks_.empty()) return std::binary_search(ids_.begin(), ids_.end(), id);
    return (marks_[offset / 64] & Bit(id)) != 0;
  }

 private:
  /// Ids between the first and the last, for each that is in it, up to which a table is worth its while.
  static constexpr uint64_t kWidestRange = 512;

  uint64_t Bit(LandmarkId id) const { return uint64_t{1} << ((id.value - first_) % 64); }

  std::vector<LandmarkId> ids_;
  bool is_ready_ = false;
  uint64_t first_ = 0, range_ = 0;
  std::vector<uint64_t> marks_;  ///< from `first_` on; empty: the ids are sorted
};

}  // namespace dmslam
