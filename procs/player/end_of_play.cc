#include "player/end_of_play.h"

#include <algorithm>

#include "dmslam/runtime/exit_codes.h"
#include "dmslam/wire/channels.h"

namespace dmslam {
namespace {

constexpr int64_t kTellEveryNs = 200'000'000;
constexpr int64_t kNobodyWhenStoppedNs = 2'000'000'000;
constexpr int64_t kMapperSilentNs = 5'000'000'000;  // nobody to wait for

}  // namespace

void EndOfPlay::OnStatus(const std::string& channel, std::span<const uint8_t> bytes, uint32_t session,
                         int64_t now_ns) {
  if (channel == channels::kMapperStatus) {
    const auto status = wire::Decode<MapperStatus>(bytes);
    if (!status || status->head.session != session) return;
    mapper_heard_ns_ = now_ns;
    mapper_done_ = status->state == MapperStatus::State::kDone;
  } else if (channel == channels::kFrontendStatus) {
    const auto status = wire::Decode<FrontendStatus>(bytes);
    if (status && status->head.session == session) frontend_heard_ns_ = now_ns;
  }
}

bool EndOfPlay::OnSequenceDone(int64_t now_ns) {
  heard_ = heard_ || WasSaid() || all_done_.SaidAgain(now_ns);
  return heard_;
}

bool EndOfPlay::IsDue(int64_t now_ns) {
  if (since_ns_ == 0) since_ns_ = now_ns;
  if (now_ns < due_ns_) return false;
  due_ns_ = now_ns + kTellEveryNs;
  return true;
}

std::optional<int> EndOfPlay::ExitCode(int64_t now_ns, bool stopped) const {
  if (heard_) {
    const bool mapper_silent = now_ns - std::max(mapper_heard_ns_, since_ns_) > kMapperSilentNs;
    return mapper_done_ || mapper_silent ? std::optional(0) : std::nullopt;
  }
  if (stopped && now_ns - since_ns_ > kNobodyWhenStoppedNs) return 0;
  if (now_ns - std::max(frontend_heard_ns_, since_ns_) > kNoFrontendNs) return kExitNoFrontend;
  return std::nullopt;
}

}  // namespace dmslam
