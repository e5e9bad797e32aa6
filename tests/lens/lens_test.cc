// Rendered frames with freiburg1's lens, as config/TUM1.yaml has it, and with a fisheye lens: what the
// frontend matches on obeys the true motion where the lens is taken out of the keypoints, and does not where
// it is left in.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/image.h"
#include "dmslam/dataset/trajectory.h"
#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/features/orb_extractor.h"
#include "dmslam/geometry/two_view.h"
#include "dmslam/map/keyframe.h"
#include "dmslam/motion_segmentation/match_frames.h"
#include "dmslam/synthetic/sequence_writer.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;
constexpr double kTruePx = 12.0;  // farther from the true motion than any lens bends it: a mismatch

/// Two frames from places a second apart on a half sphere, and the true motion between them.
struct TwoFrames {
  FeatureSet first, second;
  Rigid3d T_second_first;
};

FeatureSet Extract(TumSequence& sequence, size_t index) {
  const GrayImage image = DecodeGray(sequence.Read(index), sequence.Name(index));
  OrbExtractorOptions options;
  options.num_features = 1000;
  OrbExtractor extractor(options);
  FeatureSet set;
  extractor.Extract({image.data.data(), image.width, image.height, image.width}, &set);
  return set;
}

TwoFrames Render(const Camera& camera) {
  SequenceOptions options;
  options.camera = camera;
  options.camera.fps = 1;
  options.world.path.kind = PathKind::kHalfsphere;
  options.frames = 2;
  options.gray = options.png = true;
  options.world.actors = 0;
  options.render.samples = 1;
  const fs::path folder = fs::path(testing::TempDir()) / "lens_test";
  fs::remove_all(folder);
  WriteSequence(options, folder.string(), {});
  TumSequence sequence(folder.string());
  const auto poses = ReadGroundTruth((folder / "groundtruth.txt").string()).poses;
  return {Extract(sequence, 0), Extract(sequence, 1), poses[1].T_world_cam.Inverse() * poses[0].T_world_cam};
}

/// Median distance of the matches from their true epipolar lines, in both directions [px].
double MedianEpipolarError(const TwoFrames& frames, const Camera& camera) {
  const auto first = MakeFrameFeatures(frames.first, camera, Pyramid());
  const auto second = MakeFrameFeatures(frames.second, camera, Pyramid());
  FeatureMatcher matcher;
  MatchingOptions matching;
  matching.use_window = matching.check_orientation = false;
  const Eigen::Matrix3d F =
      FundamentalFromEssential(EssentialFromPose(frames.T_second_first), camera.Ideal(), camera.Ideal());
  std::vector<double> errors;
  for (const Match& match : MatchFrames(*first, *second, camera, matching, &matcher)) {
    const double error =
        std::sqrt(std::max(EpipolarDistanceSquared(F, match.uv0_px, match.uv1_px),
                           EpipolarDistanceSquared(F.transpose(), match.uv1_px, match.uv0_px)));
    if (error < kTruePx) errors.push_back(error);
  }
  EXPECT_GT(errors.size(), 100u);
  std::nth_element(errors.begin(), errors.begin() + static_cast<ptrdiff_t>(errors.size() / 2), errors.end());
  return errors[errors.size() / 2];
}

void ExpectLensIsTakenOut(const Camera& camera) {
  const TwoFrames frames = Render(camera);
  const double applied_px = MedianEpipolarError(frames, camera);
  const double ignored_px = MedianEpipolarError(frames, camera.WithoutLens());
  EXPECT_LT(applied_px, 0.5);
  EXPECT_GT(ignored_px, 2 * applied_px);
  testing::Test::RecordProperty("applied_px", std::to_string(applied_px));
  testing::Test::RecordProperty("ignored_px", std::to_string(ignored_px));
}

TEST(Lens, Freiburg1IsTakenOutOfTheKeypoints) {
  const char* source_dir = std::getenv("DMSLAM_SOURCE_DIR");
  const fs::path project = source_dir != nullptr ? source_dir : fs::current_path();
  const Camera camera = LoadCamera((project / "config" / "TUM1.yaml").string());
  ExpectLensIsTakenOut(camera);
}

/// 640 pixels of 112 degrees.
TEST(Lens, FisheyeIsTakenOutOfTheKeypoints) {
  Camera camera{640, 480, 330, 330, 319.5, 239.5};
  camera.lens = Lens::kFisheye;
  camera.k1 = -0.012, camera.k2 = 0.031, camera.k3 = -0.018, camera.k4 = 0.003;
  ExpectLensIsTakenOut(camera);
}

}  // namespace
}  // namespace dmslam
