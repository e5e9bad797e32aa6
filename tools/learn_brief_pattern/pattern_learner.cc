#include "pattern_learner.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

/// A test, and for which pairs of patches its two outcomes differ (1) or not (0).
struct Candidate {
  BriefTest test{};
  std::vector<uint16_t> same_corner;    ///< the two patches of a pair
  std::vector<uint16_t> other_corners;  ///< the first patch of a pair and the second one of another pair
  double same_mean = 0.0;
  double other_mean = 0.0;
  bool chosen = false;
};

/// Distances between descriptors made of the tests chosen so far.
struct Distances {
  std::vector<uint16_t> same_corner;
  std::vector<uint16_t> other_corners;
};

BriefTest RandomTest(double sigma_px, Random* random) {
  constexpr double kRadius = 14.5, kLeastDistance = 2.5;
  const auto point = [&](int8_t* x, int8_t* y) {
    double px, py;
    do {
      px = std::round(sigma_px * random->Gaussian());
      py = std::round(sigma_px * random->Gaussian());
    } while (std::hypot(px, py) > kRadius);
    *x = static_cast<int8_t>(px);
    *y = static_cast<int8_t>(py);
  };
  BriefTest test{};
  do {
    point(&test.x0, &test.y0);
    point(&test.x1, &test.y1);
  } while (std::hypot(test.x0 - test.x1, test.y0 - test.y1) < kLeastDistance);
  return test;
}

Candidate Evaluate(const BriefTest& test, const std::vector<PatchPair>& pairs) {
  // Pairs stand in the order of their images, so a pair a few places on is another corner of the same
  // photograph mostly.
  constexpr size_t kOther = 29;
  const SteeredPattern steered(std::span(&test, 1));
  const auto bit_of = [&](const KeypointPatch& patch) {
    const uint16_t* places = steered.Places(patch.angle);
    return patch.pixels[places[0]] < patch.pixels[places[1]];
  };
  Candidate candidate;
  candidate.test = test;
  const size_t n = pairs.size();
  std::vector<bool> first(n), second(n);
  for (size_t i = 0; i < n; ++i) {
    first[i] = bit_of(pairs[i].first);
    second[i] = bit_of(pairs[i].second);
  }
  size_t same = 0, other = 0;
  for (size_t i = 0; i < n; ++i) {
    same += candidate.same_corner.emplace_back(first[i] != second[i]);
    other += candidate.other_corners.emplace_back(first[i] != second[(i + kOther) % n]);
  }
  candidate.same_mean = static_cast<double>(same) / static_cast<double>(n);
  candidate.other_mean = static_cast<double>(other) / static_cast<double>(n);
  return candidate;
}

double Sum(const std::vector<uint16_t>& values) {
  uint64_t sum = 0;
  for (const uint16_t value : values) sum += value;
  return static_cast<double>(sum);
}

double SumOfSquares(const std::vector<uint16_t>& values) {
  uint64_t sum = 0;
  for (const uint16_t value : values) sum += static_cast<uint64_t>(value) * value;
  return static_cast<double>(sum);
}

/// Sum of the distances where the test's outcomes differ.
double Overlap(const std::vector<uint16_t>& distances, const std::vector<uint16_t>& differ) {
  uint32_t sum = 0;
  for (size_t i = 0; i < distances.size(); ++i) sum += static_cast<uint32_t>(distances[i]) * differ[i];
  return sum;
}

/// Mean and variance of the distances once a test is added.
struct Moments {
  double sum, sum_of_squares, count;

  Moments(const std::vector<uint16_t>& distances)
      : sum(Sum(distances)),
        sum_of_squares(SumOfSquares(distances)),
        count(static_cast<double>(distances.size())) {}
  double MeanWith(double test_mean) const { return sum / count + test_mean; }
  double VarianceWith(double test_mean, double overlap) const {
    const double mean = MeanWith(test_mean);
    return (sum_of_squares + 2.0 * overlap) / count + test_mean - mean * mean;
  }
};

/// The candidate that tells same from other corners best together with those chosen before: the largest
/// difference of the mean distances in units of their spread.
size_t BestAddition(const std::vector<Candidate>& candidates, const Distances& distances) {
  const Moments same(distances.same_corner), other(distances.other_corners);
  size_t best = 0;
  double best_separation = -1.0;
  for (size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& candidate = candidates[i];
    if (candidate.chosen) continue;
    const double gap = other.MeanWith(candidate.other_mean) - same.MeanWith(candidate.same_mean);
    const double same_variance =
        same.VarianceWith(candidate.same_mean, Overlap(distances.same_corner, candidate.same_corner));
    const double other_variance =
        other.VarianceWith(candidate.other_mean, Overlap(distances.other_corners, candidate.other_corners));
    const double separation = gap / std::sqrt(same_variance + other_variance);
    if (separation > best_separation) {
      best_separation = separation;
      best = i;
    }
  }
  return best;
}

void Add(const std::vector<uint16_t>& differ, std::vector<uint16_t>* distances) {
  for (size_t i = 0; i < differ.size(); ++i)
    (*distances)[i] = static_cast<uint16_t>((*distances)[i] + differ[i]);
}

}  // namespace

std::vector<KeypointPatch> CutPatches(const GrayView& image, const FeatureSet& features,
                                      const Pyramid& pyramid) {
  const ImageKernels& kernels = KernelsOn(SimdPath::kBest);
  ImagePyramid levels;
  levels.SetUp(image.width, image.height, pyramid, 32);
  levels.MakeFirst(image, kernels);
  std::vector<PaddedImage> smooth(levels.size());
  ImageSmoother smoother;
  for (size_t i = 0; i < levels.size(); ++i) {
    if (i > 0) levels.ShrinkInto(i, kernels);
    smoother.Smooth(levels.level(i).image, kernels, &smooth[i]);
  }
  std::vector<KeypointPatch> patches(features.size());
  for (size_t i = 0; i < features.size(); ++i) {
    const Keypoint& keypoint = features.keypoints[i];
    const ImagePyramid::Level& level = levels.level(keypoint.octave);
    const long x = std::lround((keypoint.x_px() + 0.5) / level.scale_x - 0.5);
    const long y = std::lround((keypoint.y_px() + 0.5) / level.scale_y - 0.5);
    for (long row = 0; row < 31; ++row) {
      std::memcpy(patches[i].pixels + 32 * row,
                  smooth[keypoint.octave].row(static_cast<int>(y + row - 15)) + x - 15, 32);
    }
    patches[i].angle = keypoint.angle;
  }
  return patches;
}

std::vector<BriefTest> LearnPattern(const std::vector<PatchPair>& pairs,
                                    const PatternLearnerOptions& options) {
  if (pairs.size() < 1000) throw InputError("too few corners to learn from: give more or larger images");
  Random random(DeriveSeed(options.seed, 0, "brief pattern"));
  std::vector<Candidate> candidates;
  for (int i = 0; i < options.num_candidates; ++i) {
    candidates.push_back(Evaluate(RandomTest(options.sigma_px, &random), pairs));
  }
  Distances distances{std::vector<uint16_t>(pairs.size()), std::vector<uint16_t>(pairs.size())};
  std::vector<BriefTest> tests;
  while (tests.size() < 256) {
    Candidate& best = candidates[BestAddition(candidates, distances)];
    best.chosen = true;
    Add(best.same_corner, &distances.same_corner);
    Add(best.other_corners, &distances.other_corners);
    tests.push_back(best.test);
  }
  return tests;
}

}  // namespace dmslam
