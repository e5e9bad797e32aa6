#pragma once

#include <span>

#include "dmslam/dataset/image.h"
#include "dmslam/motion_segmentation/static_selector.h"

namespace dmslam {

/// What a selector made of a pair, as a picture: the first frame with its matched features (static green,
/// others yellow) and the cells (chosen ones framed green) with their numbers and states; the second frame
/// with the features' way from the first; on the right the couple matrix (rows couple, columns are coupled;
/// chosen cells marked), where there is one. Above the second frame how many are static, or why it was
/// refused.
ColorImage DrawSelection(const ColorImage& frame0, const ColorImage& frame1, std::span<const Match> matches,
                         const StaticSelection& selection);

}  // namespace dmslam
