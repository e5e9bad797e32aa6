#pragma once

#include <algorithm>
#include <vector>

namespace dmslam {

/// Into a sorted list of different values; nothing where it is there.
template <typename T>
void InsertSorted(std::vector<T>& values, const T& value) {
  const auto at = std::lower_bound(values.begin(), values.end(), value);
  if (at == values.end() || *at != value) values.insert(at, value);
}

/// Out of a sorted list; nothing where it is not there.
template <typename T>
void EraseSorted(std::vector<T>& values, const T& value) {
  const auto at = std::lower_bound(values.begin(), values.end(), value);
  if (at != values.end() && *at == value) values.erase(at);
}

}  // namespace dmslam
