#include "dmslam/dataset/play_changes.h"

#include <cmath>
#include <optional>
#include <sstream>
#include <utility>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

/// Two numbers with a comma between them and nothing else.
std::optional<std::pair<double, double>> ParsePair(const std::string& text) {
  std::istringstream stream(text);
  double first = 0, second = 0;
  char comma = 0;
  const bool whole = stream >> first >> comma >> second && comma == ',' && (stream >> std::ws).eof();
  if (!whole || first < 0 || first != std::floor(first)) return std::nullopt;
  return std::pair(first, second);
}

}  // namespace

BlackOut ParseBlackOut(const std::string& text) {
  const auto pair = ParsePair(text);
  if (!pair || pair->second <= 0) {
    throw InputError("--black-out " + text +
                     ": write FROM,SECONDS: a frame and a time above zero, as 300,1.5");
  }
  return {static_cast<size_t>(pair->first), pair->second};
}

Jump ParseJump(const std::string& text) {
  const auto pair = ParsePair(text);
  if (!pair || pair->second <= pair->first || pair->second != std::floor(pair->second)) {
    throw InputError("--jump " + text + ": write FROM,TO: two frames, the second one later, as 300,360");
  }
  return {static_cast<size_t>(pair->first), static_cast<size_t>(pair->second)};
}

}  // namespace dmslam
