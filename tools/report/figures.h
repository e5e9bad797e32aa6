#pragma once

#include <filesystem>
#include <vector>

#include "markdown.h"

namespace dmslam {

/// The report's pictures. Draws into `out`/pictures: per sequence and setting, both systems' median runs over
/// the ground truth and their relative errors over time; for all sequences, ATE and coverage of every seed.
/// Adds the pictures that the first seed's runs left in their folder (pictures/), and those in
/// `out`/figures/<sequence>/.
std::vector<ReportPicture> DrawPictures(const Results& results, const std::filesystem::path& out);

}  // namespace dmslam
