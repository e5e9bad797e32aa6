#include "viewer/health_text.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

constexpr int64_t kSecond = 1'000'000'000;

bool Has(const std::string& text, const std::string& line) {
  return ("\n" + text).find("\n" + line + "\n") != std::string::npos;
}

TEST(HealthTextTest, SaysWhoIsThereAndWhoIsSilent) {
  ProcessBoard board({"player", "frontend", "mapper", "loopcloser"});
  const auto health = [&] { return WriteHealth(board, {}, {}); };
  const auto say = [&](const std::string& name, int32_t pid, int64_t now_ns) {
    StatusHead head;
    head.health.pid = pid;
    head.health.rss_mb = 12.5;
    head.health.cpu_percent = 75;
    head.health.records_lost = 3;
    head.health.dropped_overflow = 4;
    head.health.refused_peers = 5;
    board.OnStatus(name, head, "", now_ns, 0);
  };
  EXPECT_FALSE(health().well) << "nobody was heard";
  for (const char* name : {"player", "frontend", "mapper"}) say(name, 7, kSecond);
  EXPECT_TRUE(health().well) << "the loop closer may be left out";
  EXPECT_NE(health().json.find("\"loopcloser\": \"awaited\""), std::string::npos);
  EXPECT_TRUE(Has(health().prometheus, "dmslam_up{process=\"mapper\"} 1"));
  EXPECT_TRUE(Has(health().prometheus, "dmslam_resident_megabytes{process=\"mapper\"} 12.5"));
  EXPECT_TRUE(Has(health().prometheus, "dmslam_cpu_percent{process=\"mapper\"} 75"));
  EXPECT_TRUE(Has(health().prometheus, "dmslam_records_lost_total{process=\"mapper\"} 3"));
  EXPECT_TRUE(Has(health().prometheus, "dmslam_dropped_without_room_total{process=\"mapper\"} 4"));
  EXPECT_TRUE(Has(health().prometheus, "dmslam_refused_peers_total{process=\"mapper\"} 5"));
  say("mapper", 8, 2 * kSecond);
  EXPECT_TRUE(Has(health().prometheus, "dmslam_restarts_total{process=\"mapper\"} 1"));
  say("player", 7, 5 * kSecond);
  say("frontend", 7, 5 * kSecond);
  board.Advance(6 * kSecond, 0);
  EXPECT_FALSE(health().well);
  EXPECT_NE(health().json.find("\"mapper\": \"down\""), std::string::npos);
  EXPECT_TRUE(Has(health().prometheus, "dmslam_up{process=\"mapper\"} 0"));
}

/// The collector says no status, but acknowledges what it has.
TEST(HealthTextTest, WhoTellsNothingOfItselfIsUpOrDown) {
  ProcessBoard board({"player", "frontend", "mapper", "collector"});
  const auto health = [&] { return WriteHealth(board, {}, {}); };
  const auto all_but_the_collector = [&](int64_t now_ns) {
    for (const char* name : {"player", "frontend", "mapper"}) board.OnStatus(name, {}, "", now_ns, 0);
  };
  all_but_the_collector(kSecond);
  EXPECT_TRUE(health().well) << "a run without a collector";
  board.Need("collector");
  EXPECT_FALSE(health().well) << "one with a collector that was not heard yet";
  board.OnWord("collector", 77, kSecond, 0);
  EXPECT_TRUE(health().well);
  EXPECT_TRUE(Has(health().prometheus, "dmslam_up{process=\"collector\"} 1"));
  EXPECT_TRUE(Has(health().prometheus, "dmslam_restarts_total{process=\"collector\"} 0"));
  EXPECT_EQ(health().prometheus.find("megabytes{process=\"collector\"}"), std::string::npos)
      << "what it does not tell is not said to be zero";
  all_but_the_collector(5 * kSecond);
  board.Advance(5 * kSecond, 0);
  EXPECT_FALSE(health().well);
  EXPECT_NE(health().json.find("\"collector\": \"down\""), std::string::npos);
  board.OnWord("collector", 77, 5 * kSecond, 0);
  EXPECT_TRUE(health().well);
  EXPECT_TRUE(Has(health().prometheus, "dmslam_restarts_total{process=\"collector\"} 0"));
  board.OnWord("collector", 78, 5 * kSecond, 0);
  EXPECT_TRUE(Has(health().prometheus, "dmslam_restarts_total{process=\"collector\"} 1"));
}

TEST(HealthTextTest, EveryFamilySaysItsTypeOnce) {
  const std::string text = WriteHealth(ProcessBoard({"player"}), {}, {}).prometheus;
  size_t types = 0, helps = 0;
  for (size_t at = text.find("# TYPE "); at != std::string::npos; at = text.find("# TYPE ", at + 1)) ++types;
  for (size_t at = text.find("# HELP "); at != std::string::npos; at = text.find("# HELP ", at + 1)) ++helps;
  EXPECT_GT(types, 15u);
  EXPECT_EQ(types, helps);
  EXPECT_TRUE(Has(text, "# TYPE dmslam_frames_processed_total counter"));
}

}  // namespace
}  // namespace dmslam
