#include "settings_page.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "dmslam/settings/registry.h"

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

TEST(SettingsPageTest, EverySettingIsThere) {
  const std::string page = SettingsPage();
  for (const SettingInfo& info : AllSettings())
    EXPECT_NE(page.find("| `" + info.key + "` | " + info.value + " |"), std::string::npos) << info.key;
}

}  // namespace
}  // namespace dmslam
