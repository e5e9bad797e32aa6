#include "dmslam/evaluation/statistics.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace dmslam {

double Median(std::span<const double> values) {
  if (values.empty()) return 0;
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const size_t middle = sorted.size() / 2;
  return sorted.size() % 2 == 1 ? sorted[middle] : 0.5 * (sorted[middle - 1] + sorted[middle]);
}

Statistics ComputeStatistics(std::span<const double> errors) {
  Statistics statistics;
  statistics.count = errors.size();
  if (errors.empty()) return statistics;
  const double n = static_cast<double>(errors.size());
  statistics.min = *std::min_element(errors.begin(), errors.end());
  statistics.max = *std::max_element(errors.begin(), errors.end());
  statistics.median = Median(errors);
  for (const double error : errors) {
    statistics.mean += error / n;
    statistics.sse += error * error;
  }
  double squared_deviations = 0;
  for (const double error : errors) {
    squared_deviations += (error - statistics.mean) * (error - statistics.mean);
  }
  statistics.std = std::sqrt(squared_deviations / n);
  statistics.rmse = std::sqrt(statistics.sse / n);
  return statistics;
}

}  // namespace dmslam
