#pragma once

#include <optional>
#include <span>
#include <vector>

namespace dmslam {

/// Mean squared error over the variance, of the matches that agree with a pose: where one motion explains
/// them it is less. What agrees by chance, or with a pose between two motions, lies anywhere within the
/// bound.
inline constexpr double kOneMotionChi2 = 1.3;

/// How well a pose explains the elders.
struct ElderFit {
  double mean_chi2 = 0;  ///< mean squared error over the variance, of those that agree with the pose
  double cost = 0;       ///< sum over all elders of the same errors, each of them bounded
};

struct ElderOptions {
  bool elders = true;         ///< off: all matched landmarks decide at once
  int min_elders = 40;        ///< the oldest so many matched landmarks decide the pose first...
  double share = 0.4;         ///< ...or this share of the matches, if that is more...
  double agreement = 0.6;     ///< ...provided that this share of them agree
  double max_chi2 = 7.8;      ///< younger ones farther from that pose have no say
  double young_weight = 0.5;  ///< all younger ones together weigh at most this much of what the elders weigh

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Switch("tracking.elders", elders,
             "the landmarks that stood still for longest decide a pose first, and bind the younger ones");
    v.InBaseline("off");
    v.InPaper("off");
  }
};

/// The landmarks that stood still for longest decide first; the others only refine what agrees with them, and
/// never weigh more. People who stood still while they were mapped are younger than the room around them, so
/// they cannot carry the camera away when they walk on, however much of the image they fill.
class Elders {
 public:
  /// `trusted_age_s`: whoever is so old counts as an elder in any case.
  Elders(const ElderOptions& options, double trusted_age_s)
      : options_(options), trusted_age_s_(trusted_age_s) {}

  /// Age [s] from which a matched landmark is an elder; none where there are too few matches to tell them
  /// apart, or where it is switched off.
  std::optional<double> FromAge(std::span<const double> ages_s);
  /// Whether elders of this age are older than people stand.
  bool AreTrusted(double age_s) const { return age_s >= trusted_age_s_; }
  /// Whether elders who agree on a pose with this mean squared error (over the variance) may be torn between
  /// the room and somebody who has just begun to move: then they are asked again, from the pose of all.
  static bool AreTorn(double mean_chi2) { return mean_chi2 > kOneMotionChi2; }
  /// Whether the pose found when they are asked again counts: those that gave it agree closely, and it
  /// explains the elders as a whole better than the first pose does.
  static bool SecondPoseCounts(const ElderFit& first, const ElderFit& second) {
    return second.mean_chi2 <= kOneMotionChi2 && second.cost < first.cost;
  }
  /// Whether so many of the elders agree on a pose that it binds the others.
  bool Decide(int agreeing, size_t elders) const {
    return agreeing >= static_cast<int>(options_.agreement * static_cast<double>(elders));
  }
  /// Whether a younger landmark with this squared, normalised distance from the elders' pose has a say.
  bool Admit(double chi2) const { return chi2 <= options_.max_chi2; }
  /// The factor on the weights of `young` landmarks beside so many agreeing elders.
  double YoungFactor(int agreeing, int young) const;

 private:
  ElderOptions options_;
  double trusted_age_s_;
  std::vector<double> sorted_ages_s_;  ///< workspace
};

}  // namespace dmslam
