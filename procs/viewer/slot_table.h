#pragma once

#include <cstdint>
#include <map>
#include <vector>

namespace dmslam {

/// Things with a key, in numbered slots, so that somebody elsewhere can keep the same table by being told
/// what changed since a version. A slot keeps its number as long as its key lives; later another key may get
/// it.
template <typename Key, typename Value>
class SlotTable {
 public:
  struct Slot {
    Key key{};
    Value value{};
    uint64_t version = 0;  ///< when it changed last
    bool alive = false;
  };

  /// Without reuse a slot number means the same key for ever.
  explicit SlotTable(bool reuse_slots) : reuse_slots_(reuse_slots) {}

  /// Stores the value; what is there already, unchanged, keeps its version.
  void Set(const Key& key, const Value& value, uint64_t version) {
    const auto [it, is_new] = index_.try_emplace(key, 0);
    if (is_new) it->second = TakeSlot();
    Slot& slot = slots_[it->second];
    if (!is_new && slot.value == value) return;
    slot = {key, value, version, true};
  }

  void Remove(const Key& key, uint64_t version) {
    const auto it = index_.find(key);
    if (it == index_.end()) return;
    Slot& slot = slots_[it->second];
    slot.alive = false;
    slot.version = version;
    if (reuse_slots_) free_.push_back(it->second);
    index_.erase(it);
  }

  void Clear() {
    slots_.clear();
    index_.clear();
    free_.clear();
  }

  const std::vector<Slot>& slots() const { return slots_; }
  /// Slot number of a key; -1: none.
  int64_t Find(const Key& key) const {
    const auto it = index_.find(key);
    return it == index_.end() ? -1 : static_cast<int64_t>(it->second);
  }
  /// Keys that live, and their slots.
  const std::map<Key, uint32_t>& index() const { return index_; }
  size_t size() const { return index_.size(); }

 private:
  uint32_t TakeSlot() {
    if (free_.empty()) {
      slots_.emplace_back();
      return static_cast<uint32_t>(slots_.size() - 1);
    }
    const uint32_t slot = free_.back();
    free_.pop_back();
    return slot;
  }

  bool reuse_slots_;
  std::vector<Slot> slots_;
  std::map<Key, uint32_t> index_;
  std::vector<uint32_t> free_;
};

}  // namespace dmslam
