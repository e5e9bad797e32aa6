#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/synthetic/scene.h"

namespace dmslam {

/// A view that shows what an earlier one showed, though the views between them do not lead there.
struct Revisit {
  size_t frame = 0;          ///< When it is seen again (index of a frame).
  size_t earlier_frame = 0;  ///< The earlier view that shows the most of it.
  double shared_share = 0;   ///< How much of the smaller view the two have in common.
  double distance_m = 0;     ///< Between the two places.
  double angle_rad = 0;      ///< Between the two viewing directions.
  int graph_distance =
      0;  ///< Steps over views that share enough, before the revisit; -1 where none lead there.
};

struct RevisitOptions {
  int frame_step = 10;          ///< Views are taken every so many frames, as keyframes would be.
  double max_depth_m = 5.0;     ///< What is farther is too small to be recognised from near by.
  double voxel_m = 0.3;         ///< Two views share a place when they see into the same cube of this side.
  double linked_share = 0.15;   ///< Views that share so much are neighbours in the graph of views.
  double revisit_share = 0.5;   ///< A revisit shares at least so much ...
  double max_angle_rad = 0.6;   ///< ... and looks the same way within so much.
  int min_graph_distance = 11;  ///< It is one only where the graph's way is at least so long.
};

/// All revisits of a camera path through a still scene, in the order of their frames. The first view of a
/// revisit closes the loop: the views after it are neighbours of the earlier ones and no revisits of their
/// own.
std::vector<Revisit> FindRevisits(const Scene& scene, const Camera& camera,
                                  std::span<const Rigid3d> T_world_cam, const RevisitOptions& options);

}  // namespace dmslam
