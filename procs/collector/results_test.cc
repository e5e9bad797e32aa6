#include "collector/results.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/map/replica.h"

namespace dmslam {
namespace {

using Json = nlohmann::json;

/// Maps 1, 2 and 3 with a keyframe each, whose frames have the number of their map.
class ResultsTest : public testing::Test {
 protected:
  ResultsTest() {
    MapEditor map(TestCamera(), Pyramid());
    for (MapId map_id = 1; map_id <= 3; ++map_id) {
      Keyframe keyframe;
      keyframe.id = KeyframeId::Make(1, map_id);
      keyframe.map_id = map_id;
      keyframe.features = MakeFrameFeatures(FeatureSet(), map.camera(), map.pyramid());
      map.AddKeyframe(std::move(keyframe));
    }
    builder_.SetMap(Replica(std::move(map)));
    run_.cameras.resize(1);
  }
  ~ResultsTest() override { std::filesystem::remove_all(folder_); }

  /// A frame of 10 Hz that was tracked in the map; 0: that was not tracked.
  void Tell(CameraId camera, uint32_t frame, MapId map_id) {
    FramePose pose;
    pose.camera_id = camera;
    pose.frame_index = frame;
    pose.stamp_ns = 1'000'000'000 + 100'000'000 * int64_t{frame};
    if (map_id != 0) {
      pose.map_id = map_id;
      pose.state = TrackingState::kTracking;
      pose.reference = KeyframeId::Make(1, map_id);
    }
    builder_.OnFramePose(pose);
  }
  Json Summary() {
    WriteResults(folder_, run_, builder_, false);
    std::ifstream file(folder_ + "/summary.json");
    return Json::parse(file);
  }

  const std::string folder_ = testing::TempDir() + "/results_test_" + std::to_string(getpid());
  TrajectoryBuilder builder_{TestCamera(), Pyramid()};
  RunRecord run_;
};

TEST_F(ResultsTest, MapsApartAreThoseOfAllCameras) {
  run_.cameras.resize(3);
  for (uint32_t frame = 10; frame < 20; ++frame) Tell(0, frame, 1);
  Tell(1, 10, 2);
  Tell(1, 11, 2);
  Tell(2, 10, 2);
  Tell(2, 11, 3);
  const Json summary = Summary();
  EXPECT_EQ(summary["other_maps"], Json::parse(R"([
      {"camera": 1, "map": 2, "frames": 2},
      {"camera": 2, "map": 2, "frames": 1},
      {"camera": 2, "map": 3, "frames": 1}])"));
  EXPECT_EQ(summary["cameras"][1]["other_maps"], Json::parse(R"([{"map": 2, "frames": 2}])"));
}

TEST_F(ResultsTest, OfEachCameraIsCountedWhatWasPlayedTrackedAndLost) {
  run_.cameras.resize(3);
  run_.restarts = 1;
  for (uint32_t frame = 0; frame < 100; ++frame) Tell(0, frame, 1);
  for (uint32_t frame = 10; frame < 20; ++frame) Tell(1, frame, 0);
  for (uint32_t frame = 20; frame < 50; ++frame) Tell(1, frame, 1);  // then its frontend died
  for (CameraRecord& camera : run_.cameras) camera.frames.published = 100;
  run_.cameras[1].frontend.frames_skipped = 10;
  const Json cameras = Summary()["cameras"];
  const auto of_camera = [&cameras](size_t camera, const char* key) {
    return cameras[camera].at(key).get<int>();
  };
  EXPECT_EQ(of_camera(0, "frames_lost"), 0);
  EXPECT_EQ(of_camera(0, "frames_tracked_online"), 100);
  EXPECT_EQ(of_camera(1, "frames"), 100);
  EXPECT_EQ(of_camera(1, "frames_processed"), 40);
  EXPECT_EQ(of_camera(1, "frames_skipped"), 10);
  EXPECT_EQ(of_camera(1, "frames_lost"), 50);
  EXPECT_EQ(of_camera(1, "frames_tracked_online"), 30);
  EXPECT_EQ(of_camera(1, "frames_tracked"), 30);
  EXPECT_EQ(of_camera(2, "frames_lost"), 100) << "its frontend was never there";
  EXPECT_EQ(of_camera(2, "frames_tracked"), 0);
}

TEST_F(ResultsTest, OfSeveralCamerasTheFirstOnesCountsAreThoseOfAllOfItsFrontends) {
  run_.cameras.resize(2);
  run_.restarts = 1;  // of the other camera's frontend
  for (uint32_t frame = 0; frame < 78; ++frame) Tell(0, frame, 1);
  for (CameraRecord& camera : run_.cameras) camera.frames.published = 100;
  run_.cameras[0].frontend.frames_processed = 74;  // when it said so last
  run_.cameras[0].frontend.frames_skipped = 12;
  const Json summary = Summary();
  EXPECT_EQ(summary["frames_processed"], 78);
  EXPECT_EQ(summary["frames_lost"], 10);
  for (const char* key : {"frames", "frames_processed", "frames_skipped", "frames_lost"})
    EXPECT_EQ(summary[key], summary["cameras"][0][key]) << key;
}

TEST_F(ResultsTest, OfOneCameraNobodyKnowsWhatNeverCameToAFrontendThatDied) {
  for (uint32_t frame = 0; frame < 10; ++frame) Tell(0, frame, 1);
  run_.cameras[0].frames.published = 10;
  run_.cameras[0].frontend.frames_received = 9;
  run_.end_heard = true;
  EXPECT_EQ(Summary()["frames_lost"], 1);
  run_.restarts = 1;
  EXPECT_TRUE(Summary()["frames_lost"].is_null());
}

TEST_F(ResultsTest, ACameraThatHasNothingInTheMapHasNone) {
  run_.cameras.resize(4);
  for (uint32_t frame = 10; frame < 20; ++frame) Tell(0, frame, 1);
  Tell(1, 10, 1);
  Tell(2, 10, 2);
  Tell(3, 10, 0);
  const Json cameras = Summary()["cameras"];
  EXPECT_EQ(cameras[0]["map"], 1);
  EXPECT_EQ(cameras[1]["map"], 1);
  EXPECT_TRUE(cameras[2]["map"].is_null()) << "its frames are in another one: " << cameras[2];
  EXPECT_TRUE(cameras[3]["map"].is_null()) << "it was never placed: " << cameras[3];
}

TEST_F(ResultsTest, OfOneCameraTheMapsApartHaveNoNumberOfACamera) {
  for (uint32_t frame = 10; frame < 20; ++frame) Tell(0, frame, 1);
  Tell(0, 20, 2);
  EXPECT_EQ(Summary()["other_maps"], Json::parse(R"([{"map": 2, "frames": 1}])"));
}

TEST_F(ResultsTest, TheTimesOfEachQuarterTellWhetherFramesTakeLongerAsTheRunGoesOn) {
  for (int frame = 0; frame < 400; ++frame) {
    FrameTrace trace;
    trace.publish_us = 1000000 + 33000 * frame;
    trace.published_us = trace.publish_us + 5000 + (frame < 300 ? 0 : 4000);
    run_.durations.Add(trace);
  }
  const Json quarters = Summary()["image_to_pose_ms_by_quarter"];
  ASSERT_EQ(quarters.size(), 4);
  EXPECT_NEAR(quarters[0]["p50"].get<double>(), 5.0, 0.05);
  EXPECT_NEAR(quarters[2]["p99"].get<double>(), 5.0, 0.05);
  EXPECT_NEAR(quarters[3]["p50"].get<double>(), 9.0, 0.09);
}

TEST_F(ResultsTest, TheFirstMapIsTimedFromTheFirstFrameOfTheSequence) {
  for (uint32_t frame = 66; frame < 71; ++frame) Tell(0, frame, 0);
  for (uint32_t frame = 71; frame < 90; ++frame) Tell(0, frame, 1);
  EXPECT_NEAR(Summary()["first_init_s"].get<double>(), 0.5, 1e-9) << "nobody has announced a first frame";
  run_.cameras[0].frames.first_index = 66;
  EXPECT_EQ(Summary()["first_init_s"].get<double>(), 0.5) << "as in lock-step, where every frame is told";
  run_.cameras[0].frames.first_index = 5;
  EXPECT_NEAR(Summary()["first_init_s"].get<double>(), 6.6, 1e-9) << "61 frames never came to the frontend";
}

TEST_F(ResultsTest, WhereNothingIsTrackedThereIsNoFirstMap) {
  EXPECT_TRUE(Summary()["first_init_s"].is_null());
  Tell(0, 3, 0);
  EXPECT_TRUE(Summary()["first_init_s"].is_null());
}

}  // namespace
}  // namespace dmslam
