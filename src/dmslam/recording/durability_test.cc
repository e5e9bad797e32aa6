// What is asked of the disk, and in which order: calls of this program to the system are noted before they
// are made.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/recording/checkpoint.h"
#include "dmslam/recording/journal.h"
#include "dmslam/recording/map_file.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"

namespace {

bool disk_refuses = false;

std::vector<std::string>& Asked() {
  static std::vector<std::string> asked;
  return asked;
}

std::string NameOf(const std::string& path) { return std::filesystem::path(path).filename().string(); }

void NoteSync(int fd) {
  std::error_code unknown;
  Asked().push_back("sync " +
                    NameOf(std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(fd), unknown)));
}

}  // namespace

extern "C" {
int fsync(int fd) {
  NoteSync(fd);
  return static_cast<int>(syscall(SYS_fsync, fd));
}
int fdatasync(int fd) {
  if (disk_refuses) {
    errno = EIO;
    return -1;
  }
  NoteSync(fd);
  return static_cast<int>(syscall(SYS_fdatasync, fd));
}
int rename(const char* from, const char* to) noexcept {
  Asked().push_back("rename to " + NameOf(to));
  return static_cast<int>(syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}
}

namespace dmslam {
namespace {

namespace fs = std::filesystem;
using Steps = std::vector<std::string>;

class DurabilityTest : public testing::Test {
 protected:
  DurabilityTest() : folder_(testing::TempDir() + "/dmslam_durable_" + std::to_string(getpid())) {
    fs::create_directories(folder_);
    Asked().clear();
  }
  ~DurabilityTest() override { fs::remove_all(folder_); }

  /// What was asked until now.
  static Steps Taken() { return std::exchange(Asked(), {}); }
  static Map SmallMap() {
    MapEditor map(TestCamera(), Pyramid());
    Keyframe keyframe;
    keyframe.id = KeyframeId::Make(7, 1);
    keyframe.map_id = 1;
    keyframe.features = MakeFrameFeatures({}, TestCamera(), Pyramid());
    map.AddKeyframe(std::move(keyframe));
    return map;
  }
  static SessionStart Start() {
    SessionStart start;
    start.session = 7;
    start.camera = TestCamera();
    return start;
  }
  /// The file's content is on the disk before its name is, and then the folder that holds the name.
  void ExpectSyncedThenNamed(const Steps& steps, const std::string& name) const {
    ASSERT_EQ(steps.size(), 3U) << testing::PrintToString(steps);
    EXPECT_TRUE(steps[0].starts_with("sync " + name + ".")) << steps[0];
    EXPECT_EQ(steps[1], "rename to " + name);
    EXPECT_EQ(steps[2], "sync " + NameOf(folder_));
  }
  std::string folder_;
};

TEST_F(DurabilityTest, AResultIsSyncedBeforeItIsNamed) {
  WriteFile(folder_ + "/trajectory.txt", "1 2 3");
  ExpectSyncedThenNamed(Taken(), "trajectory.txt");
}

TEST_F(DurabilityTest, ASavedMapIsSyncedBeforeItIsNamed) {
  SaveMap(folder_ + "/room.map", SmallMap(), Start());
  ExpectSyncedThenNamed(Taken(), "room.map");
}

TEST_F(DurabilityTest, ACheckpointIsSyncedBeforeItIsNamed) {
  const std::string path = CheckpointPath(folder_);
  WriteCheckpoint(path, Cut(path, SmallMap()), Start());
  const Steps steps = Taken();
  ASSERT_EQ(steps.size(), 6U) << testing::PrintToString(steps);
  ExpectSyncedThenNamed({steps.begin(), steps.begin() + 3}, NameOf(path) + ".new");
  EXPECT_EQ(steps[4], "rename to " + NameOf(path)) << "what was synced takes the former one's place";
  EXPECT_EQ(steps[5], "sync " + NameOf(folder_));
}

TEST_F(DurabilityTest, AJournalThatTheDiskRefusesIsNamed) {
  Journal journal(folder_ + "/collector.journal");
  journal.Begin(7);
  disk_refuses = true;
  try {
    journal.Sync();
    ADD_FAILURE() << "what is not on the disk is not safe";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("collector.journal: is not safe from a power cut"),
              std::string::npos);
  }
  disk_refuses = false;
  EXPECT_NO_THROW(journal.Sync());
}

TEST_F(DurabilityTest, AJournalIsSyncedWithItsFolderAndAnotherSessionsIsSetAside) {
  const std::string path = folder_ + "/collector.journal";
  {
    Journal journal(path);
    journal.Begin(7);
    EXPECT_EQ(Taken(), (Steps{"sync " + NameOf(folder_)})) << "its name outlives a power cut";
    journal.AppendNote("x");
    EXPECT_EQ(Taken(), Steps{});
    journal.Sync();
    EXPECT_EQ(Taken(), (Steps{"sync collector.journal"}));
  }
  Journal journal(path);
  journal.Begin(8);
  EXPECT_EQ(Taken(), (Steps{"sync collector.journal", "rename to collector.journal", "sync former-7",
                            "sync " + NameOf(folder_), "sync " + NameOf(folder_)}));
}

}  // namespace
}  // namespace dmslam
