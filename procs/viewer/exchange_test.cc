#include "viewer/exchange.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "viewer/process_board.h"
#include "viewer/viewer_json.h"

namespace dmslam {
namespace {

using std::chrono::milliseconds;
constexpr int64_t kSecond = 1'000'000'000;

/// Where the replica's thread hangs, the one that serves must not go on saying that all is well.
TEST(ExchangeTest, HealthOfFiveSecondsAgoIsNone) {
  int64_t now_ns = 0;
  Exchange exchange([&] { return now_ns; });
  EXPECT_FALSE(exchange.Health()) << "nothing was said yet";
  exchange.SetHealth({true, "{}", ""});
  now_ns = 5 * kSecond;
  ASSERT_TRUE(exchange.Health());
  EXPECT_TRUE(exchange.Health()->well);
  now_ns += 1;
  EXPECT_FALSE(exchange.Health());
  exchange.SetHealth({true, "{}", ""});
  EXPECT_TRUE(exchange.Health());
}

TEST(EventHubTest, AListenerWhoIsSlowGetsTheNewestOfEachKind) {
  EventHub hub;
  const auto listener = hub.Join();
  for (int i = 0; i < 100; ++i) hub.Send(EventKind::kPose, std::to_string(i));
  hub.Send(EventKind::kMap, "7");
  EXPECT_EQ(listener->Next(milliseconds(0)), "event: pose\ndata: 99\n\nevent: map\ndata: 7\n\n");
  EXPECT_EQ(listener->skipped(), 99);
  EXPECT_EQ(hub.skipped(), 99);
  EXPECT_EQ(listener->Next(milliseconds(0)), ":\n\n") << "nothing new";
  hub.Leave(listener);
  EXPECT_EQ(hub.skipped(), 99) << "those of listeners that have left count";
}

TEST(EventHubTest, ACameraTakesNoOthersPlace) {
  EventHub hub;
  const auto listener = hub.Join();
  for (int i = 0; i < 3; ++i) {
    hub.Send(EventKind::kPose, "first" + std::to_string(i), 0);
    hub.Send(EventKind::kPose, "second" + std::to_string(i), 1);
  }
  EXPECT_EQ(listener->Next(milliseconds(0)), "event: pose\ndata: first2\n\nevent: pose\ndata: second2\n\n");
}

TEST(EventHubTest, WhoJoinsGetsTheNewestAtOnce) {
  EventHub hub;
  hub.Send(EventKind::kStatus, "old");
  hub.Send(EventKind::kStatus, "new");
  EXPECT_EQ(hub.Join()->Next(milliseconds(0)), "event: status\ndata: new\n\n");
}

TEST(EventHubTest, ClosingWakesWhoWaitsAndAdmitsNobody) {
  EventHub hub;
  const auto listener = hub.Join();
  std::string last = "nothing yet";
  std::thread waiting([&] { last = listener->Next(std::chrono::hours(1)); });
  hub.Close();
  waiting.join();
  EXPECT_EQ(last, "");
  EXPECT_EQ(hub.Join(), nullptr);
}

TEST(EventHubTest, TheNumberOfListenersIsBounded) {
  EventHub hub;
  std::vector<std::shared_ptr<EventHub::Listener>> all;
  while (auto listener = hub.Join()) all.push_back(listener);
  EXPECT_EQ(all.size(), EventHub::kMostListeners);
  hub.Leave(all.back());
  EXPECT_NE(hub.Join(), nullptr);
}

class BoardTest : public testing::Test {
 protected:
  void Hear(int32_t pid) {
    StatusHead head;
    head.health.pid = pid;
    board_.OnStatus("mapper", head, "mapping", now_, 0);
  }
  void Wait(int64_t ns) {
    now_ += ns;
    board_.Advance(now_, 0);
  }
  ProcessBoard::Life life() const { return board_.processes()[0].life; }

  ProcessBoard board_{{"mapper"}};
  int64_t now_ = 100 * kSecond;
};

TEST_F(BoardTest, KilledIsDownAndRestartedIsBack) {
  EXPECT_EQ(life(), ProcessBoard::Life::kAwaited);
  Wait(10 * kSecond);
  EXPECT_EQ(life(), ProcessBoard::Life::kAwaited) << "who was never there is not down";
  Hear(17);
  EXPECT_EQ(life(), ProcessBoard::Life::kUp);
  Wait(2 * kSecond);
  EXPECT_EQ(life(), ProcessBoard::Life::kUp);
  Wait(kSecond);
  EXPECT_EQ(life(), ProcessBoard::Life::kDown);
  EXPECT_EQ(board_.events().back().level, BoardEvent::Level::kBad);
  board_.OnSign("mapper", now_);
  EXPECT_EQ(life(), ProcessBoard::Life::kDown) << "a late beacon is no return";
  Hear(18);
  EXPECT_EQ(life(), ProcessBoard::Life::kBack);
  EXPECT_EQ(board_.processes()[0].restarts, 1);
  for (int i = 0; i < 20; ++i) {
    Wait(kSecond);
    Hear(18);
  }
  EXPECT_EQ(life(), ProcessBoard::Life::kUp);
}

TEST_F(BoardTest, AQuickRestartIsSeenByItsProcessId) {
  Hear(17);
  Wait(kSecond);
  Hear(18);
  EXPECT_EQ(life(), ProcessBoard::Life::kBack);
}

TEST_F(BoardTest, BeaconsKeepABusyProcessUp) {
  Hear(17);
  for (int i = 0; i < 30; ++i) {
    Wait(kSecond);
    board_.OnSign("mapper", now_);
  }
  EXPECT_EQ(life(), ProcessBoard::Life::kUp);
}

TEST_F(BoardTest, SilenceAtTheEndIsNoFailure) {
  Hear(17);
  board_.Expect("mapper");
  Wait(5 * kSecond);
  EXPECT_EQ(life(), ProcessBoard::Life::kEnded);
  EXPECT_EQ(board_.events().back().level, BoardEvent::Level::kInfo);
}

TEST(FrameSeriesTest, TellsWhatIsNewAndSaysWhenAllBeforeIsVoid) {
  FrameSeries series;
  PoseView view;
  for (uint32_t i = 0; i < 10; ++i) {
    view.frame_index = i;
    view.stamp_ns = i * kSecond;
    view.inliers = static_cast<int32_t>(100 + i);
    series.Add(view);
  }
  series.Add(view);  // a repeat
  const auto all = nlohmann::json::parse(series.Json(0, 1000));
  EXPECT_EQ(all["end"], 10);
  EXPECT_EQ(all["inliers"].size(), 10u);
  const auto rest = nlohmann::json::parse(series.Json(8, 1000));
  EXPECT_EQ(rest["first"], 8);
  EXPECT_EQ(rest["inliers"], nlohmann::json({108, 109}));
  EXPECT_EQ(nlohmann::json::parse(series.Json(0, 3))["first"], 7) << "the newest, where that is too much";
  series.Clear();
  const auto anew = nlohmann::json::parse(series.Json(10, 1000));
  EXPECT_EQ(anew["end"], 0);
  EXPECT_NE(anew["run"], all["run"]);
}

TEST(ExchangeTest, GivesTheImageAskedForOrTheNewest) {
  Exchange exchange;
  EXPECT_EQ(exchange.FindImage(std::nullopt), nullptr);
  for (uint32_t i = 0; i < 40; ++i) {
    Frame frame;
    frame.frame_index = i;
    frame.width_px = frame.height_px = 8;
    frame.encoding = FrameEncoding::kGray8;
    frame.data.assign(64, static_cast<uint8_t>(i));
    exchange.AddImage(frame);
  }
  EXPECT_EQ(exchange.FindImage(38)->frame_index(), 38u);
  EXPECT_EQ(exchange.FindImage(1)->frame_index(), 39u) << "long gone";
  const auto& jpeg = exchange.FindImage(38)->Jpeg();
  ASSERT_GT(jpeg.size(), 4u);
  EXPECT_EQ(jpeg[0], 0xff);
  EXPECT_EQ(jpeg[1], 0xd8);
  Frame other;
  other.camera_id = 1;
  other.frame_index = 38;
  exchange.AddImage(other);
  EXPECT_EQ(exchange.FindImage(38, 1)->camera(), 1u);
  EXPECT_EQ(exchange.FindImage(38)->camera(), 0u) << "frames of two cameras do not collide";
  EXPECT_EQ(exchange.FindImage(38, 2), nullptr);
  Frame broken;
  broken.frame_index = 50;
  broken.encoding = FrameEncoding::kPng;
  broken.data = {1, 2, 3};
  exchange.AddImage(broken);
  EXPECT_TRUE(exchange.FindImage(50)->Jpeg().empty());
}

TEST(ViewerJsonTest, MapsAreNamedByTheCameraThatBeganThem) {
  EXPECT_EQ(Describe({2, 1}), "maps 1 and 2 are joined");
  EXPECT_EQ(Describe({kMapsPerCamera + 1, 1}), "map 1 and map 1 of camera 1 are joined");
}

TEST(ViewerJsonTest, Base64AndFeatures) {
  EXPECT_EQ(Base64({}), "");
  EXPECT_EQ(Base64({'f'}), "Zg==");
  EXPECT_EQ(Base64({'f', 'o'}), "Zm8=");
  EXPECT_EQ(Base64({'f', 'o', 'o'}), "Zm9v");
  EXPECT_EQ(Base64({'f', 'o', 'o', 'b'}), "Zm9vYg==");
  FeatureView view;
  view.items = {{16, 32, FeatureView::Kind::kUsed}, {1, 2, FeatureView::Kind::kUnmatched}};
  const auto json = nlohmann::json::parse(FeaturesJson(view, 640, 480));
  EXPECT_EQ(json["counts"], nlohmann::json({1, 1, 0, 0}));
  EXPECT_EQ(json["data"], Base64({16, 0, 32, 0, 1}));
}

}  // namespace
}  // namespace dmslam
