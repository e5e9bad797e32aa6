#include "dmslam/synthetic/revisits.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <unordered_map>

#include "dmslam/synthetic/renderer.h"

namespace dmslam {
namespace {

/// The cubes of space that a view sees into, sorted.
std::vector<uint64_t> SeenVoxels(const Scene& scene, const Camera& camera, Renderer& renderer,
                                 const Rigid3d& T_world_cam, const RevisitOptions& options) {
  const std::vector<float> depth_m =
      renderer.RenderDepth(scene.meshes, Instant{T_world_cam, {}, {}}, nullptr);
  std::vector<uint64_t> voxels;
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const float depth =
          depth_m[static_cast<size_t>(y) * static_cast<size_t>(camera.width_px) + static_cast<size_t>(x)];
      if (depth <= 0 || depth > options.max_depth_m) continue;
      const Eigen::Vector3d p_world = T_world_cam * (static_cast<double>(depth) * camera.Ray({x, y}));
      uint64_t key = 0;
      for (int k = 0; k < 3; ++k) {
        key = (key << 21) | (static_cast<uint64_t>(
                                 static_cast<int64_t>(std::floor(p_world[k] / options.voxel_m)) + (1 << 20)) &
                             0x1fffff);
      }
      voxels.push_back(key);
    }
  }
  std::sort(voxels.begin(), voxels.end());
  voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
  return voxels;
}

/// Steps from one node to all others; -1 where there is no way.
std::vector<int> Distances(const std::vector<std::vector<size_t>>& neighbours, size_t from) {
  std::vector<int> distance(neighbours.size(), -1);
  std::deque<size_t> queue{from};
  distance[from] = 0;
  while (!queue.empty()) {
    const size_t at = queue.front();
    queue.pop_front();
    for (const size_t next : neighbours[at]) {
      if (distance[next] >= 0) continue;
      distance[next] = distance[at] + 1;
      queue.push_back(next);
    }
  }
  return distance;
}

/// The graph of views so far, and how much each earlier view shares with a new one.
class ViewGraph {
 public:
  explicit ViewGraph(const RevisitOptions& options) : options_(options) {}

  /// Shares of the smaller view that the new view has in common with each earlier one.
  std::vector<double> Shares(const std::vector<uint64_t>& voxels) const {
    std::vector<double> shares(sizes_.size(), 0);
    for (const uint64_t voxel : voxels) {
      const auto found = views_of_.find(voxel);
      if (found == views_of_.end()) continue;
      for (const size_t view : found->second) shares[view] += 1;
    }
    for (size_t i = 0; i < shares.size(); ++i)
      shares[i] /= static_cast<double>(std::max<size_t>(1, std::min(sizes_[i], voxels.size())));
    return shares;
  }
  void Add(const std::vector<uint64_t>& voxels, const std::vector<size_t>& neighbours) {
    const size_t view = sizes_.size();
    sizes_.push_back(voxels.size());
    for (const uint64_t voxel : voxels) views_of_[voxel].push_back(view);
    neighbours_.push_back(neighbours);
    for (const size_t neighbour : neighbours) neighbours_[neighbour].push_back(view);
  }
  std::vector<int> DistancesFromLast() const { return Distances(neighbours_, neighbours_.size() - 1); }

 private:
  RevisitOptions options_;
  std::unordered_map<uint64_t, std::vector<size_t>> views_of_;  // Looked up only; its order reaches nothing.
  std::vector<size_t> sizes_;
  std::vector<std::vector<size_t>> neighbours_;
};

}  // namespace

std::vector<Revisit> FindRevisits(const Scene& scene, const Camera& camera,
                                  std::span<const Rigid3d> T_world_cam, const RevisitOptions& options) {
  Camera small = camera.WithoutLens();
  const double shrink = 96.0 / camera.width_px;
  small.width_px = 96;
  small.height_px = std::max(32, static_cast<int>(camera.height_px * shrink));
  small.fx_px *= shrink;
  small.fy_px *= shrink;
  small.cx_px *= shrink;
  small.cy_px *= shrink;
  Renderer renderer(small, RenderOptions{});
  ViewGraph graph(options);
  std::vector<Revisit> revisits;
  const auto step = static_cast<size_t>(options.frame_step);
  const auto angle_to = [&](size_t a, size_t b) {
    return AngleBetween(T_world_cam[a].rotation, T_world_cam[b].rotation);
  };
  for (size_t frame = 0; frame < T_world_cam.size(); frame += step) {
    const std::vector<uint64_t> voxels = SeenVoxels(scene, small, renderer, T_world_cam[frame], options);
    const std::vector<double> shares = graph.Shares(voxels);
    const std::vector<int> distances = shares.empty() ? std::vector<int>() : graph.DistancesFromLast();
    std::vector<size_t> near, far;
    Revisit best;
    for (size_t i = 0; i < shares.size(); ++i) {
      if (shares[i] < options.linked_share && i + 1 < shares.size()) continue;
      const bool is_far = distances[i] < 0 || distances[i] + 1 >= options.min_graph_distance;
      (is_far ? far : near).push_back(i);
      if (!is_far || shares[i] < options.revisit_share || shares[i] <= best.shared_share) continue;
      if (angle_to(frame, i * step) > options.max_angle_rad) continue;
      best = {frame,
              i * step,
              shares[i],
              (T_world_cam[frame].translation - T_world_cam[i * step].translation).norm(),
              angle_to(frame, i * step),
              distances[i] < 0 ? -1 : distances[i] + 1};
    }
    if (best.shared_share > 0) {
      revisits.push_back(best);
      near.insert(near.end(), far.begin(), far.end());
    }
    graph.Add(voxels, near);
  }
  return revisits;
}

}  // namespace dmslam
