#include "dmslam/tracking/usual_speed.h"

#include <algorithm>
#include <cmath>

#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr int64_t kOverNs = 200'000'000;  // a speed is that over this time...
constexpr int64_t kSlackNs = 5'000'000;   // ...stamps being a little off
constexpr double kKnownS = 1.5;           // of believed motion, before it says what is usual
constexpr double kForgottenS = 30;        // of motion count in full; what was before, by half each time
constexpr double kUsualShare = 0.8;       // of the time it goes no faster than usual
constexpr double kHurryS = 0.5;           // no hurry takes longer...
constexpr double kLonger = 0.5;           // ...and what goes on is so many times as fast
constexpr double kAlways = 0.16;          // so much counts as usual for any camera [depths/s]
constexpr double kSlowest = 0.001;        // the first bin's end [depths/s]
constexpr double kPerBin = 1.1;           // from the end of a bin to the next
constexpr double kLongestStepS = 1.0;     // a pose stands for no more time than this
constexpr size_t kReserved = 64;

}  // namespace

UsualSpeed::UsualSpeed() { recent_.reserve(kReserved); }

void UsualSpeed::OnPose(const Map& map, const PlacedPose& pose, int64_t stamp_ns) {
  const std::optional<Step> step = StepTo(map, pose, stamp_ns);
  if (step) {
    const bool jumped = IsTooFar(step->moved, step->seconds);
    const double since_s = jumped ? step->seconds : SecondsFromTo(recent_.back().stamp_ns, stamp_ns);
    Count(step->moved / step->seconds, std::min(kLongestStepS, since_s));
    if (jumped) Interrupt();
  }
  const auto is_old = [&](const Recent& past) { return stamp_ns - past.stamp_ns >= kOverNs - kSlackNs; };
  const auto young = std::ranges::find_if_not(recent_, is_old);
  if (young - recent_.begin() > 1) recent_.erase(recent_.begin(), young - 1);
  recent_.push_back({pose, stamp_ns});
}

void UsualSpeed::Count(double speed, double seconds) {
  const double bin = std::log(std::max(speed, kSlowest) / kSlowest) / std::log(kPerBin);
  seconds_[std::min(static_cast<size_t>(std::ceil(bin)), kBins - 1)] += seconds;
  known_s_ += seconds;
  if (known_s_ >= kForgottenS) {
    for (double& counted : seconds_) counted /= 2;
    known_s_ /= 2;
  }
  if (known_s_ >= kKnownS) FindUsual();
}

void UsualSpeed::FindUsual() {
  double seconds = 0, end = kSlowest;
  for (const double counted : seconds_) {
    seconds += counted;
    if (seconds >= kUsualShare * known_s_) break;
    end *= kPerBin;
  }
  usual_ = std::max(kAlways, end);
}

std::optional<UsualSpeed::Step> UsualSpeed::StepTo(const Map& map, const PlacedPose& pose,
                                                   int64_t stamp_ns) const {
  const auto old = std::find_if(recent_.rbegin(), recent_.rend(), [&](const Recent& past) {
    return stamp_ns - past.stamp_ns >= kOverNs - kSlackNs;
  });
  if (old == recent_.rend()) return std::nullopt;
  const std::optional<Rigid3d> from = old->pose.In(map), to = pose.In(map);
  const std::optional<KeyframeId> reference = map.ResolveKeyframe(pose.reference);
  const std::optional<double> depth = reference ? map.MedianDepth(map.At(*reference)) : std::nullopt;
  if (!from || !to || !depth) return std::nullopt;
  return Step{(from->Center() - to->Center()).norm() / *depth, SecondsFromTo(old->stamp_ns, stamp_ns)};
}

bool UsualSpeed::IsTooFar(const Map& map, const PlacedPose& pose, int64_t stamp_ns) const {
  const std::optional<Step> step = StepTo(map, pose, stamp_ns);
  return step && IsTooFar(step->moved, step->seconds);
}

bool UsualSpeed::IsTooFar(double moved, double seconds, double hurry) const {
  if (!usual_) return false;
  const double hurry_s = std::min(seconds, kHurryS);
  return moved > hurry * *usual_ * (hurry_s + kLonger * (seconds - hurry_s));
}

}  // namespace dmslam
