#include "dmslam/recording/set_aside.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace dmslam {
namespace {

namespace fs = std::filesystem;

class SetAsideTest : public testing::Test {
 protected:
  SetAsideTest() : folder_(testing::TempDir() + "/dmslam_set_aside_" + std::to_string(getpid())) {
    fs::create_directories(folder_);
  }
  ~SetAsideTest() override { fs::remove_all(folder_); }

  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ + "/" + name) << text;
  }
  static std::string Read(const std::string& path) {
    std::string text;
    std::ifstream(path) >> text;
    return text;
  }

  std::string folder_;
};

TEST_F(SetAsideTest, FilesThatAreThereAreMovedTogetherAndNothingElseIs) {
  Write("map", "m");
  Write("journal", "j");
  Write("other", "o");
  const auto aside = SetAside(folder_, 7, {"map", "former", "journal"});
  ASSERT_EQ(aside, std::optional(folder_ + "/former-7"));
  EXPECT_EQ(Read(*aside + "/map"), "m");
  EXPECT_EQ(Read(*aside + "/journal"), "j");
  EXPECT_FALSE(fs::exists(folder_ + "/journal"));
  EXPECT_TRUE(fs::exists(folder_ + "/other"));
  EXPECT_EQ(SetAside(folder_, 7, {"map", "former", "journal"}), std::nullopt);
}

TEST_F(SetAsideTest, AnOlderSetIsNotOverwritten) {
  for (const std::string text : {"1", "2", "3"}) {
    Write("journal", text);
    SetAside(folder_, 7, {"map", "journal"});
  }
  EXPECT_EQ(Read(folder_ + "/former-7/journal"), "1");
  EXPECT_EQ(Read(folder_ + "/former-7-2/journal"), "2");
  EXPECT_EQ(Read(folder_ + "/former-7-3/journal"), "3");
}

TEST_F(SetAsideTest, WhatWasCutShortIsCompleted) {
  fs::create_directories(folder_ + "/former-7");
  Write("former-7/map", "m");
  Write("journal", "j");
  SetAside(folder_, 7, {"map", "journal"});
  EXPECT_EQ(Read(folder_ + "/former-7/journal"), "j");
  EXPECT_FALSE(fs::exists(folder_ + "/former-7-2"));
}

}  // namespace
}  // namespace dmslam
