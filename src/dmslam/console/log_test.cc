#include "dmslam/console/log.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

TEST(LogTest, ValuesStandWhereTheBracesAre) {
  const std::string path = "a.log";
  EXPECT_EQ(FormatLine("{}: {} of {}", {path, 3, uint64_t{18446744073709551615u}}),
            "a.log: 3 of 18446744073709551615");
  EXPECT_EQ(FormatLine("{:.1f} s, {}", {2.25, "text"}), "2.2 s, text");
  EXPECT_EQ(FormatLine("{}", {int64_t{-5}}), "-5");
}

TEST(LogTest, TextOfOthersIsNotAFormat) {
  const std::string hostile = "{} {:n} {{";
  EXPECT_EQ(FormatLine("{}", {hostile}), hostile);
}

}  // namespace
}  // namespace dmslam
