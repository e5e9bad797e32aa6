#include "frontend/last_words.h"

#include <algorithm>
#include <iterator>

namespace dmslam {
namespace {

constexpr size_t kPortion = 8;  // records
constexpr int64_t kPortionEveryNs = 8'000'000;

}  // namespace

std::vector<FrontendEvent> LastWords::NextPortion(int64_t now_ns) {
  if (now_ns < next_portion_ns_) return {};
  next_portion_ns_ = now_ns + kPortionEveryNs;
  const size_t count = std::min(kPortion, events_.size() - told_);
  const auto begin = std::make_move_iterator(events_.begin() + static_cast<std::ptrdiff_t>(told_));
  told_ += count;
  return {begin, begin + static_cast<std::ptrdiff_t>(count)};
}

}  // namespace dmslam
