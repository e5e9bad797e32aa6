#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace dmslam {

/// How often which durations occurred, in memory that does not grow with their number. Each is known to 1 %;
/// those of less than a hundredth of a millisecond count as 0, and those of more than two hours as that.
class DurationHistogram {
 public:
  void Add(double ms);
  void Add(const DurationHistogram& other);
  size_t count() const { return count_; }
  /// The duration [ms] that a share q of all, 0 to 1, does not reach; 0 where there is none.
  double Quantile(double q) const;

 private:
  std::vector<uint32_t> counts_;  ///< by the logarithm of the duration
  size_t count_ = 0;
};

/// The same as a run goes on: durations in the order in which they came, in stretches that become longer with
/// the run, so that there are never many.
class DurationHistory {
 public:
  void Add(double ms);
  DurationHistogram All() const { return Between(0.0, 1.0); }
  /// Those from a share of the run on to another, to the nearest ends of stretches (an eightieth of the run
  /// at most apart).
  DurationHistogram Between(double from, double to) const;

 private:
  std::vector<DurationHistogram> stretches_;
  size_t stretch_ = 1;  ///< how many durations each of them has, but the last
};

}  // namespace dmslam
