#include "dmslam/geometry/point_grid.h"

#include <gtest/gtest.h>

#include <set>

#include "dmslam/util/random.h"

namespace dmslam {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

class Points : public testing::Test {
 protected:
  Points() {
    Random random(1);
    for (uint32_t i = 0; i < 2000; ++i) {
      points_.emplace_back(random.Uniform(-9, 9), random.Uniform(-9, 9), random.Uniform(-9, 9));
      grid_.Add(points_.back(), i);
    }
  }
  std::multiset<uint32_t> Visited(const AlignedBox3d& box) const {
    std::multiset<uint32_t> visited;
    grid_.ForEachIn(box, [&](uint32_t i) { visited.insert(i); });
    return visited;
  }

  std::vector<Vector3d> points_;
  PointGrid grid_{0.7};
};

TEST_F(Points, AllInTheBoxAreVisitedOnceAndFewOthers) {
  const AlignedBox3d box(Vector3d(-3, 1, -8), Vector3d(0.5, 2, -4));
  const std::multiset<uint32_t> visited = Visited(box);
  const AlignedBox3d around(box.min() - Vector3d::Constant(0.7), box.max() + Vector3d::Constant(0.7));
  for (uint32_t i = 0; i < points_.size(); ++i) {
    const size_t times = visited.count(i);
    EXPECT_TRUE(times == 1 || (times == 0 && !box.contains(points_[i]))) << i;
    EXPECT_TRUE(times == 0 || around.contains(points_[i])) << i;
  }
}

TEST_F(Points, BoxesWithoutEndVisitAllOnce) {
  const std::multiset<uint32_t> visited = Visited({Vector3d::Constant(-1e300), Vector3d::Constant(1e300)});
  EXPECT_EQ(visited.size(), points_.size());
  EXPECT_EQ(std::set<uint32_t>(visited.begin(), visited.end()).size(), points_.size());
}

TEST_F(Points, PointsFarAwayAreFound) {
  grid_.Add(Vector3d(1e12, -1e12, 0), 5000);
  EXPECT_EQ(Visited({Vector3d(1e11, -1e13, -1), Vector3d(1e13, -1e11, 1)}).count(5000), 1U);
}

}  // namespace
}  // namespace dmslam
