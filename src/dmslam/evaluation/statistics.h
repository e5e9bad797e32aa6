#pragma once

#include <cstddef>
#include <span>

namespace dmslam {

/// What is said about a list of errors, as `evo` says it. In the errors' own unit; `sse` in its square.
struct Statistics {
  size_t count = 0;
  double rmse = 0;
  double mean = 0;
  double median = 0;
  double std = 0;  // of the population (divided by n)
  double min = 0;
  double max = 0;
  double sse = 0;  // sum of squared errors
};

/// Statistics of `errors`; all zero where there are none.
Statistics ComputeStatistics(std::span<const double> errors);

/// The middle value (mean of the two middle ones where the count is even); zero where there are none.
double Median(std::span<const double> values);

}  // namespace dmslam
