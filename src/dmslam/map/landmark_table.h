#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "dmslam/map/landmark.h"

namespace dmslam {

/// Landmarks by id. They are asked for more often than anything else in a map, and lie all over the memory:
/// ids lie together in one array, so that a question costs one look at it. Linear probing, without
/// tombstones.
///
/// A landmark stays where it is until it is erased.
class LandmarkTable {
 public:
  LandmarkTable() = default;
  LandmarkTable(const LandmarkTable& other);
  LandmarkTable& operator=(const LandmarkTable& other);
  LandmarkTable(LandmarkTable&& other) noexcept { Swap(other); }
  LandmarkTable& operator=(LandmarkTable&& other) noexcept {
    Swap(other);
    return *this;
  }
  ~LandmarkTable() = default;

  size_t size() const { return size_; }

  /// Null: it is not there.
  Landmark* Find(LandmarkId id) const {
    if (slots_.empty()) return nullptr;
    for (size_t at = HomeOf(id);; at = Next(at)) {
      const Slot& slot = slots_[at];
      if (slot.id == id) return slot.landmark.get();
      if (!slot.id.valid()) return nullptr;
    }
  }

  /// Calls visit(const Landmark&) for each of `ids`, all of which are there, in their order. Those that come
  /// next are fetched while one is visited: most of the time it takes is the memory's.
  template <typename Visit>
  void ForEachOf(std::span<const LandmarkId> ids, Visit visit) const {
    std::array<const Landmark*, kAhead> ahead;
    for (size_t i = 0; i < std::min(kAhead, ids.size()); ++i) ahead[i] = Fetch(ids[i]);
    for (size_t i = 0; i < ids.size(); ++i) {
      const Landmark& landmark =
          *std::exchange(ahead[i % kAhead], i + kAhead < ids.size() ? Fetch(ids[i + kAhead]) : nullptr);
      visit(landmark);
    }
  }

  /// One that is not there yet, with a valid id.
  Landmark& Insert(Landmark landmark);
  /// Nothing happens where it is not there.
  void Erase(LandmarkId id);

  /// Calls visit(Landmark&) for each, in an order that means nothing. None may be added or erased meanwhile.
  template <typename Visit>
  void ForEach(Visit visit) const {
    for (const Slot& slot : slots_) {
      if (slot.id.valid()) visit(*slot.landmark);
    }
  }

 private:
  struct Slot {
    LandmarkId id;  ///< invalid: free
    std::unique_ptr<Landmark> landmark;
  };

  static constexpr size_t kAhead = 8;
  static constexpr size_t kCacheLineBytes = 64;

  const Landmark* Fetch(LandmarkId id) const {
    const Landmark* landmark = Find(id);
    const char* bytes = reinterpret_cast<const char*>(landmark);
    for (size_t at = 0; at < sizeof(Landmark); at += kCacheLineBytes) __builtin_prefetch(bytes + at);
    return landmark;
  }

  /// Running numbers come to lie far apart, as those of two epochs would otherwise push each other along.
  size_t HomeOf(LandmarkId id) const {
    return static_cast<size_t>(id.value * 0x9e3779b97f4a7c15ULL >> shift_);
  }
  size_t Next(size_t at) const { return (at + 1) & (slots_.size() - 1); }
  void Put(LandmarkId id, std::unique_ptr<Landmark> landmark);
  void Grow();
  void Swap(LandmarkTable& other) noexcept {
    std::swap(size_, other.size_);
    std::swap(shift_, other.shift_);
    slots_.swap(other.slots_);
  }

  size_t size_ = 0;
  int shift_ = 64;           ///< leaves as many bits of a hash as the number of slots has
  std::vector<Slot> slots_;  ///< a power of two of them, or none; a quarter at least is free
};

}  // namespace dmslam
