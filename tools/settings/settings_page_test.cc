#include "settings_page.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "dmslam/settings/settings.h"

namespace dmslam {
namespace {

TEST(SettingsPageTest, PageIsNotStale) {
  const char* source = std::getenv("DMSLAM_SOURCE_DIR");
  const std::string path = std::string(source == nullptr ? "." : source) + "/docs/configuration.md";
  std::ifstream file(path);
  ASSERT_TRUE(file.good()) << path;
  const std::string page(std::istreambuf_iterator<char>(file), {});
  EXPECT_TRUE(page == SettingsPage())
      << "write it anew: build/release/bin/dmslam-settings --out docs/configuration.md";
}

TEST(SettingsPageTest, EverySettingIsExplainedAndCanBeSetToItsDefault) {
  Settings settings;
  const uint64_t before = SettingsHash(settings);
  for (const SettingInfo& info : ListSettings(settings)) {
    EXPECT_FALSE(info.help.empty()) << info.key;
    EXPECT_NO_THROW(ApplySetting(info.key, info.value, &settings)) << info.key << "=" << info.value;
  }
  EXPECT_EQ(SettingsHash(settings), before);
}

}  // namespace
}  // namespace dmslam
