#pragma once

#include <string>
#include <vector>

#include "landmark_proof.h"

namespace dmslam {

/// Writes the proofs of these landmarks as one JSON object: the file with the run that wrote it, all runs of
/// which landmarks come, and a line for each landmark. The file is there when it is complete. Throws
/// InputError where it cannot be written.
void WriteProofJson(const std::string& path, const LandmarkProofs& proofs,
                    const std::vector<const LandmarkHistory*>& histories);

}  // namespace dmslam
