#include "dmslam/evaluation/alignment.h"

#include <gtest/gtest.h>

#include "dmslam/evaluation/statistics.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

std::vector<Eigen::Vector3d> RandomPoints(size_t count, uint64_t seed) {
  Random random(seed);
  std::vector<Eigen::Vector3d> points;
  for (size_t i = 0; i < count; ++i) {
    points.emplace_back(random.Gaussian(), 2 * random.Gaussian(), 0.5 * random.Gaussian());
  }
  return points;
}

std::vector<Eigen::Vector3d> Image(const Sim3d& transform, const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector3d> images;
  for (const Eigen::Vector3d& point : points) images.push_back(transform * point);
  return images;
}

double SquaredDistance(const Sim3d& transform, const std::vector<Eigen::Vector3d>& source,
                       const std::vector<Eigen::Vector3d>& target) {
  double sum = 0;
  for (size_t i = 0; i < source.size(); ++i) sum += (transform * source[i] - target[i]).squaredNorm();
  return sum;
}

TEST(Alignment, RecoversAnySimilarity) {
  for (uint64_t seed = 1; seed <= 50; ++seed) {
    Random random(seed);
    const Sim3d truth(ExpSo3({3 * random.Gaussian(), 3 * random.Gaussian(), 3 * random.Gaussian()}),
                      {random.Gaussian(), 10 * random.Gaussian(), random.Gaussian()},
                      random.Uniform(0.1, 10));
    const auto source = RandomPoints(3 + seed % 20, seed);
    const auto found = AlignPoints(source, Image(truth, source), Alignment::kSim3);
    ASSERT_TRUE(found.has_value());
    EXPECT_NEAR(found->scale, truth.scale, 1e-9 * truth.scale);
    EXPECT_LT(AngleBetween(found->rotation, truth.rotation), 1e-7);
    EXPECT_LT((found->translation - truth.translation).norm(), 1e-8);
  }
}

TEST(Alignment, PointsThatComeOneByOneFarAwayAreAlignedAsWell) {
  const Sim3d truth(ExpSo3({0.3, 1, -2}), {4e5, 5e6, 3e2}, 2.5);  // such as UTM coordinates
  PointPairs pairs;
  Random random(3);
  for (int i = 0; i < 100'000; ++i) {
    const Eigen::Vector3d point(random.Gaussian(), random.Gaussian(), random.Gaussian());
    pairs.Add(point, truth * point);
  }
  const Sim3d found = pairs.Align(Alignment::kSim3).value();
  EXPECT_NEAR(found.scale, truth.scale, 1e-7);
  EXPECT_LT(AngleBetween(found.rotation, truth.rotation), 1e-7);
  EXPECT_LT((found.translation - truth.translation).norm(), 1e-6);
}

TEST(Alignment, NoNearbyTransformFitsNoisyPointsBetter) {
  const auto source = RandomPoints(40, 7);
  auto target = Image(Sim3d(ExpSo3({0.3, 1, -2}), {1, 2, 3}, 1.7), source);
  Random noise(8);
  for (auto& point : target)
    point += 0.1 * Eigen::Vector3d(noise.Gaussian(), noise.Gaussian(), noise.Gaussian());
  for (const Alignment alignment : {Alignment::kSe3, Alignment::kSim3}) {
    const Sim3d best = *AlignPoints(source, target, alignment);
    const double cost = SquaredDistance(best, source, target);
    for (int i = 0; i < 200; ++i) {
      Sim3d other(
          ExpSo3(0.01 * Eigen::Vector3d(noise.Gaussian(), noise.Gaussian(), noise.Gaussian())) *
              best.rotation,
          best.translation + 0.01 * Eigen::Vector3d(noise.Gaussian(), noise.Gaussian(), noise.Gaussian()),
          best.scale);
      if (alignment == Alignment::kSim3) other.scale *= 1 + 0.01 * noise.Gaussian();
      EXPECT_GT(SquaredDistance(other, source, target), cost);
    }
  }
}

TEST(Alignment, MirroredPointsStillGiveARotation) {
  const auto source = RandomPoints(20, 3);
  auto target = source;
  for (auto& point : target) point.x() = -point.x();
  const Sim3d found = *AlignPoints(source, target, Alignment::kSim3);
  EXPECT_NEAR(found.rotation.toRotationMatrix().determinant(), 1.0, 1e-12);
}

TEST(Alignment, RefusesWhatIsNotDetermined) {
  const std::vector<Eigen::Vector3d> one_place(5, Eigen::Vector3d(1, 2, 3));
  std::vector<Eigen::Vector3d> line;
  for (int i = 0; i < 5; ++i) line.emplace_back(i, 2.0 * i, -i);
  const auto fine = RandomPoints(5, 1);
  EXPECT_FALSE(AlignPoints(one_place, fine, Alignment::kSim3));
  EXPECT_FALSE(AlignPoints(line, line, Alignment::kSe3));
  EXPECT_FALSE(AlignPoints(std::span(fine).first(2), std::span(fine).first(2), Alignment::kSim3));
  EXPECT_TRUE(AlignPoints(one_place, fine, Alignment::kNone));
}

TEST(Alignment, NamesRoundTrip) {
  for (const char* name : {"none", "scale", "se3", "sim3"})
    EXPECT_EQ(AlignmentName(*ParseAlignment(name)), name);
  EXPECT_FALSE(ParseAlignment("Sim3"));
}

TEST(Statistics, OfAKnownList) {
  const std::vector<double> errors = {3, 1, 2, 6};
  const Statistics statistics = ComputeStatistics(errors);
  EXPECT_EQ(statistics.count, 4u);
  EXPECT_DOUBLE_EQ(statistics.mean, 3);
  EXPECT_DOUBLE_EQ(statistics.median, 2.5);
  EXPECT_DOUBLE_EQ(statistics.min, 1);
  EXPECT_DOUBLE_EQ(statistics.max, 6);
  EXPECT_DOUBLE_EQ(statistics.sse, 50);
  EXPECT_DOUBLE_EQ(statistics.rmse, std::sqrt(12.5));
  EXPECT_DOUBLE_EQ(statistics.std, std::sqrt(3.5));
  EXPECT_EQ(ComputeStatistics({}).count, 0u);
}

}  // namespace
}  // namespace dmslam
