#include "dmslam/initialization/initializer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>

#include "dmslam/initialization/initial_map.h"
#include "dmslam/initialization/two_frame_initializer.h"
#include "dmslam/motion_segmentation/synthetic_pair.h"

namespace dmslam {
namespace {

/// A room of points with descriptors of their own, and a walker in it.
class SyntheticRoom {
 public:
  SyntheticRoom(int num_static, int num_moving, uint64_t seed = 7, const Camera& camera = SyntheticCamera())
      : camera_(camera) {
    Random random(seed);
    for (int k = 0; k < num_static + num_moving; ++k) {
      Point point;
      point.moves = k >= num_static;
      const double depth = point.moves ? random.Uniform(1.9, 2.1) : random.Uniform(2.0, 5.0);
      const double x = point.moves ? random.Uniform(-0.25, 0.25) : random.Uniform(-0.65, 0.65);
      const double y = point.moves ? random.Uniform(-0.25, 0.25) : random.Uniform(-0.5, 0.5);
      point.p_world = depth * Eigen::Vector3d(x, y, 1.0);
      for (uint64_t& word : point.descriptor.words) word = random.Next();
      points_.push_back(point);
    }
  }

  const Camera& camera() const { return camera_; }
  Rigid3d TruePose(uint32_t frame) const {
    return Rigid3d(ExpSo3({0.0, turn_ * frame, 0.0}), speed_ * frame * Eigen::Vector3d(1.0, 0.1, 0.2));
  }
  void SetSpeed(double speed) { speed_ = speed; }
  /// How far the camera turns from frame to frame [rad].
  void SetTurn(double turn) { turn_ = turn; }
  /// The first points lie in a patch in the middle of the view.
  void Gather(size_t points) {
    for (size_t k = 0; k < points; ++k) points_[k].p_world.head<2>() *= 0.06;
  }
  /// Which points are seen when; without it all are.
  void SetShown(std::function<bool(size_t point, uint32_t frame)> shown) { shown_ = std::move(shown); }
  /// How far the walker goes from frame to frame.
  void SetWalk(double walk) { walk_ = walk; }
  /// The walker stands from this frame on.
  void StopWalkerAt(uint32_t frame) { stop_ = frame; }
  bool IsWalkers(const Descriptor& descriptor) const {
    return std::any_of(points_.begin(), points_.end(), [&](const Point& point) {
      return point.moves && point.descriptor.words == descriptor.words;
    });
  }

  InitializerFrame Frame(uint32_t index) const {
    auto features = std::make_shared<FrameFeatures>();
    Random random(DeriveSeed(3, index, "frame"));
    const double sigma_px = 0.4 * Pyramid().OfImages(camera_.width_px, camera_.height_px).Sigma(0);
    for (size_t k = 0; k < points_.size(); ++k) {
      const Point& point = points_[k];
      if (shown_ && !shown_(k, index)) continue;
      const uint32_t walked = std::min(index, stop_);
      const double turn = 0.15 * walked;
      const Eigen::Vector3d walk(walk_ * walked, 0.05 * std::sin(turn), 0.0);
      const auto uv =
          camera_.Project(TruePose(index) * (point.p_world + (point.moves ? walk : Eigen::Vector3d::Zero())));
      const double dx = sigma_px * random.Gaussian(), dy = sigma_px * random.Gaussian();
      if (!uv) continue;
      const Eigen::Vector2d seen = *uv + Eigen::Vector2d(dx, dy);
      if (!(seen.x() > 1 && seen.y() > 1 && seen.x() < camera_.width_px - 2 &&
            seen.y() < camera_.height_px - 2)) {
        continue;
      }
      Keypoint keypoint;
      keypoint.x_q4 = static_cast<uint16_t>(seen.x() * 16);
      keypoint.y_q4 = static_cast<uint16_t>(seen.y() * 16);
      features->set.keypoints.push_back(keypoint);
      features->set.descriptors.push_back(point.descriptor);
      features->uv_px.push_back(seen);
    }
    features->grid.Build(features->uv_px, features->set.keypoints, camera_.width_px, camera_.height_px);
    return {index, int64_t{index} * 33'333'333, features};
  }

 private:
  struct Point {
    Eigen::Vector3d p_world;
    Descriptor descriptor;
    bool moves = false;
  };
  Camera camera_;
  std::vector<Point> points_;
  std::function<bool(size_t, uint32_t)> shown_;
  double speed_ = 0.012;
  double turn_ = 0.002;
  double walk_ = 0.02;
  uint32_t stop_ = UINT32_MAX;
};

/// The same camera with images of another size.
Camera Scaled(Camera camera, double scale) {
  camera.width_px = static_cast<int>(std::lround(camera.width_px * scale));
  camera.height_px = static_cast<int>(std::lround(camera.height_px * scale));
  camera.fx_px *= scale;
  camera.fy_px *= scale;
  camera.cx_px = (camera.cx_px + 0.5) * scale - 0.5;
  camera.cy_px = (camera.cy_px + 0.5) * scale - 0.5;
  return camera;
}

/// Asks for the first map of a room of which every `every`th frame is there; with its time since the first
/// frame.
std::optional<std::pair<FirstMap, double>> MapAtRate(const SyntheticRoom& room, uint32_t every) {
  Initializer initializer({}, room.camera(), 1);
  for (uint32_t k = 0; k * every < 90; ++k) {
    InitializerFrame frame = room.Frame(k * every);
    frame.index = k;
    InitializerReport report = initializer.AddFrame(frame);
    if (report.result)
      return std::make_pair(std::move(*report.result), 1e-9 * static_cast<double>(frame.stamp_ns));
  }
  return std::nullopt;
}

double DirectionError(const SyntheticRoom& room, uint32_t every, const FirstMap& map) {
  const Rigid3d truth =
      room.TruePose(map.frame1.index * every) * room.TruePose(map.frame0.index * every).Inverse();
  return std::acos(truth.translation.normalized().dot(map.T_1_0.translation.normalized()));
}

/// The first map of a room, asked for from `first` on.
std::optional<FirstMap> MapFrom(const SyntheticRoom& room, const InitializerOptions& options,
                                uint32_t first) {
  Initializer initializer(options, room.camera(), 1);
  std::optional<FirstMap> map;
  for (uint32_t frame = first; frame < first + 60 && !map; ++frame) {
    map = std::move(initializer.AddFrame(room.Frame(frame)).result);
  }
  return map;
}

double ShareOfWalker(const SyntheticRoom& room, const FirstMap& map) {
  double walkers = 0;
  for (const FirstMap::Point& point : map.points) {
    if (room.IsWalkers(map.frame0.features->set.descriptors[point.feature0])) walkers += 1;
  }
  return walkers / static_cast<double>(map.points.size());
}

TEST(Initializer, MapsTheRoomAndNotTheWalker) {
  const SyntheticRoom room(600, 150);
  Initializer initializer({}, room.camera(), 1);
  std::optional<FirstMap> map;
  for (uint32_t frame = 0; frame < 60 && !map; ++frame) {
    InitializerReport report = initializer.AddFrame(room.Frame(frame));
    EXPECT_EQ(report.wait == WaitReason::kNone, report.result.has_value());
    EXPECT_FALSE(report.reason.empty());
    map = std::move(report.result);
  }
  ASSERT_TRUE(map.has_value());
  const Rigid3d truth = room.TruePose(map->frame1.index) * room.TruePose(map->frame0.index).Inverse();
  EXPECT_LT(AngleBetween(truth.rotation, map->T_1_0.rotation), 0.02);
  EXPECT_GT(truth.translation.normalized().dot(map->T_1_0.translation.normalized()), 0.985);
  EXPECT_GE(map->points.size(), 80U);
  EXPECT_EQ(map->matches.size(), map->is_static.size());
  for (const FirstMap::Point& point : map->points) {
    EXPECT_GT(point.p_world.z(), 0);
    const auto uv = room.camera().Project(point.p_world);
    ASSERT_TRUE(uv.has_value());
    EXPECT_LT((*uv - map->frame0.features->uv_px[point.feature0]).norm(), 4.0);
  }
}

/// Ideal pixels of what a wide lens shows at its rim.
TEST(Initializer, WhatLiesFarOutsideTheIdealImageIsLeftOut) {
  Camera camera = SyntheticCamera();
  camera.k1 = 1e-9;
  const SyntheticRoom room(600, 0, 7, camera);
  Initializer initializer({}, camera, 1);
  std::optional<FirstMap> map;
  for (uint32_t index = 0; index < 60 && !map; ++index) {
    InitializerFrame frame = room.Frame(index);
    auto features = std::make_shared<FrameFeatures>(*frame.features);
    Random random(11);  // the same in each frame
    for (int k = 0; k < 40; ++k) {
      features->set.keypoints.push_back({16, static_cast<uint16_t>(16 * 10 * k)});
      features->set.descriptors.push_back({{random.Next(), random.Next(), random.Next(), random.Next()}});
      features->uv_px.emplace_back(-1.2 * camera.width_px, 10.0 * k);
    }
    features->grid.Build(features->uv_px, features->set.keypoints, camera.width_px, camera.height_px);
    frame.features = features;
    InitializerReport report = initializer.AddFrame(frame);
    EXPECT_EQ(report.reason.find("outside the image"), std::string::npos) << index << ": " << report.reason;
    map = std::move(report.result);
  }
  ASSERT_TRUE(map);
  EXPECT_GE(map->points.size(), 80U);
}

/// The turn by which features are looked for is then the walker's, and the room is not where it would bring
/// it.
TEST(Initializer, DoesNotMapAWalkerWhoHasMostOfTheFeatures) {
  for (const double walk : {-0.06, 0.08}) {
    SyntheticRoom room(250, 1200);
    room.SetWalk(walk);
    room.SetTurn(walk < 0 ? 0.002 : -0.01);
    const std::optional<FirstMap> map = MapFrom(room, {}, 0);
    ASSERT_TRUE(map);
    EXPECT_EQ(ShareOfWalker(room, *map), 0.0) << "he walks " << walk;
  }
}

TEST(Initializer, TellsTheViewsBetweenTheTwo) {
  const SyntheticRoom room(600, 150);
  const std::optional<FirstMap> map = MapFrom(room, {}, 0);
  ASSERT_TRUE(map.has_value());
  ASSERT_GE(map->between.size(), 2U);
  EXPECT_EQ(map->between.size() + 2, static_cast<size_t>(map->num_views));
  const double unit =
      map->T_1_0.Center().norm() /
      (room.TruePose(map->frame1.index).Center() - room.TruePose(map->frame0.index).Center()).norm();
  uint32_t before = map->frame0.index;
  for (const FirstMap::View& view : map->between) {
    EXPECT_GT(view.frame.index, before);
    EXPECT_LT(view.frame.index, map->frame1.index);
    before = view.frame.index;
    const Rigid3d truth = room.TruePose(view.frame.index) * room.TruePose(map->frame0.index).Inverse();
    EXPECT_LT((view.T_k_0.Center() - unit * truth.Center()).norm(), 0.1 * map->T_1_0.Center().norm());
    EXPECT_GE(view.sights.size(), map->points.size() / 2);
    for (const FirstMap::View::Sight& sight : view.sights) {
      const auto uv = room.camera().Project(view.T_k_0 * map->points[sight.point].p_world);
      ASSERT_TRUE(uv.has_value());
      EXPECT_LT((*uv - view.frame.features->uv_px[sight.feature]).norm(), 4.0);
    }
  }
}

/// Every other frame is looked at. Where little is missing the one left out is, too: maps end at it.
TEST(Initializer, LooksAtEveryFrameWhereLittleParallaxIsMissing) {
  InitializerOptions options;
  options.geometry.min_parallax_rad = 0.03;  // late, so that nothing else is missing
  int odd = 0;
  for (int k = 0; k < 10; ++k) {
    SyntheticRoom room(600, 0);
    room.SetSpeed(0.005 + 0.0003 * k);
    const std::optional<FirstMap> map = MapFrom(room, options, 0);
    if (map) odd += static_cast<int>((map->frame1.index - map->frame0.index) % 2);
  }
  EXPECT_GE(odd, 2);
}

TEST(Initializer, FramesBeforeTellWhoHasJustStopped) {
  SyntheticRoom room(600, 150);
  room.StopWalkerAt(12);
  InitializerOptions blind;
  blind.past.views = 0;
  const auto taken_in = MapFrom(room, blind, 12);
  ASSERT_TRUE(taken_in.has_value());
  EXPECT_GT(ShareOfWalker(room, *taken_in), 0.1);
  InitializerOptions options;
  options.past.first = 12;
  Initializer initializer(options, room.camera(), 1);
  bool waited = false;
  for (uint32_t frame = 0; frame < 45; ++frame) {
    const InitializerReport report = initializer.AddFrame(room.Frame(frame));
    waited |= report.reason.find("just before") != std::string::npos;
    if (report.result && report.result->frame0.index == 12) {
      EXPECT_LT(ShareOfWalker(room, *report.result), 0.01);
    }
  }
  EXPECT_TRUE(waited);
}

TEST(Initializer, ThePastOfARoomDoesNotDelayItsMap) {
  const SyntheticRoom room(600, 0);
  InitializerOptions options;
  const auto without = MapFrom(room, options, 12);
  options.past.first = 12;
  const auto with = MapFrom(room, options, 0);
  ASSERT_TRUE(without.has_value() && with.has_value());
  EXPECT_EQ(with->frame0.index, without->frame0.index);
  EXPECT_EQ(with->frame1.index, without->frame1.index);
}

TEST(Initializer, StartsAtAnyRate) {
  const SyntheticRoom room(600, 100);
  for (const uint32_t every : {1U, 2U, 3U}) {  // 30, 15 and 10 Hz
    const auto found = MapAtRate(room, every);
    ASSERT_TRUE(found.has_value()) << every;
    EXPECT_LT(found->second, 1.2) << every;
    EXPECT_LT(DirectionError(room, every, found->first), 0.1) << every;
    EXPECT_LT(ShareOfWalker(room, found->first), 0.02) << every;
  }
}

// At 0.6 rad/s what the reference frame saw is soon far from where it was, but always where the turn puts it.
TEST(Initializer, StartsWhileTheCameraTurnsFast) {
  SyntheticRoom room(900, 0);
  room.SetTurn(-0.02);
  const auto found = MapAtRate(room, 1);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(found->second, 1.2);
  EXPECT_LT(DirectionError(room, 1, found->first), 0.1);
}

// A moment can be explained by somebody's motion that the next moment shows to be wrong.
TEST(Initializer, AMapOfViewsNearInTimeMustBeFoundTwice) {
  SyntheticRoom room(600, 100);
  room.SetSpeed(0.03);
  InitializerOptions options;
  options.sure_age_s = 0;
  const auto once = MapFrom(room, options, 0);
  options.sure_age_s = 10;
  const auto twice = MapFrom(room, options, 0);
  ASSERT_TRUE(once.has_value() && twice.has_value());
  EXPECT_GT(twice->frame1.index, once->frame1.index);
}

TEST(Initializer, AMapThatAnotherMotionComesNearMustBeFoundTwice) {
  SyntheticRoom room(600, 100);
  room.SetSpeed(0.03);
  InitializerOptions options;
  options.sure_age_s = 0;
  options.motion.minima_slack = 1e6;  // there is another one, however much it costs
  const auto alone = MapFrom(room, options, 0);
  options.motion.alone_runner_up_cost = 1e30;  // whatever comes near is near enough
  const auto clear = MapFrom(room, options, 0);
  options.geometry.clear_direction_sigma_rad = 0;
  const auto contended = MapFrom(room, options, 0);
  ASSERT_TRUE(alone.has_value() && clear.has_value() && contended.has_value());
  EXPECT_EQ(clear->frame1.index, alone->frame1.index) << "the direction is well known";
  EXPECT_GT(contended->frame1.index, alone->frame1.index);
}

// A compact patch is seen all the time, and the room around it for a third of a second, between two of the
// reference frames that are taken every tenth of a second.
TEST(Initializer, BehindPeopleTheRoomIsSeenInMoments) {
  constexpr size_t kPatch = 150, kSeenAtFirst = 300;
  SyntheticRoom room(900, 0);
  room.Gather(kPatch);
  room.SetSpeed(0.04);
  room.SetShown([](size_t point, uint32_t frame) {
    const bool at_first = point >= kPatch && point < kPatch + kSeenAtFirst;
    if (frame < 4) return at_first;  // soon lost sight of
    return point < kPatch || (!at_first && frame >= 14 && frame < 24);
  });
  const std::optional<FirstMap> map = MapFrom(room, {}, 0);
  ASSERT_TRUE(map.has_value());
  EXPECT_EQ(map->frame0.index, 14U);
  EXPECT_LT(DirectionError(room, 1, *map), 0.1);

  InitializerOptions without;
  without.references.max_brief_age_s = 0;
  EXPECT_FALSE(MapFrom(room, without, 0).has_value());
  without = {};
  without.references.brief_pair_step_s = without.min_pair_step_s;
  EXPECT_FALSE(MapFrom(room, without, 0).has_value());
}

TEST(Initializer, StartsAtAnySize) {
  for (const double scale : {0.5, 2.0}) {
    const SyntheticRoom room(600, 100, 7, Scaled(SyntheticCamera(), scale));
    const auto found = MapAtRate(room, 1);
    ASSERT_TRUE(found.has_value()) << scale;
    EXPECT_LT(found->second, 1.2) << scale;
    EXPECT_LT(DirectionError(room, 1, found->first), 0.15) << scale;
    EXPECT_LT(ShareOfWalker(room, found->first), 0.02) << scale;
  }
}

TEST(Initializer, TakesTheRoomWhereTwoGroupsMoveApart) {
  const SyntheticRoom room(400, 300);  // the walker has nearly half of the matches
  const auto found = MapAtRate(room, 1);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(ShareOfWalker(room, found->first), 0.02);
  EXPECT_LT(DirectionError(room, 1, found->first), 0.15);
}

TEST(Initializer, WaitsWhileTheCameraOnlyTurns) {
  SyntheticRoom room(600, 0);
  room.SetSpeed(0.0);
  Initializer initializer({}, room.camera(), 1);
  for (uint32_t frame = 0; frame < 40; ++frame) {
    EXPECT_FALSE(initializer.AddFrame(room.Frame(frame)).result.has_value()) << frame;
  }
}

// The camera moves so little that the room is out of sight before there is as much parallax as is usually
// asked for.
TEST(Initializer, StartsBeforeTheCameraHasTurnedAway) {
  SyntheticRoom room(700, 0);
  room.SetSpeed(0.001);
  room.SetTurn(-0.015);
  const auto map_with = [&](const InitializerOptions& options) -> std::optional<FirstMap> {
    Initializer initializer(options, room.camera(), 1, AdjustInitialMap(room.camera().Ideal()));
    for (uint32_t frame = 0; frame < 45; ++frame) {
      InitializerReport report = initializer.AddFrame(room.Frame(frame));
      if (report.result) return std::move(*report.result);
    }
    return std::nullopt;
  };
  InitializerOptions options;
  options.motion.min_runner_up_cost = 1.0;
  options.references.step_s = 0.4;
  options.geometry.losing_share = 0.7;
  options.geometry.clear_direction_sigma_rad = 0.1;
  const std::optional<FirstMap> map = map_with(options);
  ASSERT_TRUE(map.has_value());
  EXPECT_LT(map->median_parallax_rad, options.geometry.min_parallax_rad);
  EXPECT_LT(DirectionError(room, 1, *map), 0.1);
  options.geometry.losing_share = 0;
  EXPECT_FALSE(map_with(options).has_value());
}

TEST(Initializer, TakesOtherSelectorsBehindTheSameGates) {
  const SyntheticRoom room(600, 100);
  for (const SelectorMethod method : {SelectorMethod::kArsac, SelectorMethod::kRansac}) {
    Initializer initializer({}, room.camera(), 1, {}, method);
    std::optional<FirstMap> map;
    for (uint32_t frame = 0; frame < 60 && !map; ++frame) {
      map = std::move(initializer.AddFrame(room.Frame(frame)).result);
    }
    ASSERT_TRUE(map.has_value()) << static_cast<int>(method);
    const Rigid3d truth = room.TruePose(map->frame1.index) * room.TruePose(map->frame0.index).Inverse();
    EXPECT_LT(AngleBetween(truth.rotation, map->T_1_0.rotation), 0.02) << static_cast<int>(method);
  }
}

TEST(Initializer, AbsurdFramesGiveReasonsAndNoMap) {
  const SyntheticRoom room(600, 0);
  Initializer same(InitializerOptions(), room.camera(), 1);  // the same picture again and again
  for (uint32_t frame = 0; frame < 20; ++frame) {
    InitializerFrame still = room.Frame(3);
    still.index = frame;
    still.stamp_ns = int64_t{frame} * 33'333'333;
    const InitializerReport report = same.AddFrame(still);
    EXPECT_FALSE(report.result.has_value());
    EXPECT_FALSE(report.reason.empty());
  }
  Initializer unlike(InitializerOptions(), room.camera(), 1);  // no picture has anything of the one before
  for (uint32_t frame = 0; frame < 20; ++frame) {
    const SyntheticRoom other(600, 0, 100 + frame);
    EXPECT_FALSE(unlike.AddFrame(other.Frame(frame)).result.has_value());
  }
}

TEST(Initializer, WaitsForFramesWithoutFeatures) {
  Initializer initializer({}, SyntheticCamera(), 1);
  const InitializerReport report = initializer.AddFrame({0, 0, std::make_shared<const FrameFeatures>()});
  EXPECT_EQ(report.wait, WaitReason::kTooFewFeatures);
}

TEST(Initializer, IsDeterministic) {
  const SyntheticRoom room(400, 100);
  std::vector<FirstMap> maps;
  for (int run = 0; run < 2; ++run) {
    InitializerOptions options;
    options.threads = 1 + 2 * run;
    Initializer initializer(options, room.camera(), 5);
    for (uint32_t frame = 0; frame < 60; ++frame) {
      InitializerReport report = initializer.AddFrame(room.Frame(frame));
      if (!report.result) continue;
      maps.push_back(std::move(*report.result));
      break;
    }
  }
  ASSERT_EQ(maps.size(), 2U);
  EXPECT_EQ(maps[0].frame1.index, maps[1].frame1.index);
  EXPECT_EQ(maps[0].T_1_0.translation, maps[1].T_1_0.translation);
  ASSERT_EQ(maps[0].points.size(), maps[1].points.size());
  for (size_t k = 0; k < maps[0].points.size(); ++k)
    EXPECT_EQ(maps[0].points[k].p_world, maps[1].points[k].p_world);
}

/// The map of two frames of the room, of the stream from its beginning.
std::optional<FirstMap> TwoFrameMap(const SyntheticRoom& room, const ReconstructPair& reconstruct,
                                    const TwoFrameOptions& options) {
  TwoFrameInitializer initializer(options, room.camera(), reconstruct, 1);
  for (uint32_t frame = 0; frame < 45; ++frame) {
    InitializerReport report = initializer.AddFrame(room.Frame(frame));
    if (report.result) return std::move(report.result);
  }
  return std::nullopt;
}

TEST(TwoFrameInitializer, ThePaperTakesTheRoomWhereRansacTakesTheCrowd) {
  const SyntheticRoom room(300, 500);
  const auto paper = TwoFrameMap(room, ReconstructByPaper(room.camera()), {});
  ASSERT_TRUE(paper.has_value());
  EXPECT_LT(ShareOfWalker(room, *paper), 0.5);
  const auto ransac = TwoFrameMap(room, ReconstructByRansac(room.camera()), {});
  ASSERT_TRUE(ransac.has_value());
  EXPECT_GT(ShareOfWalker(room, *ransac), 0.5);
}

TEST(TwoFrameInitializer, TheFramesAreAsFarApartAsAsked) {
  const SyntheticRoom room(600, 0);
  TwoFrameOptions options;
  options.min_gap_s = 0.5;
  const auto map = TwoFrameMap(room, ReconstructByPaper(room.camera()), options);
  ASSERT_TRUE(map.has_value());
  EXPECT_GE(map->frame1.stamp_ns - map->frame0.stamp_ns, 500'000'000);
}

TEST(TwoFrameInitializer, ThePaperWaitsWhileTheCameraOnlyTurns) {
  SyntheticRoom room(600, 0);
  room.SetSpeed(0);
  EXPECT_FALSE(TwoFrameMap(room, ReconstructByPaper(room.camera()), {}).has_value());
}

TEST(ReconstructBaseline, FindsThePoseOfARoom) {
  const SyntheticPair pair = MakeSyntheticPair({}, 21);
  const TwoViewReconstruction map = ReconstructBaseline(pair.matches, pair.camera, {}, 1);
  ASSERT_TRUE(map.IsUsable()) << map.explanation;
  EXPECT_FALSE(map.from_homography);
  EXPECT_GT(map.T_1_0.translation.dot(pair.T_1_0.translation.normalized()), 0.97);
  EXPECT_LT(AngleBetween(map.T_1_0.rotation, pair.T_1_0.rotation), 0.02);
}

TEST(ReconstructBaseline, TakesAHomographyForAPlane) {
  SyntheticPairOptions options;
  options.flat = true;
  options.translation = {0.4, 0.05, 0.02};
  const SyntheticPair pair = MakeSyntheticPair(options, 22);
  EXPECT_TRUE(ReconstructBaseline(pair.matches, pair.camera, {}, 1).from_homography);
}

TEST(ReconstructBaseline, RefusesARotation) {
  SyntheticPairOptions options;
  options.translation.setZero();
  const SyntheticPair pair = MakeSyntheticPair(options, 23);
  EXPECT_FALSE(ReconstructBaseline(pair.matches, pair.camera, {}, 1).IsUsable());
  EXPECT_FALSE(ReconstructBaseline({}, pair.camera, {}, 1).IsUsable());
}

TEST(ReconstructFromStatic, TriangulatesWhatIsStatic) {
  SyntheticPairOptions options;
  options.num_moving = 100;
  const SyntheticPair pair = MakeSyntheticPair(options, 24);
  const StaticSelection selection = Dlrsac(DlrsacOptions()).Select(pair.matches, pair.camera, 1);
  const TwoViewReconstruction map = ReconstructFromStatic(pair.matches, selection, pair.camera, {});
  ASSERT_TRUE(map.IsUsable()) << map.explanation;
  EXPECT_GT(map.num_points, 400);
  for (size_t i = 0; i < pair.matches.size(); ++i) {
    if (!map.has_point[i]) continue;
    EXPECT_TRUE(selection.is_static[i]);
    EXPECT_GT(map.points_cam0[i].z(), 0);
  }
}

TEST(ReconstructFromStatic, PassesARefusalOn) {
  StaticSelection refused;
  refused.refusal = Refusal::kTooFewCells;
  EXPECT_FALSE(ReconstructFromStatic({}, refused, SyntheticCamera(), {}).IsUsable());
}

}  // namespace
}  // namespace dmslam
