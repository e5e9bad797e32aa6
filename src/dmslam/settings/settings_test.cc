#include "dmslam/settings/settings.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>

#include "dmslam/features/orb_extractor.h"
#include "dmslam/initialization/initializer_options.h"
#include "dmslam/loops/loop_options.h"
#include "dmslam/mapping/mapper_options.h"
#include "dmslam/settings/registry.h"
#include "dmslam/settings/run_options.h"
#include "dmslam/slam/frontend_options.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

/// A configuration file of this text.
class ConfigFile {
 public:
  explicit ConfigFile(const std::string& text)
      : path_((std::filesystem::path(::testing::TempDir()) /
               (std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + ".yaml"))
                  .string()) {
    std::ofstream(path_) << text;
  }
  ~ConfigFile() { std::filesystem::remove(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

Settings Load(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return LoadSettings(ConfigFile(text).path(), overrides);
}

/// What is said of a file of this text, without the folder; empty where it is accepted.
std::string Refusal(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const ConfigFile file(text);
  try {
    LoadSettings(file.path(), overrides);
  } catch (const InputError& error) {
    std::string message = error.what();
    for (size_t at = 0; (at = message.find(file.path())) != std::string::npos;)
      message.replace(at, file.path().size(), "FILE");
    return message;
  }
  return "";
}

TEST(SettingsTest, ReadsWhatRoomsDescribe) {
  const Settings settings = Load(
      "tracking:\n  min_inliers: 25\n  motion_belief: off\nfeatures: {count: 1500, scale_factor: 1.3}\n"
      "mapping.alpha: 0.5\nmapping:\n  belief_found_step: 0.1\nseed: 7\n",
      {"loop.min_share=0.3", "initializer.method=arsac"});
  EXPECT_EQ(settings.Read<FrontendOptions>().tracking.min_local_inliers, 25);
  EXPECT_FALSE(settings.Read<FrontendOptions>().tracking.dynamics.vote.motion_belief);
  EXPECT_FALSE(settings.Read<MapperOptions>().belief.enabled);  // one switch for both
  EXPECT_EQ(settings.Read<OrbExtractorOptions>().num_features, 1500);
  EXPECT_EQ(settings.Read<Pyramid>().scale_factor, 1.3);
  EXPECT_EQ(settings.Read<MapperOptions>().creation.alpha, 0.5);
  EXPECT_EQ(settings.Read<MapperOptions>().belief.found_step, 0.1F);
  EXPECT_EQ(settings.Read<RunOptions>().seed, 7u);
  EXPECT_EQ(settings.Read<LoopcloserOptions>().min_share, 0.3);
  EXPECT_EQ(settings.Read<FrontendOptions>().initializer_method, FirstMapMethod::kArsac);
  EXPECT_EQ(settings.Read<InitializerOptions>().min_matches, InitializerOptions().min_matches);
}

TEST(SettingsTest, DefaultsAreThoseOfTheOptions) {
  const Settings settings;
  EXPECT_EQ(settings.profile(), "dm");
  EXPECT_EQ(settings.Read<OrbExtractorOptions>().num_features, OrbExtractorOptions().num_features);
  EXPECT_EQ(settings.Read<InitializerOptions>().agreement.min_agreement,
            InitializerOptions().agreement.min_agreement);
  EXPECT_EQ(settings.Read<MapperOptions>().min_depth, MapperOptions().min_depth);
  EXPECT_EQ(settings.Read<FrontendOptions>().max_kept_frames, FrontendOptions().max_kept_frames);
}

TEST(SettingsTest, EverySettingIsExplainedBoundedAndCanBeSetToItsDefault) {
  ASSERT_GT(AllSettings().size(), 50u);
  Settings settings;
  for (const SettingInfo& info : AllSettings()) {
    EXPECT_FALSE(info.help.empty()) << info.key;
    EXPECT_FALSE(info.allowed.empty()) << info.key;
    EXPECT_EQ(info.Canonical(info.value), info.value) << info.key;
    const std::string baseline = info.baseline.value_or(info.value);
    EXPECT_EQ(info.Canonical(baseline), baseline) << info.key;
    const std::string paper = info.paper.value_or(info.value);
    EXPECT_EQ(info.Canonical(paper), paper) << info.key;
    if (info.key != "profile") settings.Set(info.key, info.value);
  }
  EXPECT_EQ(settings.Hash(), Settings().Hash());
}

TEST(SettingsTest, AnOverrideGoesBeforeTheFileAndTheLastOneCounts) {
  const Settings settings = Load("seed: 3\nfeatures:\n  count: 1200\n", {"seed=4", "seed=5"});
  EXPECT_EQ(settings.Read<RunOptions>().seed, 5u);
  EXPECT_EQ(settings.Read<OrbExtractorOptions>().num_features, 1200);
}

TEST(SettingsTest, TheProfileComesFirstWhereverItStands) {
  const std::vector<std::string> files = {
      "profile: baseline\ntracking:\n  motion_belief: on\nmapping:\n  min_depth: 0.2\n",
      "tracking:\n  motion_belief: on\nprofile: baseline\nmapping:\n  min_depth: 0.2\n",
      "mapping:\n  min_depth: 0.2\ntracking:\n  motion_belief: on\nprofile: baseline\n"};
  for (const std::string& text : files) {
    const Settings settings = Load(text);
    EXPECT_EQ(settings.profile(), "baseline");
    EXPECT_TRUE(settings.Read<FrontendOptions>().tracking.dynamics.vote.motion_belief) << text;
    EXPECT_EQ(settings.Read<MapperOptions>().min_depth, 0.2) << text;
    EXPECT_FALSE(settings.Read<MapperOptions>().creation.mutual_exclusion) << text;
    EXPECT_FALSE(settings.Read<MapperOptions>().seen_through.enabled) << text;
    EXPECT_EQ(settings.Read<FrontendOptions>().initializer_method, FirstMapMethod::kTwoFrameRansac) << text;
    EXPECT_EQ(settings.Read<FrontendOptions>().max_kept_frames, 300) << text;
    EXPECT_FALSE(settings.Read<FrontendOptions>().smooth_at_end) << text;
    EXPECT_FALSE(settings.Read<FrontendOptions>().keyframes_at_end) << text;
    EXPECT_EQ(settings.Hash(), Load(files.front()).Hash()) << text;
  }
  const Settings late = Load("", {"tracking.motion_belief=on", "profile=baseline"});
  EXPECT_TRUE(late.Read<FrontendOptions>().tracking.dynamics.vote.motion_belief);
  EXPECT_EQ(Load("profile: baseline\n", {"profile=dm"}).Hash(), Settings().Hash());
}

TEST(SettingsTest, TheHashTellsWhatResultsTell) {
  const uint64_t hash = Settings().Hash();
  EXPECT_EQ(Load("tracking: {motion_belief: true}\nmapping: {alpha: 1.0}\n").Hash(), hash);
  EXPECT_NE(Load("seed: 2\n").Hash(), hash);
  EXPECT_NE(Load("profile: baseline\n").Hash(), hash);
  EXPECT_NE(Load("loop: {enabled: off}\n").Hash(), hash);
  EXPECT_EQ(Load("collector: {checkpoint_s: 0}\nmap: {features_mb: 1}\n").Hash(), hash)
      << "how much is kept where, and how often, is all the same to results";
}

TEST(SettingsTest, WhatIsWrongIsNamedWithFileLineAndCure) {
  EXPECT_EQ(Refusal("seed: 1\ntracking:\n  motion_believe: on\n"),
            "FILE:3: setting 'tracking.motion_believe' does not exist; did you mean "
            "'tracking.motion_belief'? (docs/configuration.md lists all)");
  EXPECT_EQ(Refusal("foo.bar: 1\n"),
            "FILE:1: setting 'foo.bar' does not exist; docs/configuration.md lists all")
      << "nothing is like it";
  EXPECT_EQ(Refusal("a: 1\n"), "FILE:1: setting 'a' does not exist; docs/configuration.md lists all");
  EXPECT_EQ(Refusal("mapping: 3\n"),
            "FILE:1: 'mapping' is a section and has no value; write its settings below it, or as "
            "'section.key' (docs/configuration.md lists all)");
  EXPECT_EQ(Refusal("'': 3\n"), "FILE:1: the name of a setting is missing; write 'key: value'");
  EXPECT_EQ(
      Refusal("seed: 1\n\ntracking:\n  min_inliers: 3\n"),
      "FILE:4: setting 'tracking.min_inliers': '3' is not allowed; write a whole number from 6 to 10000");
  EXPECT_EQ(
      Refusal("keyframe:\n  min_interval_s: -1\n"),
      "FILE:2: setting 'keyframe.min_interval_s': '-1' is not allowed; write a number from 0 to 60 [s]");
  EXPECT_EQ(Refusal("features: {count: many}\n"),
            "FILE:1: setting 'features.count': 'many' is not allowed; write a whole number from 50 to 10000");
  EXPECT_EQ(
      Refusal("features:\n  count: 1000.5\n"),
      "FILE:2: setting 'features.count': '1000.5' is not allowed; write a whole number from 50 to 10000");
  EXPECT_EQ(Refusal("loop:\n  enabled: perhaps\n"),
            "FILE:2: setting 'loop.enabled': 'perhaps' is not allowed; write on or off");
  EXPECT_EQ(
      Refusal("initializer:\n  method: magic\n"),
      "FILE:2: setting 'initializer.method': 'magic' is not allowed; write dlrsac, arsac, ransac or paper");
  EXPECT_EQ(Refusal("seed: 1\nprofile: fast\n"),
            "FILE:2: setting 'profile': 'fast' is not allowed; write dm, baseline or paper");
  EXPECT_EQ(Refusal("mapping:\n  alpha: [1, 2]\n"),
            "FILE:2: setting 'mapping.alpha' is neither a value nor a section; write a number from 0 to 100");
  EXPECT_NE(
      Refusal("seed:\n").find("setting 'seed' is neither a value nor a section; write a whole number from 0"),
      std::string::npos);
  EXPECT_EQ(Refusal("seed: 1\nfeatures.count: 1000\nfeatures:\n  count: 1200\n"),
            "FILE:4: setting 'features.count' stands at FILE:2 too; delete one of them");
  EXPECT_NE(Refusal("keyframe:\n  max_interval_s: 1\n")
                .find("FILE:2: setting 'keyframe.max_interval_s' was removed"),
            std::string::npos);
  EXPECT_NE(Refusal("mapping:\n  alpha: nan\n"), "");
  EXPECT_NE(Refusal("seed: -1\n"), "");
  EXPECT_NE(Refusal("just text\n"), "");
  EXPECT_NE(Refusal("a: [1\n"), "");
}

TEST(SettingsTest, EveryBoundIsKeptAndNamed) {
  for (const SettingInfo& info : AllSettings()) {
    std::vector<std::string> outside = {"neither"};
    if (info.choices.empty() && info.type != SettingInfo::Type::kSwitch) {
      outside = {FormatSetting(info.low - 1), FormatSetting(info.high * 2 + 1)};
    }
    for (const std::string& value : outside) {
      const std::string said = Refusal("# a comment\n" + info.key + ": " + value + "\n");
      EXPECT_EQ(said.find("FILE:2: setting '" + info.key + "': '" + value + "' is not allowed; write "), 0u)
          << info.key << ": " << said;
      EXPECT_NE(said.find(info.allowed), std::string::npos) << info.key << ": " << said;
    }
  }
}

TEST(SettingsTest, NamesTheLineThatIsNoYaml) {
  EXPECT_EQ(Refusal("tracking:\n\tmin_inliers: 25\n").find("FILE:2: is not valid YAML (column "), 0u)
      << Refusal("tracking:\n\tmin_inliers: 25\n");
  EXPECT_EQ(Refusal("seed: 7\nfeatures: {count: 1500\n").find("FILE:3: is not valid YAML (column 1: "), 0u)
      << Refusal("seed: 7\nfeatures: {count: 1500\n");
}

TEST(SettingsTest, AWrongOverrideIsNamedAsItWasTyped) {
  EXPECT_EQ(Refusal("", {"tracking.min_inliers=3"}),
            "--set tracking.min_inliers=3: setting 'tracking.min_inliers': '3' is not allowed; write a whole "
            "number from 6 to 10000");
  EXPECT_EQ(Refusal("", {"seed"}), "--set seed: write key=value");
  EXPECT_EQ(Refusal("", {"=3"}), "--set =3: write key=value");
  EXPECT_EQ(Refusal("", {"mapping=3"}).find("--set mapping=3: 'mapping' is a section"), 0u);
  EXPECT_THROW(LoadSettings("/nonexistent.yaml", {}), InputError);
}

}  // namespace
}  // namespace dmslam
