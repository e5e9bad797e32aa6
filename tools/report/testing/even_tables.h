#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>

namespace dmslam {

/// Every line of a table in a Markdown page has as many bars as its first.
inline void ExpectEvenTables(const std::string& page) {
  std::istringstream lines(page);
  long wanted = 0;
  for (std::string line; std::getline(lines, line);) {
    const long bars = std::count(line.begin(), line.end(), '|');
    if (bars == 0 || wanted == 0) wanted = bars;
    EXPECT_EQ(bars, wanted) << line;
  }
}

}  // namespace dmslam
