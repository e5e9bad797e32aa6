#include "frontend/remembered_frames.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "dmslam/camera/testing/test_camera.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

class RememberedFramesTest : public testing::Test {
 protected:
  RememberedFramesTest() : folder_(testing::TempDir() + "/dmslam_remembered_" + std::to_string(getpid())) {
    setup_.camera = TestCamera();
  }
  ~RememberedFramesTest() override { fs::remove_all(folder_); }

  static RememberedFrame Frame(uint32_t index) {
    RememberedFrame frame;
    frame.seen.id = KeyframeId::Make(1, index);
    frame.seen.map_id = 1;
    return frame;
  }
  /// How many frames an end of the sequence works on, of a core that has had none of its own.
  int Unplaced(RememberedFrames* frames) {
    FrontendCore core(setup_);
    frames->TakeOver(&core);
    int count = 0;
    for (; core.WorkAtEnd(); ++count) {
    }
    return count;
  }

  std::string folder_;
  FrontendCore::Setup setup_;
};

TEST_F(RememberedFramesTest, AreTakenOverOnce) {
  RememberedFrames before(folder_, 1, 0);
  for (uint32_t i = 0; i < 4; ++i) before.Add(Frame(i));
  RememberedFrames after(folder_, 1, 0);
  EXPECT_EQ(Unplaced(&after), 4);
  EXPECT_EQ(Unplaced(&after), 0);
}

TEST_F(RememberedFramesTest, OwnFramesAreNotTakenOver) {
  RememberedFrames frames(folder_, 1, 0);
  for (uint32_t i = 0; i < 4; ++i) frames.Add(Frame(i));
  EXPECT_EQ(Unplaced(&frames), 0);
}

TEST_F(RememberedFramesTest, NothingIsKeptWithoutAFolder) {
  RememberedFrames frames("", 1, 0);
  frames.Add(Frame(0));
  EXPECT_EQ(Unplaced(&frames), 0);
  frames.Remove();
}

TEST_F(RememberedFramesTest, WhereTheyCannotBeKeptTheFrontendGoesOn) {
  std::ofstream(folder_) << "a file";
  RememberedFrames frames(folder_, 1, 0);
  frames.Add(Frame(0));
  frames.Add(Frame(1));
  EXPECT_EQ(Unplaced(&frames), 0);
}

TEST_F(RememberedFramesTest, WhereTheFolderGoesTheFrontendGoesOn) {
  RememberedFrames frames(folder_, 1, 0, 1);  // a file for each
  frames.Add(Frame(0));
  fs::remove_all(folder_);
  frames.Add(Frame(1));
  EXPECT_EQ(Unplaced(&frames), 0);
}

TEST_F(RememberedFramesTest, NothingIsLeftWhenAllIsTold) {
  RememberedFrames frames(folder_, 1, 0);
  frames.Add(Frame(0));
  EXPECT_TRUE(fs::exists(folder_));
  frames.Remove();
  EXPECT_FALSE(fs::exists(folder_));
}

}  // namespace
}  // namespace dmslam
