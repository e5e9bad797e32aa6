#include "dmslam/slam/tracking_phase.h"

#include <array>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

// A camera that was not tracked for so long is lost; until then frames are missing.
constexpr int64_t kLostAfterNs = 1'000'000'000 / 3;

}  // namespace

TrackingState TrackingPhase::state() const {
  constexpr std::array kStates = {TrackingState::kNotInitialized, TrackingState::kWaitingForMap,
                                  TrackingState::kTrial,          TrackingState::kTracking,
                                  TrackingState::kMissing,        TrackingState::kLost};
  static_assert(kStates.size() == std::variant_size_v<decltype(phase_)>);
  return kStates[phase_.index()];
}

std::optional<KeyframeId> TrackingPhase::awaited_second() const {
  const auto* waiting = std::get_if<WaitingForMap>(&phase_);
  return waiting != nullptr ? std::optional(waiting->second) : std::nullopt;
}

bool TrackingPhase::IsRefused() const {
  const auto* waiting = std::get_if<WaitingForMap>(&phase_);
  return waiting != nullptr && waiting->refused;
}

void TrackingPhase::Propose(KeyframeId second) {
  DMSLAM_CHECK(IsSearching(), "a first map is proposed where there is none");
  phase_ = WaitingForMap{second};
}

void TrackingPhase::OnRefused(KeyframeId second) {
  auto* waiting = std::get_if<WaitingForMap>(&phase_);
  if (waiting != nullptr && waiting->second == second) waiting->refused = true;
}

void TrackingPhase::BeginTrial(int64_t until_ns) {
  DMSLAM_CHECK(IsWaiting(), "a trial follows the proposal of a first map");
  phase_ = Trial{until_ns};
}

void TrackingPhase::BeginLost() { phase_ = Lost{}; }

void TrackingPhase::OnTracked(int64_t stamp_ns) {
  DMSLAM_CHECK(HasMap(), "frames are tracked in a map");
  const auto* trial = std::get_if<Trial>(&phase_);
  if (trial == nullptr || stamp_ns >= trial->until_ns) phase_ = Tracking{};
}

void TrackingPhase::OnMissing(int64_t since_ns) {
  DMSLAM_CHECK(HasMap(), "frames are missed in a map");
  if (since_ns > kLostAfterNs) {
    phase_ = Lost{};
  } else {
    phase_ = Missing{};
  }
}

void TrackingPhase::GiveUpMap() { phase_ = NotInitialized{}; }

}  // namespace dmslam
