#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace dmslam {

/// Points in space by the cube that they lie in: those in a box are found without looking at all of them.
class PointGrid {
 public:
  /// `edge`: of a cube, positive; a quarter of a usual box is a good one.
  explicit PointGrid(double edge) : edge_(edge) {}

  void Add(const Eigen::Vector3d& point, uint32_t index) { cubes_[KeyOf(CubeOf(point))].push_back(index); }

  /// Calls `visit(index)` for each point in the box, and for some around it.
  template <typename Visit>
  void ForEachIn(const Eigen::AlignedBox3d& box, const Visit& visit) const {
    const Cube low = CubeOf(box.min()), high = CubeOf(box.max());
    const auto visit_all = [&](const std::vector<uint32_t>& points) { std::ranges::for_each(points, visit); };
    const Eigen::Array3d count = (high - low + 1).cast<double>();
    if (count.prod() > static_cast<double>(cubes_.size())) {
      for (const auto& [key, points] : cubes_) visit_all(points);
      return;
    }
    for (int64_t x = low.x(); x <= high.x(); ++x) {
      for (int64_t y = low.y(); y <= high.y(); ++y) {
        for (int64_t z = low.z(); z <= high.z(); ++z) {
          const auto found = cubes_.find(KeyOf({x, y, z}));
          if (found != cubes_.end()) visit_all(found->second);
        }
      }
    }
  }

 private:
  using Cube = Eigen::Array<int64_t, 3, 1>;

  // What is farther away than this many cubes lies in the last one.
  static constexpr double kFarthest = 1 << 20;

  Cube CubeOf(const Eigen::Vector3d& point) const {
    return (point.array() / edge_).floor().max(-kFarthest).min(kFarthest - 1).cast<int64_t>();
  }
  static uint64_t KeyOf(const Cube& cube) {
    const auto part = [](int64_t n) { return static_cast<uint64_t>(n + (1 << 20)); };
    return part(cube.x()) << 42 | part(cube.y()) << 21 | part(cube.z());
  }

  double edge_;
  std::unordered_map<uint64_t, std::vector<uint32_t>> cubes_;
};

}  // namespace dmslam
