// Runs one hot path a fixed number of times on made-up data, for counting instructions: scripts/bench.sh does
// that with callgrind. The same build counts the same, whatever else the machine does.
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "dmslam/features/matcher.h"
#include "dmslam/features/orb_extractor.h"
#include "dmslam/features/testing/synthetic_images.h"
#include "dmslam/optimization/pose_optimization.h"
#include "local_bundle.h"

namespace dmslam {
namespace {

using Path = std::function<void(int times)>;

/// The figures that are kept were counted with this many features.
OrbExtractorOptions ExtractorOptions() {
  OrbExtractorOptions options;
  options.num_features = 1000;
  return options;
}

void Extract(int times) {
  const GrayPixels image = testing::RandomRectangles(640, 480, 600, 1);
  OrbExtractor extractor(ExtractorOptions());
  FeatureSet features;
  for (int i = 0; i < times; ++i) extractor.Extract(image.View(), &features);
}

/// A picture with itself turned a little.
void Match(int times) {
  const GrayPixels image = testing::RandomRectangles(640, 480, 600, 1);
  OrbExtractor extractor(ExtractorOptions());
  FeatureSet sets[2];
  extractor.Extract(image.View(), &sets[0]);
  extractor.Extract(testing::Turned(image, 0.02).View(), &sets[1]);
  std::vector<Eigen::Vector2d> uv_px[2];
  for (int i = 0; i < 2; ++i) {
    for (const Keypoint& k : sets[i].keypoints) uv_px[i].emplace_back(k.x_px(), k.y_px());
  }
  FeatureGrid grid;
  grid.Build(uv_px[1], sets[1].keypoints, 640, 480);
  FeatureMatcher matcher;
  std::vector<FeatureMatch> matches;
  for (int i = 0; i < times; ++i) {
    matcher.MatchWindow({sets[0].keypoints, sets[0].descriptors, uv_px[0]},
                        {sets[1].keypoints, sets[1].descriptors, uv_px[1]}, grid, {}, &matches);
  }
}

void OptimizeOnePose(int times) {
  const SyntheticScene scene =
      MakeSyntheticScene({.seed = 5, .num_cameras = 1, .num_points = 300, .noise_px = 0.7});
  std::vector<PoseObservation> observations;
  for (const auto& o : scene.observations) {
    observations.push_back({scene.points[static_cast<size_t>(o.point)], o.uv_px});
  }
  Random random(6);
  const Rigid3d start = RandomPose(random, 0.01, 0.03) * scene.T_cam_world[0];
  PoseOptimizationReport report;
  for (int i = 0; i < times; ++i) OptimizePose(scene.camera, start, observations, {}, report);
}

void AdjustLocalBundle(int times) {
  const BundleProblem start = MakeLocalBundle(20, 2000, 6);
  for (int i = 0; i < times; ++i) {
    BundleProblem problem = start;
    AdjustBundle({}, problem);
  }
}

int Run(int argc, char** argv) {
  const std::map<std::string, Path> paths = {
      {"extract", Extract}, {"match", Match}, {"pose", OptimizeOnePose}, {"bundle", AdjustLocalBundle}};
  const auto path = argc == 3 ? paths.find(argv[1]) : paths.end();
  if (path == paths.end()) {
    std::fprintf(stderr, "usage: hot_paths extract|match|pose|bundle TIMES\n");
    return 1;
  }
  path->second(std::atoi(argv[2]));
  return 0;
}

}  // namespace
}  // namespace dmslam

int main(int argc, char** argv) { return dmslam::Run(argc, argv); }
