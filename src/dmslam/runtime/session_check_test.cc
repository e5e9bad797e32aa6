#include "dmslam/runtime/session_check.h"

#include <gtest/gtest.h>

#include "dmslam/util/version.h"

namespace dmslam {
namespace {

SessionStart StartOf(const Settings& settings, std::optional<uint64_t> vocabulary) {
  SessionStart start;
  start.session = 7;
  start.software = "0.1.9";
  start.seed = 1;
  start.profile = settings.profile();
  start.configuration_hash = settings.Hash();
  start.vocabulary_checksum = vocabulary;
  return start;
}

bool Says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Both versions are named.
std::string TheFrontendHas(const std::string& what) {
  std::string text = "the frontend of session 7 (version 0.1.9, this is ";
  text += kVersion;
  text += ") has ";
  return text += what;
}

TEST(SessionCheckTest, TheSameSettingsAndVocabularyFit) {
  Settings settings("baseline");
  settings.Set("features.count", "1500");
  EXPECT_EQ(WhyMisfit(StartOf(settings, 5), settings, 5), "");
  EXPECT_EQ(WhyMisfit(StartOf(settings, std::nullopt), settings, 5), "");  // a frontend without one
  EXPECT_EQ(WhyMisfit(StartOf(settings, 5), settings), "");                // a process without one
}

TEST(SessionCheckTest, OtherSettingsAreNamedWithTheCure) {
  Settings ours;
  ours.Set("tracking.min_inliers", "25");
  const std::string why = WhyMisfit(StartOf(Settings("baseline"), std::nullopt), ours);
  EXPECT_TRUE(Says(why, TheFrontendHas("other settings (profile baseline, seed 1, hash "))) << why;
  EXPECT_TRUE(Says(why, "this process (profile dm, seed 1, hash ")) << why;
  EXPECT_TRUE(Says(why, "give every process the same --config and --set")) << why;
}

TEST(SessionCheckTest, AnotherVocabularyIsNamedWithTheCure) {
  const std::string why = WhyMisfit(StartOf(Settings(), 5), Settings(), 6);
  EXPECT_TRUE(Says(why, TheFrontendHas("another vocabulary (checksum 0000000000000005) than this process "
                                       "(0000000000000006)")))
      << why;
}

TEST(SessionCheckTest, CameraFilesOfAllOtherCamerasOrOfNone) {
  EXPECT_EQ(WhyNotTheseCameras("", 2, 0), "");
  EXPECT_EQ(WhyNotTheseCameras("first.yaml", 2, 2), "");
  EXPECT_NE(WhyNotTheseCameras("first.yaml", 2, 1).find("one for each --also"), std::string::npos);
  EXPECT_NE(WhyNotTheseCameras("", 1, 1).find("goes with --camera"), std::string::npos);
}

}  // namespace
}  // namespace dmslam
