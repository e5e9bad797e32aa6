#pragma once

#include <cstddef>
#include <string>

namespace dmslam {

/// Frames of a recording that are played black, from one on.
struct BlackOut {
  size_t from = 0;
  double seconds = 0;
};
/// After frame `from` of a recording frame `to` is played.
struct Jump {
  size_t from = 0;
  size_t to = 0;
};

/// What --black-out ("FROM,SECONDS") and --jump ("FROM,TO") say. Throw InputError that names what is wrong.
BlackOut ParseBlackOut(const std::string& text);
Jump ParseJump(const std::string& text);

}  // namespace dmslam
