#pragma once

#include <filesystem>
#include <vector>

#include "markdown.h"

namespace dmslam {

/// Draws the report's pictures into `out`/pictures: per sequence and setting, both systems' median runs over
/// the ground truth and their relative errors over time; for all sequences, ATE and coverage of every seed.
std::vector<ReportPicture> DrawPictures(const Results& results, const std::filesystem::path& out);

}  // namespace dmslam
