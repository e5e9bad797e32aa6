#include "dmslam/util/output_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "dmslam/util/check.h"
#include "dmslam/util/testing/small_disk.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

class OutputFileTest : public testing::Test {
 protected:
  OutputFileTest() : folder_(testing::TempDir() + "/dmslam_output_" + std::to_string(getpid())) {
    fs::create_directories(folder_);
  }
  ~OutputFileTest() override { fs::remove_all(folder_); }
  static std::string Read(const fs::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  fs::path folder_;
};

TEST_F(OutputFileTest, AppearsWhenItIsComplete) {
  const fs::path path = folder_ / "trajectory.txt";
  {
    OutputFile file(path);
    file.Write("half");
    EXPECT_FALSE(fs::exists(path));
  }
  EXPECT_TRUE(fs::is_empty(folder_)) << "what is dropped leaves nothing";
  WriteFile(path, "whole");
  EXPECT_EQ(Read(path), "whole");
}

TEST_F(OutputFileTest, AFullDiskLeavesTheFormerFile) {
  const fs::path path = folder_ / "trajectory.txt";
  WriteFile(path, "former");
  {
    const SmallDisk disk(1000);
    try {
      WriteFile(path, std::string(100'000, 'x'));
      FAIL() << "the disk is full";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("trajectory.txt: cannot be written (File too large)"),
                std::string::npos)
          << error.what();
    }
  }
  EXPECT_EQ(Read(path), "former");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1) << "nothing else is left";
}

TEST_F(OutputFileTest, AFolderThatTakesNoFileIsNamed) {
  const std::string folder = folder_.string();
  const auto why = [](const std::string& file) -> std::string {
    try {
      CheckFolderOf(file);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(why(folder + "/a"), "");
  EXPECT_EQ(why("a"), "") << "the folder of now";
  EXPECT_EQ(why(folder + "/b/a"), folder +
                                      "/b: no such folder, so a cannot be written there; make it, or choose "
                                      "another folder");
  std::ofstream(folder + "/b") << "a file";
  EXPECT_EQ(why(folder + "/b/a"), folder +
                                      "/b: is no folder, so a cannot be written there; move it away, or "
                                      "choose another folder");
  fs::create_directories(folder + "/c");
  for (const char* file : {"/c", "/c/"})
    EXPECT_EQ(why(folder + file), folder + file + ": is a folder; give the name of a file");
}

}  // namespace
}  // namespace dmslam
