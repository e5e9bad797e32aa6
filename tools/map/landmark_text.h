#pragma once

#include <string>

#include "landmark_proof.h"

namespace dmslam {

/// The proof of one landmark, for people: several lines.
std::string ProofText(const LandmarkProofs& proofs, const LandmarkHistory& history);

/// Of which run all that is proven, in one paragraph.
std::string RunText(const LandmarkProofs& proofs);

}  // namespace dmslam
