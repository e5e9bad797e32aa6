#include "dmslam/util/build_version.h"

#include <gtest/gtest.h>

#include <regex>
#include <string>

#include "dmslam/util/version.h"

namespace dmslam {
namespace {

TEST(BuildVersion, IsTheVersionAndTheCommitWhereThatIsKnown) {
  const std::string version = BuildVersion();
  ASSERT_TRUE(version.starts_with(kVersion)) << version;
  const std::string rest = version.substr(std::string(kVersion).size());
  EXPECT_TRUE(std::regex_match(rest, std::regex("|[+][0-9a-f]{10,40}(-changed)?"))) << version;
}

}  // namespace
}  // namespace dmslam
