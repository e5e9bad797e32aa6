#pragma once

#include "dmslam/features/types.h"

namespace dmslam {

/// Which instructions count bits. All give the same result; the later ones need the CPU to have them.
enum class HammingPath { kBest, kPortable, kPopcnt, kAvx2 };

/// Index of the descriptor nearest to `query` among `count` > 0 consecutive ones; the first of several
/// equals.
using NearestChildFunction = int (*)(const Descriptor& query, const Descriptor* candidates, int count);

/// True when this CPU can run `path`.
bool HasHammingPath(HammingPath path);

/// The function for a path, or for the best one that this CPU has.
NearestChildFunction NearestChildOn(HammingPath path);

}  // namespace dmslam
