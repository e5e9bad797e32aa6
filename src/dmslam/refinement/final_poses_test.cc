#include "dmslam/refinement/final_poses.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/optimization/reprojection.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int kLandmarks = 200, kKeyframes = 8, kFrames = 240;
constexpr int kWeakBegin = 100, kWeakEnd = 112;  // frames that see a corner of the scene only

/// A hand-held camera that sways in front of a wall with furniture.
Rigid3d TruthAt(double t, double aside = 0.0) {
  const Eigen::Vector3d center(aside + 0.4 * std::sin(0.9 * t), 0.1 * std::sin(1.7 * t),
                               0.15 * std::cos(1.1 * t));
  const Eigen::Vector3d turn(0.05 * std::sin(1.3 * t), 0.08 * std::sin(0.8 * t), 0.02 * std::cos(1.5 * t));
  return Rigid3d(ExpSo3(turn), center).Inverse();
}

double TimeOf(int frame) { return frame / 30.0; }

/// A map whose keyframes know the landmarks to some pixels of noise, and frames that saw them.
class PosesAtTheEnd : public testing::Test {
 protected:
  PosesAtTheEnd() : map_(TestCamera(), Pyramid()) {
    for (int i = 0; i < kLandmarks; ++i) {
      Landmark landmark;
      landmark.id = LandmarkId::Make(1, static_cast<uint64_t>(i) + 1);
      landmark.map_id = 1;
      const double x = random_.Uniform(-0.9, 0.9), y = random_.Uniform(-0.6, 0.6);
      truth_.emplace_back(x, y, random_.Uniform(1.5, 2.5));
      landmark.p_world = truth_.back();
      landmark.reference = landmark.first_keyframe = KeyframeId::Make(1, 0);
      map_.AddLandmark(std::move(landmark));
    }
    for (int k = 0; k < kKeyframes; ++k) AddKeyframe(k);
    for (int i = 0; i < kLandmarks; ++i) PlaceByKeyframes(LandmarkId::Make(1, static_cast<uint64_t>(i) + 1));
  }

  /// One step of Gauss and Newton from the truth: the noise of its views, and no more.
  void PlaceByKeyframes(LandmarkId id) {
    Landmark landmark = *map_.FindLandmark(id);
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (const auto& [keyframe_id, feature] : landmark.observations) {
      const Keyframe& keyframe = *map_.FindKeyframe(keyframe_id);
      const Eigen::Vector3d p_cam = keyframe.T_cam_world * landmark.p_world;
      const Matrix23 J =
          ProjectionJacobian(map_.camera().Ideal(), p_cam) * keyframe.T_cam_world.rotation.toRotationMatrix();
      information += J.transpose() * J;
      gradient += J.transpose() * (map_.camera().Ideal().Project(p_cam) - keyframe.features->uv_px[feature]);
    }
    map_.SetPosition(map_.At(id), landmark.p_world - information.ldlt().solve(gradient));
  }

  Rigid3d TruthOf(int frame) const { return TruthAt(TimeOf(frame), frame < aside_from_ ? 0.0 : 0.7); }

  std::optional<Eigen::Vector2d> See(int landmark, int frame) {
    const Eigen::Vector3d p_cam = TruthOf(frame) * truth_[static_cast<size_t>(landmark)];
    const auto uv_px = map_.camera().Project(p_cam);
    if (!uv_px) return std::nullopt;
    const double du = random_.Gaussian(), dv = random_.Gaussian();
    return *uv_px + 0.7 * Eigen::Vector2d(du, dv);
  }

  void AddKeyframe(int number) {
    const int frame = number * kFrames / kKeyframes;
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(1, static_cast<uint32_t>(frame));
    keyframe.map_id = 1;
    keyframe.T_cam_world = TruthAt(TimeOf(frame));
    FeatureSet features;
    std::vector<LandmarkId> seen;
    for (int i = number % 2; i < kLandmarks; i += 2) {
      const auto uv_px = See(i, frame);
      if (!uv_px || uv_px->minCoeff() < 0) continue;
      Keypoint keypoint;
      keypoint.x_q4 = static_cast<uint16_t>(std::lround(16 * uv_px->x()));
      keypoint.y_q4 = static_cast<uint16_t>(std::lround(16 * uv_px->y()));
      features.keypoints.push_back(keypoint);
      features.descriptors.emplace_back();
      seen.push_back(LandmarkId::Make(1, static_cast<uint64_t>(i) + 1));
    }
    keyframe.features = MakeFrameFeatures(features, map_.camera(), map_.pyramid());
    keyframe.landmarks.resize(seen.size());
    const KeyframeId id = keyframe.id;
    map_.AddKeyframe(std::move(keyframe));
    for (size_t i = 0; i < seen.size(); ++i)
      map_.SetObservation(map_.At(id), static_cast<uint16_t>(i), map_.At(seen[i]));
  }

  std::vector<Sight> SightsAt(int frame) {
    std::vector<Sight> sights;
    for (int i = 0; i < kLandmarks; ++i) {
      const auto uv_px = See(i, frame);
      const bool weak = frame >= kWeakBegin && frame < kWeakEnd;
      if (!uv_px || (weak && (uv_px->x() > 180 || uv_px->y() > 200))) continue;
      sights.push_back({LandmarkId::Make(1, static_cast<uint64_t>(i) + 1), uv_px->cast<float>(), 0, 0});
    }
    return sights;
  }

  FinalPose PoseOf(int frame) {
    const std::vector<Sight> sights = SightsAt(frame);
    FinalPose pose;
    pose.pose.frame_index = static_cast<uint32_t>(frame);
    pose.pose.stamp_ns = static_cast<int64_t>(1e9 * TimeOf(frame));
    const PoseOptimizationReport report = MeasureCheckedPose(map_, TruthOf(frame), sights, &pose);
    EXPECT_TRUE(Agrees(report));
    pose.SetPose(*map_.FindKeyframe(KeyframeId::Make(1, 0)), report.T_cam_world);
    return pose;
  }

  double Error(const FramePose& pose) const {
    const Rigid3d truth = TruthOf(static_cast<int>(pose.frame_index));
    return (pose.T_cam_world.Center() - truth.Center()).norm();
  }

  double RmsError(const std::vector<FramePose>& poses, uint32_t begin, uint32_t end) const {
    double sum = 0.0;
    int count = 0;
    for (const FramePose& pose : poses) {
      if (pose.frame_index < begin || pose.frame_index >= end) continue;
      sum += std::pow(Error(pose), 2);
      ++count;
    }
    return std::sqrt(sum / count);
  }

  std::vector<FramePose> Told(int begin, int end, bool improved, int threads = 1,
                              const MotionModelOptions& motion = {}) {
    random_ = Random(5);
    FinalPoses poses(threads, motion);
    for (int frame = end - 1; frame >= begin; --frame) poses.Add(map_, PoseOf(frame));
    while (improved && !poses.IsSettled()) poses.Improve(map_);
    return poses.Take();
  }

  int aside_from_ = kFrames;  ///< frames that are taken from somewhere else
  Random random_{3};
  MapEditor map_;
  std::vector<Eigen::Vector3d> truth_;
};

TEST_F(PosesAtTheEnd, NoPoseRestsOnOneSight) {
  constexpr int kFrame = kWeakBegin + 5;
  const Rigid3d truth = TruthAt(TimeOf(kFrame));
  std::vector<Sight> sights = SightsAt(kFrame);
  FinalPose without;
  MeasureCheckedPose(map_, truth, sights, &without);
  // A mismatch just before the lens, two pixels from where it should be: it agrees with a wrong pose.
  const Eigen::Vector3d p_cam(0.01, 0.02, 0.1);
  Landmark false_one;
  false_one.id = LandmarkId::Make(1, kLandmarks + 1);
  false_one.map_id = 1;
  false_one.p_world = truth.Inverse() * p_cam;
  false_one.reference = false_one.first_keyframe = KeyframeId::Make(1, 0);
  map_.AddLandmark(false_one);
  const Eigen::Vector2d uv_px = *map_.camera().Project(p_cam) + Eigen::Vector2d(1.6, 1.2);
  sights.push_back({false_one.id, uv_px.cast<float>(), 0, 0});

  FinalPose pose;
  const PoseOptimizationReport report = MeasureCheckedPose(map_, truth, sights, &pose);
  EXPECT_TRUE(Agrees(report));
  EXPECT_EQ(pose.sights.size(), without.sights.size());
  EXPECT_EQ(std::count_if(pose.sights.begin(), pose.sights.end(),
                          [&](const Sight& sight) { return sight.landmark == false_one.id; }),
            0);
  EXPECT_LT((pose.measured.Center() - without.measured.Center()).norm(), 1e-6);
}

TEST_F(PosesAtTheEnd, AllFramesPlaceTheLandmarksBetterAndThoseTheFrames) {
  const auto before = Told(0, kFrames, false), after = Told(0, kFrames, true);
  EXPECT_LT(RmsError(after, 0, kFrames), 0.5 * RmsError(before, 0, kFrames));
}

TEST_F(PosesAtTheEnd, FramesThatSawACornerFollowTheirNeighbours) {
  const auto before = Told(0, kFrames, false), after = Told(0, kFrames, true);
  EXPECT_GT(RmsError(before, kWeakBegin, kWeakEnd), 0.008);
  EXPECT_LT(RmsError(after, kWeakBegin, kWeakEnd), 0.15 * RmsError(before, kWeakBegin, kWeakEnd));
}

TEST_F(PosesAtTheEnd, WhereTheCameraIsPutElsewhereFramesThatSawACornerAreNotDrawnThere) {
  aside_from_ = kWeakEnd;
  MotionModelOptions anywhere;
  anywhere.speed_slack = 1e9;
  anywhere.turn_slack_rad = 1e9;
  const auto seen = Told(0, kFrames, false), drawn = Told(0, kFrames, true, 1, anywhere);
  const auto after = Told(0, kFrames, true);
  EXPECT_GT(RmsError(drawn, kWeakBegin, kWeakEnd), 2.0 * RmsError(seen, kWeakBegin, kWeakEnd));
  EXPECT_LT(RmsError(after, kWeakBegin, kWeakEnd), RmsError(seen, kWeakBegin, kWeakEnd));
}

TEST_F(PosesAtTheEnd, FewFramesDoNotCarryTheirLandmarksAway) {
  const auto before = Told(20, 32, false), after = Told(20, 32, true);
  EXPECT_LT(RmsError(after, 20, 32), RmsError(before, 20, 32));
}

TEST_F(PosesAtTheEnd, AreTheSameWhateverTheNumberOfThreads) {
  const auto alone = Told(0, kFrames, true);
  for (const int threads : {2, 3}) {
    const auto together = Told(0, kFrames, true, threads);
    ASSERT_EQ(together.size(), alone.size());
    for (size_t k = 0; k < alone.size(); ++k) {
      EXPECT_EQ(together[k].T_cam_world.translation, alone[k].T_cam_world.translation);
      EXPECT_EQ(together[k].T_cam_world.rotation.coeffs(), alone[k].T_cam_world.rotation.coeffs());
    }
  }
}

TEST_F(PosesAtTheEnd, PosesComeInOrderOfTimeAndRelativeToTheirKeyframe) {
  const auto after = Told(0, kFrames, true);
  ASSERT_EQ(after.size(), static_cast<size_t>(kFrames));
  const Rigid3d T_reference_world = map_.FindKeyframe(KeyframeId::Make(1, 0))->T_cam_world;
  for (int frame = 0; frame < kFrames; ++frame) {
    const FramePose& pose = after[static_cast<size_t>(frame)];
    EXPECT_EQ(pose.frame_index, static_cast<uint32_t>(frame));
    const Rigid3d back = pose.T_cam_reference * T_reference_world;
    EXPECT_LT((back.Center() - pose.T_cam_world.Center()).norm(), 1e-9);
  }
}

TEST_F(PosesAtTheEnd, LandmarksMayHaveLeftTheMap) {
  FinalPoses poses;
  for (int frame = 0; frame < 40; ++frame) poses.Add(map_, PoseOf(frame));
  MapEditor emptied(TestCamera(), Pyramid());
  Keyframe keyframe;
  keyframe.id = KeyframeId::Make(1, 0);
  keyframe.map_id = 1;
  keyframe.T_cam_world = TruthAt(0.0);
  keyframe.features = MakeFrameFeatures(FeatureSet(), emptied.camera(), emptied.pyramid());
  emptied.AddKeyframe(std::move(keyframe));
  while (!poses.IsSettled()) poses.Improve(emptied);
  EXPECT_LT(RmsError(poses.Take(), 0, 40), 0.003);
}

TEST_F(PosesAtTheEnd, AKeyframeThatMovesTakesItsFramesAlong) {
  FinalPoses poses;
  for (int frame = 0; frame < 60; ++frame) poses.Add(map_, PoseOf(frame));
  do poses.Improve(map_);
  while (poses.IsMidRound());
  EXPECT_FALSE(poses.IsSettled());
  const KeyframeId id = KeyframeId::Make(1, 0);
  const Rigid3d before = map_.FindKeyframe(id)->T_cam_world;
  const Rigid3d moved = before * Rigid3d(ExpSo3({0.0, 0.3, 0.0}), {1.0, 0.0, 0.0});
  map_.SetPose(map_.At(id), moved);
  poses.Improve(map_);
  EXPECT_TRUE(poses.IsSettled()) << "no more can be improved";
  for (const FramePose& pose : poses.Take()) {
    const Rigid3d truth = TruthAt(TimeOf(static_cast<int>(pose.frame_index)));
    const Rigid3d relative = truth * before.Inverse();
    EXPECT_LT((pose.T_cam_reference.Center() - relative.Center()).norm(), 0.005);
  }
}

TEST_F(PosesAtTheEnd, PosesThatComeLaterAreImprovedToo) {
  FinalPoses poses;
  for (int frame = 120; frame < kFrames; ++frame) poses.Add(map_, PoseOf(frame));
  while (!poses.IsSettled()) poses.Improve(map_);
  for (int frame = 0; frame < 120; ++frame) poses.Add(map_, PoseOf(frame));
  EXPECT_FALSE(poses.IsSettled());
  while (!poses.IsSettled()) poses.Improve(map_);
  const auto told = poses.Take();
  EXPECT_LT(RmsError(told, kWeakBegin, kWeakEnd), 0.002);
  EXPECT_EQ(told.front().frame_index, 0u);
}

TEST_F(PosesAtTheEnd, WorkComesInSmallPortions) {
  FinalPoses poses;
  for (int frame = 0; frame < kFrames; ++frame) poses.Add(map_, PoseOf(frame));
  int portions = 0, rounds = 0;
  while (!poses.IsSettled()) {
    const bool within = poses.IsMidRound();
    poses.Improve(map_);
    ++portions;
    rounds += within && !poses.IsMidRound() ? 1 : 0;
  }
  EXPECT_GE(rounds, 3);
  EXPECT_LE(rounds, 20);
  EXPECT_GT(portions, 3 * rounds) << "a process must be able to answer in between";
}

TEST_F(PosesAtTheEnd, RoundsEndWhenTheyChangeHardlyAnything) {
  FinalPoses poses;
  for (int frame = 0; frame < kFrames; ++frame) poses.Add(map_, PoseOf(frame));
  std::vector<std::vector<Rigid3d>> after;  // each round
  while (!poses.IsSettled()) {
    poses.Improve(map_);
    if (poses.IsMidRound()) continue;
    after.emplace_back();
    for (const FinalPose& pose : poses.poses()) after.back().push_back(pose.pose.T_cam_world);
  }
  ASSERT_GE(after.size(), 3u);
  EXPECT_LT(after.size(), 20u);
  const auto moved = [&](size_t round) {
    double sum = 0.0;
    for (size_t k = 0; k < after[round].size(); ++k) {
      const Rigid3d move = after[round][k] * after[round - 1][k].Inverse();
      Vector6d step;
      step << LogSo3(move.rotation), move.translation;
      sum += step.dot(poses.poses()[k].information * step) / 6.0;
    }
    return std::sqrt(sum / static_cast<double>(after[round].size()));
  };
  EXPECT_LT(moved(after.size() - 1), 0.066);
  EXPECT_GT(moved(after.size() - 2), 0.054) << "and not before";
}

TEST_F(PosesAtTheEnd, NothingToTell) {
  FinalPoses poses;
  EXPECT_TRUE(poses.IsSettled());
  EXPECT_TRUE(poses.Take().empty());
}

}  // namespace
}  // namespace dmslam
