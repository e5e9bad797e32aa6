#pragma once

#include <cstdint>

namespace dmslam {

/// How the first map is searched for.
enum class FirstMapMethod : uint8_t {
  kDlrsac,          ///< by the Initializer, whose pairs DLRSAC selects the static matches of
  kArsac,           ///< the same with ARSAC, behind the same gates
  kTwoFrameRansac,  ///< of two frames alone by RANSAC, without gates (the baseline)
  kTwoFramePaper,   ///< of two frames alone by DLRSAC, with the failure tests of its paper
};

}  // namespace dmslam
