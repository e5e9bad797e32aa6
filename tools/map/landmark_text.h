#pragma once

#include <string>

#include "landmark_proof.h"

namespace dmslam {

/// The proof of one landmark, for people: several lines.
std::string ProofText(const LandmarkProofs& proofs, const LandmarkHistory& history);

/// Of which runs all that is proven, a paragraph for each.
std::string RunsText(const LandmarkProofs& proofs);

}  // namespace dmslam
