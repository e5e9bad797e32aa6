#include "dmslam/tracking/tracking_report.h"

#include <algorithm>
#include <array>

namespace dmslam {
namespace {

constexpr int kCellColumns = 8, kCellRows = 6;

size_t CellOf(const Eigen::Vector2d& uv_px, const Camera& camera) {
  const int column =
      std::clamp(static_cast<int>(uv_px.x() * kCellColumns / camera.width_px), 0, kCellColumns - 1);
  const int row = std::clamp(static_cast<int>(uv_px.y() * kCellRows / camera.height_px), 0, kCellRows - 1);
  return static_cast<size_t>(row * kCellColumns + column);
}

}  // namespace

TrackingReport CountClasses(const Camera& camera, const TrackedFrame& frame) {
  TrackingReport report;
  std::array<int, kCellColumns * kCellRows> fixed{}, moving{};
  for (size_t i = 0; i < frame.classes.size(); ++i) {
    const size_t cell = CellOf(frame.features->uv_px[i], camera);
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
