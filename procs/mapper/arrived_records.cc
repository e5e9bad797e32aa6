#include "mapper/arrived_records.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "dmslam/wire/channels.h"

namespace dmslam {

void ArrivedRecords::MakeDue() {
  std::move(new_.begin(), new_.end(), std::back_inserter(due_));
  new_.clear();
}

ArrivedRecords::Arrived ArrivedRecords::TakeFirst() {
  Arrived first = std::move(due_.front());
  due_.pop_front();
  return first;
}

bool ArrivedRecords::AreUrgent(size_t in_streams) const {
  const auto is_keyframe = [](const Arrived& arrived) {
    return arrived.record.channel == channels::kKeyframe;
  };
  return std::ranges::any_of(due_, is_keyframe) || new_.size() + in_streams > kMostMayWait;
}

}  // namespace dmslam
