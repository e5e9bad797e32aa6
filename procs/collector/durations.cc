#include "collector/durations.h"

#include <algorithm>
#include <cmath>

namespace dmslam {
namespace {

constexpr double kLeastMs = 0.01, kStep = 1.01;
constexpr size_t kMostBins = 2048;      // up to two hours; what takes longer counts as that
constexpr size_t kMostStretches = 160;  // half as many at least, in a run that is not short

size_t BinOf(double ms) {
  if (!(ms >= kLeastMs)) return 0;
  const double steps = std::log(ms / kLeastMs) / std::log(kStep);
  return std::min(1 + static_cast<size_t>(steps), kMostBins - 1);
}

/// The middle of a bin.
double DurationOf(size_t bin) {
  return bin == 0 ? 0.0 : kLeastMs * std::pow(kStep, static_cast<double>(bin) - 0.5);
}

}  // namespace

void DurationHistogram::Add(double ms) {
  const size_t bin = BinOf(ms);
  if (counts_.size() <= bin) counts_.resize(bin + 1);
  ++counts_[bin];
  ++count_;
}

void DurationHistogram::Add(const DurationHistogram& other) {
  if (counts_.size() < other.counts_.size()) counts_.resize(other.counts_.size());
  for (size_t bin = 0; bin < other.counts_.size(); ++bin) counts_[bin] += other.counts_[bin];
  count_ += other.count_;
}

double DurationHistogram::Quantile(double q) const {
  const auto rank = static_cast<size_t>(q * static_cast<double>(count_));
  size_t passed = 0;
  for (size_t bin = 0; bin < counts_.size(); ++bin) {
    passed += counts_[bin];
    if (passed > rank || passed == count_) return DurationOf(bin);
  }
  return 0.0;
}

void DurationHistory::Add(double ms) {
  if (stretches_.empty() || stretches_.back().count() == stretch_) {
    if (stretches_.size() == kMostStretches) {  // two become one
      for (size_t i = 0; i < kMostStretches / 2; ++i) {
        DurationHistogram joined = std::move(stretches_[2 * i]);
        joined.Add(stretches_[2 * i + 1]);
        stretches_[i] = std::move(joined);
      }
      stretches_.resize(kMostStretches / 2);
      stretch_ *= 2;
    }
    stretches_.emplace_back();
  }
  stretches_.back().Add(ms);
}

DurationHistogram DurationHistory::Between(double from, double to) const {
  const auto count = static_cast<double>(stretches_.size());
  const auto begin = static_cast<size_t>(std::lround(from * count)),
             end = static_cast<size_t>(std::lround(to * count));
  DurationHistogram between;
  for (size_t i = begin; i < end; ++i) between.Add(stretches_[i]);
  return between;
}

}  // namespace dmslam
