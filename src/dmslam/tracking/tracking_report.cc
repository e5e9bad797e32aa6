#include "dmslam/tracking/tracking_report.h"

#include <array>

#include "dmslam/camera/image_cells.h"

namespace dmslam {

void TrackingReport::TakePoseAway() {
  if (HasPose()) outcome = num_elsewhere > num_static ? Outcome::kContradicted : Outcome::kNotSeen;
}

TrackingReport CountClasses(const Camera& camera, const TrackedFrame& frame) {
  TrackingReport report;
  std::array<int, kNumCells> fixed{}, moving{};
  for (size_t i = 0; i < frame.classes.size(); ++i) {
    const size_t cell = CellOf(camera, frame.features->uv_px[i]);
    if (frame.classes[i] == FeatureClass::kUsed) {
      ++fixed[cell];
    } else if (frame.classes[i] == FeatureClass::kMoving) {
      ++moving[cell];
      ++report.num_moving;
    } else if (frame.classes[i] == FeatureClass::kRejected) {
      ++report.num_unknown;
    }
  }
  int occupied = 0, mostly_moving = 0;
  for (size_t cell = 0; cell < fixed.size(); ++cell) {
    if (fixed[cell] > 0) ++report.cells;
    if (fixed[cell] + moving[cell] > 0) ++occupied;
    if (moving[cell] > fixed[cell]) ++mostly_moving;
  }
  report.moving_share = occupied == 0 ? 0.0 : static_cast<double>(mostly_moving) / occupied;
  return report;
}

}  // namespace dmslam
