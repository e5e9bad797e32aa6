#include "frontend/held_records.h"

#include <utility>

namespace dmslam {

void HeldRecords::BeginAnew() {
  held_.clear();
  promised_ = applied_;
  begins_anew_ = true;
}

void HeldRecords::Add(MapDelta delta, Version version, bool in_snapshot, bool ends_snapshot) {
  held_.push_back(
      {std::move(delta), version, std::exchange(begins_anew_, false), in_snapshot, ends_snapshot});
}

size_t HeldRecords::NumReady(bool all) const {
  size_t ready = held_.size();
  const auto is_ready = [&](const Held& held) {
    if (held.in_snapshot) return held.ends_snapshot;
    const MapEvent event = held.delta.event;
    return all || event == MapEvent::kSettled || event == MapEvent::kTurn || event == MapEvent::kEnded;
  };
  while (ready > 0 && !is_ready(held_[ready - 1])) --ready;
  return ready;
}

HeldRecords::Held HeldRecords::PopApplied() {
  Held held = std::move(held_.front());
  held_.pop_front();
  applied_ = held.version;
  return held;
}

}  // namespace dmslam
