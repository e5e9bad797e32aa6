#pragma once

#include <span>
#include <string>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/evaluation/ate.h"
#include "dmslam/evaluation/plot.h"

namespace dmslam {

/// Which of the world's axes points up, and how a plot shows it.
struct UpAxis {
  int axis = 2;     // 0, 1, 2: x, y, z
  double sign = 1;  // -1: the axis points down
};

/// The axis of the world that hand-held cameras hold upright on average (the mean of their image's upward
/// direction).
UpAxis FindUpAxis(std::span<const StampedPose> trajectory);

/// A trajectory over its ground truth: seen from the top and from the side, coloured by error, and the error
/// over time. `report` is the usable result of EvaluateAte on the same two trajectories. Lines are not drawn
/// across gaps in tracking.
PlotFigure TrajectoryFigure(std::span<const StampedPose> ground_truth, std::span<const StampedPose> estimate,
                            const AteReport& report, const std::string& title,
                            const std::string& subtitle = {});

}  // namespace dmslam
