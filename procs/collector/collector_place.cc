#include "collector/collector_place.h"

#include <utility>

namespace dmslam {
namespace {

constexpr int64_t kSettlingNs = 3'000'000'000;  // of two that began together one leaves within this time

}  // namespace

CollectorPlace::CollectorPlace(const Setup& setup, int64_t now_ns)
    : setup_(setup),
      others_(setup.own_id),
      listens_until_ns_(now_ns + (setup.others_may_be ? OtherReaders::kListenNs : 0)) {}

void CollectorPlace::Hear(const OtherReaders::Word& word, int64_t now_ns) {
  if (setup_.others_may_be) others_.Hear(word, now_ns);
}

bool CollectorPlace::MayBegin(int64_t session, int64_t now_ns) const {
  return !others_.Find(session, now_ns) && (goes_on_ || now_ns >= listens_until_ns_);
}

int64_t CollectorPlace::deadline_ns(int64_t now_ns) const {
  return !begun_ns_ && !goes_on_ && now_ns < listens_until_ns_ ? listens_until_ns_ : INT64_MAX;
}

std::optional<CollectorPlace::Yield> CollectorPlace::TakeYield(int64_t session, int64_t now_ns) {
  const auto other = others_.Find(session, now_ns);
  if (!other || IsMine(other->id, now_ns)) return std::nullopt;
  const bool waits = !begun_ns_ && setup_.takes_over;
  if (!waits) return Yield{Yield::How::kLeave, other->name};
  if (std::exchange(told_to_wait_, true)) return std::nullopt;
  return Yield{Yield::How::kWait, other->name};
}

/// Whether it is the other one that leaves.
bool CollectorPlace::IsMine(int64_t other_id, int64_t now_ns) const {
  if (!begun_ns_) return false;
  return AtWorkNs(now_ns) > kSettlingNs || (!goes_on_ && other_id > setup_.own_id);
}

}  // namespace dmslam
