#include "dmslam/tracking/usual_speed.h"

#include <algorithm>
#include <cmath>

#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr double kKnownS = 1.5;        // of believed motion, before it says what is usual
constexpr double kForgottenS = 30;     // of motion count in full; what was before, by half each time
constexpr double kUsualShare = 0.8;    // of the time it goes no faster than usual
constexpr double kHurry = 2.5;         // times its usual speed...
constexpr double kLateHurry = 2.0;     // ...and that, in frames that rest on less...
constexpr double kHurryS = 0.5;        // ...for no longer...
constexpr double kLonger = 0.5;        // ...after which it goes so many times as fast
constexpr double kAlways = 0.16;       // so much counts as usual for any camera [depths/s]
constexpr double kSlowest = 0.001;     // the first bin's end [depths/s]
constexpr double kPerBin = 1.1;        // from the end of a bin to the next
constexpr double kLongestStepS = 5.0;  // no step counts for more time than this
constexpr size_t kReserved = 64;

double SecondsOfHurry(double seconds) {
  const double hurry_s = std::min(seconds, kHurryS);
  return hurry_s + kLonger * (seconds - hurry_s);
}

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
  const auto is_old = [&](const Recent& past) { return stamp_ns - past.stamp_ns >= kShortestNs; };
  const auto young = std::ranges::find_if_not(recent_, is_old);
  if (young - recent_.begin() > 1) recent_.erase(recent_.begin(), young - 1);
  recent_.push_back({pose, stamp_ns});
}

void UsualSpeed::Count(double speed, double seconds) {
  const double bin = std::log(std::max(speed, kSlowest) / kSlowest) / std::log(kPerBin);
  seconds_[static_cast<size_t>(std::min(std::ceil(bin), static_cast<double>(kBins - 1)))] += seconds;
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
  most_usual_ = std::max(most_usual_.value_or(0), *usual_);
}

std::optional<UsualSpeed::Step> UsualSpeed::StepTo(const Map& map, const PlacedPose& pose,
                                                   int64_t stamp_ns) const {
  const auto old = std::find_if(recent_.rbegin(), recent_.rend(),
                                [&](const Recent& past) { return stamp_ns - past.stamp_ns >= kShortestNs; });
  if (old == recent_.rend()) return std::nullopt;
  const auto before = map.ResolvePose(old->pose.reference), now = map.ResolvePose(pose.reference);
  if (!before || !now || before->map_id() != now->map_id()) return std::nullopt;
  const std::optional<double> depth = map.MedianDepth(*now->keyframe);
  if (!depth || *depth <= 0) return std::nullopt;
  const Rigid3d from = old->pose.In(*before), to = pose.In(*now);
  return Step{(from.Center() - to.Center()).norm() / *depth, SecondsFromTo(old->stamp_ns, stamp_ns)};
}

bool UsualSpeed::IsTooFar(const Map& map, const PlacedPose& pose, int64_t stamp_ns) const {
  const std::optional<Step> step = StepTo(map, pose, stamp_ns);
  return step && IsTooFar(step->moved, step->seconds);
}

bool UsualSpeed::IsTooFar(double moved, double seconds) const {
  return usual_ && moved > kHurry * *usual_ * SecondsOfHurry(seconds);
}

bool UsualSpeed::WasTooFar(double moved, double seconds) const {
  return most_usual_ && moved > kLateHurry * *most_usual_ * SecondsOfHurry(seconds);
}

}  // namespace dmslam
