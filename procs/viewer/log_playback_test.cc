#include "viewer/log_playback.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr int64_t kBeginUs = 1'700'000'000'000'000;

/// A log of ten seconds: a camera, a player's status and a pose every tenth of a second.
class LogPlaybackTest : public testing::Test {
 protected:
  LogPlaybackTest() : path_(testing::TempDir() + "log_playback_test.lcmlog") {
    EventLogWriter log(path_);
    CameraInfo info;
    info.session = 5;
    info.sequence = "recorded";
    info.camera.width_px = 640;
    info.camera.height_px = 480;
    info.camera.fx_px = info.camera.fy_px = 500;
    for (int i = 0; i <= 100; ++i) {
      const int64_t utime = kBeginUs + i * 100'000;
      if (i % 5 == 0) Write(&log, utime, info);
      PoseView view;
      view.session = 5;
      view.frame_index = static_cast<uint32_t>(i);
      view.stamp_ns = i * 100'000'000LL;
      view.inliers = 100 + i;
      Write(&log, utime, view);
    }
    log.Close();
  }
  ~LogPlaybackTest() override { std::remove(path_.c_str()); }
  template <typename Message>
  static void Write(EventLogWriter* log, int64_t utime, const Message& message) {
    log->Write(utime, wire::Info<Message>().channel, wire::Encode(message));
  }
  int64_t poses() const { return nlohmann::json::parse(exchange_.SeriesJson(0, 10000))["end"]; }

  std::string path_;
  Exchange exchange_;
};

TEST_F(LogPlaybackTest, PlaysAtItsSpeedAndStopsAtTheEnd) {
  LogPlayback playback(path_, {}, {}, &exchange_);
  EXPECT_NEAR(playback.duration_s(), 10, 1e-9);
  const int64_t start = 77'000'000'000;
  playback.Advance(start);
  playback.Advance(start + 2'000'000'000);
  EXPECT_NEAR(playback.position_s(), 2, 1e-6);
  EXPECT_EQ(poses(), 21);
  playback.Fulfil({std::nullopt, std::nullopt, 4.0}, start + 2'000'000'000);
  playback.Advance(start + 3'000'000'000);
  EXPECT_NEAR(playback.position_s(), 6, 1e-6);
  playback.Advance(start + 30'000'000'000);
  EXPECT_FALSE(playback.playing());
  EXPECT_EQ(playback.deadline_ns(), INT64_MAX);
  EXPECT_NEAR(playback.position_s(), 10, 1e-6);
}

TEST_F(LogPlaybackTest, GoesForwardAndBack) {
  LogPlayback playback(path_, {}, {}, &exchange_);
  playback.Fulfil({8.0, false, std::nullopt}, 1);
  EXPECT_EQ(poses(), 81);
  playback.Fulfil({3.0, std::nullopt, std::nullopt}, 2);
  EXPECT_NEAR(playback.position_s(), 3, 1e-6);
  EXPECT_EQ(poses(), 31);
  playback.Advance(5'000'000'000);
  EXPECT_EQ(poses(), 31) << "it is paused";
  playback.Fulfil({1e9, std::nullopt, std::nullopt}, 3);
  EXPECT_NEAR(playback.position_s(), 10, 1e-6);
  playback.Fulfil({std::nullopt, true, std::nullopt}, 4);
  EXPECT_NEAR(playback.position_s(), 0, 1e-6) << "play at the end begins anew";
}

TEST(LogOfTwoCamerasTest, BothAreFoundAndShown) {
  const std::string path = testing::TempDir() + "log_of_two_cameras_test.lcmlog";
  EventLogWriter log(path);
  for (int i = 0; i <= 20; ++i) {
    for (const CameraId camera : {0U, 1U}) {
      CameraInfo info;
      info.session = 5;
      info.camera_id = camera;
      info.camera.width_px = 640;
      info.camera.height_px = 480;
      info.camera.fx_px = info.camera.fy_px = 500;
      PoseView view;
      view.session = 5;
      view.camera_id = camera;
      view.frame_index = static_cast<uint32_t>(i);
      const auto write = [&](const auto& message) {
        using Message = std::decay_t<decltype(message)>;
        log.Write(kBeginUs + i * 100'000, ChannelOfCamera(wire::Info<Message>().channel, camera),
                  wire::Encode(message));
      };
      write(info);
      if (camera == 0 || i >= 10) write(view);
    }
  }
  log.Close();
  Exchange exchange;
  LogPlayback playback(path, {}, {}, &exchange);
  playback.Fulfil({2.0, false, std::nullopt}, 1);
  const auto poses = [&](CameraId camera) {
    return nlohmann::json::parse(exchange.SeriesJson(0, 1000, camera))["end"].get<int>();
  };
  EXPECT_EQ(poses(0), 21);
  EXPECT_EQ(poses(1), 11);
  std::remove(path.c_str());
}

TEST_F(LogPlaybackTest, RefusesWhatIsNoLog) {
  EXPECT_THROW(LogPlayback("/nonexistent.lcmlog", {}, {}, &exchange_), InputError);
  const std::string empty = testing::TempDir() + "log_playback_foreign.lcmlog";
  EventLogWriter log(empty);
  log.Write(kBeginUs, "SOMEBODY_ELSE", Bytes{1, 2, 3});
  log.Close();
  EXPECT_THROW(LogPlayback(empty, {}, {}, &exchange_), InputError);
  std::remove(empty.c_str());
}

/// What the hub tells who joins now, of one kind.
nlohmann::json Newest(Exchange* exchange, const std::string& kind) {
  const auto listener = exchange->hub().Join();
  const std::string said = listener->Next(std::chrono::milliseconds(0));
  exchange->hub().Leave(listener);
  const std::string head = "event: " + kind + "\ndata: ";
  const size_t at = said.find(head);
  if (at == std::string::npos) return {};
  return nlohmann::json::parse(
      said.substr(at + head.size(), said.find('\n', at + head.size()) - at - head.size()));
}

/// A log at whose end the camera is lost. It ends between two reports, which come four times a second.
TEST_F(LogPlaybackTest, AtItsEndTheSequenceIsOver) {
  const std::string path = testing::TempDir() + "log_of_an_ended_run.lcmlog";
  EventLogWriter log(path);
  CameraInfo info;
  info.session = 5;
  info.camera.width_px = 640;
  info.camera.height_px = 480;
  info.camera.fx_px = info.camera.fy_px = 500;
  Write(&log, kBeginUs, info);
  for (int i = 0; i <= 10; ++i) {
    PoseView view;
    view.session = 5;
    view.frame_index = static_cast<uint32_t>(i);
    view.state = TrackingState::kLost;
    Write(&log, kBeginUs + i * 100'000, view);
    FrontendStatus status;
    status.head.session = 5;
    status.head.health.pid = 77;
    status.state = TrackingState::kLost;
    if (i % 5 == 0) Write(&log, kBeginUs + i * 100'000, status);
  }
  EndOfSequence end;
  end.session = 5;
  Write(&log, kBeginUs + 1'010'000, end);
  log.Close();
  Exchange exchange;
  LogPlayback playback(path, {}, {}, &exchange);
  const int64_t start = 77'000'000'000;
  playback.Advance(start);
  playback.Advance(start + 1'005'000'000);
  const auto frontend = [&] { return Newest(&exchange, "status")["processes"][1]; };
  EXPECT_EQ(Newest(&exchange, "status")["ended"], false);
  EXPECT_EQ(frontend()["name"], "frontend");
  EXPECT_EQ(frontend()["state"], "lost");
  playback.Advance(start + 1'030'000'000);
  EXPECT_FALSE(playback.playing());
  EXPECT_EQ(Newest(&exchange, "status")["ended"], true);
  EXPECT_EQ(Newest(&exchange, "status")["cameras"][0]["ended"], true);
  EXPECT_EQ(frontend()["state"], "ending") << "the camera is lost no more: no frame follows";
  std::remove(path.c_str());
}

TEST(PlaybackControlTest, TheNewestWishOfEachKindCounts) {
  PlaybackControl control;
  control.Wish({1.0, true, std::nullopt});
  control.Wish({2.0, std::nullopt, 0.5});
  const PlaybackWish wish = control.Take();
  EXPECT_EQ(wish.position_s, 2.0);
  EXPECT_EQ(wish.playing, true);
  EXPECT_EQ(wish.speed, 0.5);
  EXPECT_FALSE(control.Take().position_s);
}

}  // namespace
}  // namespace dmslam
