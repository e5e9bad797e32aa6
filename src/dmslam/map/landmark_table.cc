#include "dmslam/map/landmark_table.h"

#include <bit>

namespace dmslam {
namespace {

constexpr size_t kFewestSlots = 64;

}  // namespace

LandmarkTable::LandmarkTable(const LandmarkTable& other)
    : size_(other.size_), shift_(other.shift_), slots_(other.slots_.size()) {
  for (size_t at = 0; at < slots_.size(); ++at) {
    const Slot& slot = other.slots_[at];
    if (slot.id.valid()) slots_[at] = {slot.id, std::make_unique<Landmark>(*slot.landmark)};
  }
}

LandmarkTable& LandmarkTable::operator=(const LandmarkTable& other) {
  if (this == &other) return *this;
  LandmarkTable copy(other);
  Swap(copy);
  return *this;
}

Landmark& LandmarkTable::Insert(Landmark landmark) {
  if (4 * (size_ + 1) > 3 * slots_.size()) Grow();
  ++size_;
  const LandmarkId id = landmark.id;
  auto inserted = std::make_unique<Landmark>(std::move(landmark));
  Landmark& stays = *inserted;
  Put(id, std::move(inserted));
  return stays;
}

void LandmarkTable::Put(LandmarkId id, std::unique_ptr<Landmark> landmark) {
  size_t at = HomeOf(id);
  while (slots_[at].id.valid()) at = Next(at);
  slots_[at] = {id, std::move(landmark)};
}

void LandmarkTable::Grow() {
  std::vector<Slot> before = std::exchange(slots_, {});
  slots_.resize(before.empty() ? kFewestSlots : 2 * before.size());
  shift_ = 64 - std::countr_zero(slots_.size());
  for (Slot& slot : before) {
    if (slot.id.valid()) Put(slot.id, std::move(slot.landmark));
  }
}

void LandmarkTable::Erase(LandmarkId id) {
  if (slots_.empty()) return;
  size_t gap = HomeOf(id);
  while (slots_[gap].id != id) {
    if (!slots_[gap].id.valid()) return;
    gap = Next(gap);
  }
  --size_;
  slots_[gap] = {};
  // Whoever was pushed along beyond the gap moves back, or nobody would find him.
  const size_t mask = slots_.size() - 1;
  for (size_t at = Next(gap); slots_[at].id.valid(); at = Next(at)) {
    const size_t pushed = (at - HomeOf(slots_[at].id)) & mask;
    if (pushed < ((at - gap) & mask)) continue;
    slots_[gap] = std::move(slots_[at]);
    slots_[at] = {};
    gap = at;
  }
}

}  // namespace dmslam
