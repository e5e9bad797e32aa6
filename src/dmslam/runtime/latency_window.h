#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace dmslam {

/// The newest values of a duration, and their quantiles.
class LatencyWindow {
 public:
  explicit LatencyWindow(size_t capacity = 300) : capacity_(capacity) {}

  void Add(double value_ms) {
    if (values_.size() < capacity_) {
      values_.push_back(value_ms);
    } else {
      values_[next_] = value_ms;
    }
    next_ = (next_ + 1) % capacity_;
  }
  /// 0..1; zero without values.
  double Quantile(double q) const {
    if (values_.empty()) return 0.0;
    std::vector<double> sorted = values_;
    const size_t index =
        std::min(sorted.size() - 1, static_cast<size_t>(q * static_cast<double>(sorted.size())));
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<ptrdiff_t>(index), sorted.end());
    return sorted[index];
  }

 private:
  size_t capacity_;
  size_t next_ = 0;
  std::vector<double> values_;
};

}  // namespace dmslam
