#include "dmslam/tracking/motion_filter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr double kStep_s = 1.0 / kStepsPerSecond;
constexpr double kDepth = 2.0;

Matrix6d Isotropic(double sigma) { return sigma * sigma * Matrix6d::Identity(); }
Vector6d Sideways(double distance) { return distance * Vector6d::Unit(3); }
MotionFilter::Since After(double duration_s, double growth = 1.0) { return {duration_s, kDepth, growth}; }

/// Has moved sideways by 0.02 a step for a second.
MotionFilter Settled() {
  MotionFilter filter({}, After(kStep_s), Sideways(0.02), Isotropic(0.001), Isotropic(0.001));
  for (int k = 0; k < 30; ++k) filter.Update(After(kStep_s), Vector6d::Zero(), Isotropic(0.001));
  return filter;
}

TEST(MotionFilter, GoesOnAsBefore) {
  EXPECT_LT((Settled().Predict(After(kStep_s)).step - Sideways(0.02)).norm(), 1e-9);
  EXPECT_LT((Settled().Predict(After(2 * kStep_s)).step - Sideways(0.04)).norm(), 1e-9);
}

/// Tells the filter of a pose `error` from where it is expected, as the optimisation with a prior tells it:
/// joined with what was expected. `sigma` of the pose alone. Returns the correction.
Vector6d Tell(const MotionFilter::Since& since, const Vector6d& error, double sigma, MotionFilter* filter) {
  const Matrix6d expected = filter->Predict(since).covariance;
  const Matrix6d gain = expected * (expected + Isotropic(sigma)).inverse();
  const Vector6d correction = gain * error;
  filter->Update(since, correction, expected - gain * expected);
  return correction;
}

/// Somebody fills the picture, and what is left of the room says little of where the camera is.
TEST(MotionFilter, APoseThatIsHardlyKnownSaysLittleOfTheVelocity) {
  MotionFilter weak = Settled(), known = Settled();
  Tell(After(kStep_s), Sideways(0.05), 0.1, &weak);
  Tell(After(kStep_s), Sideways(0.05), 0.001, &known);
  EXPECT_LT((weak.Predict(After(kStep_s)).step - Sideways(0.02)).norm(), 0.005);
  EXPECT_GT((known.Predict(After(kStep_s)).step - Sideways(0.02)).norm(), 0.02);
}

TEST(MotionFilter, KnowsLessTheLongerItHasSeenNothing) {
  const MotionFilter filter = Settled();
  double before = 0;
  for (const double duration_s : {kStep_s, 2 * kStep_s, 5 * kStep_s}) {
    const double now = filter.Predict(After(duration_s)).covariance(3, 3);
    EXPECT_GT(now, 2 * before);
    before = now;
  }
}

TEST(MotionFilter, FollowsTheUnitOfTheMap) {
  EXPECT_LT((Settled().Predict(After(kStep_s, 3.0)).step - Sideways(0.06)).norm(), 1e-9);
}

/// A camera that a hand accelerates at random, seen at this rate by poses that err by `sigma`. The mean of
/// the squared errors of the predictions, in standard deviations and per dimension.
double NormalizedError(double step_s, double sigma) {
  constexpr int kFine = 20;
  const EvennessOptions options;
  Random random(3);
  Vector6d power;
  power << Eigen::Vector3d::Constant(options.rotation_rad),
      Eigen::Vector3d::Constant(options.translation * kDepth);
  power = power.array().square() * 1.5 * std::pow(30.0, 3);
  const auto gaussian = [&] {
    Vector6d sample;
    for (int i = 0; i < 6; ++i) sample[i] = random.Gaussian();
    return sample;
  };
  Vector6d velocity = Vector6d::Zero(), place = Vector6d::Zero(), told = Vector6d::Zero();
  std::optional<MotionFilter> filter;
  double sum = 0;
  int count = 0;
  for (int k = 0; k < 400; ++k) {
    for (int i = 0; i < kFine; ++i) {
      velocity += (power * step_s / kFine).cwiseSqrt().cwiseProduct(gaussian());
      place += velocity * step_s / kFine;
    }
    const Vector6d seen = place + sigma * gaussian();
    if (!filter) {
      if (k == 1)
        filter.emplace(options, After(step_s), Vector6d(seen - told), Isotropic(sigma), Isotropic(sigma));
      told = seen;
      continue;
    }
    const MotionFilter::Expected expected = filter->Predict(After(step_s));
    const Vector6d error = seen - (told + expected.step);
    const Matrix6d surprise = expected.covariance + Isotropic(sigma);
    sum += error.dot(surprise.inverse() * error) / 6;
    ++count;
    told = told + expected.step + Tell(After(step_s), error, sigma, &*filter);
  }
  return sum / count;
}

TEST(MotionFilter, KnowsHowWellItKnows) {
  for (const double step_s : {1.0 / 90, 1.0 / 30, 0.1}) {
    for (const double sigma : {0.001, 0.02}) {
      const double error = NormalizedError(step_s, sigma);
      EXPECT_GT(error, 0.8) << step_s << " s, " << sigma;
      EXPECT_LT(error, 1.2) << step_s << " s, " << sigma;
    }
  }
}

}  // namespace
}  // namespace dmslam
