#include "dmslam/recording/frame_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kSession = 7;
constexpr size_t kMost = 1000000;

class FrameMemoryTest : public testing::Test {
 protected:
  FrameMemoryTest() : folder_(testing::TempDir() + "/dmslam_frames_" + std::to_string(getpid())) {}
  ~FrameMemoryTest() override { fs::remove_all(folder_); }

  /// A frame that saw a landmark of number `sees`; none: it had no pose.
  static RememberedFrame Frame(uint32_t index, uint32_t sees = 0) {
    RememberedFrame frame;
    frame.seen.id = KeyframeId::Make(kSession, index);
    frame.seen.map_id = 1;
    frame.seen.stamp_ns = 1000 * static_cast<int64_t>(index);
    frame.seen.features.keypoints.resize(3);
    frame.seen.features.descriptors.resize(3);
    if (sees == 0) return frame;
    frame.seen.matches = {{2, LandmarkId::Make(kSession, sees)}};
    frame.pose.emplace();
    frame.pose->frame_index = index;
    frame.pose->state = TrackingState::kTracking;
    frame.pose->reference = KeyframeId::Make(kSession, 0);
    frame.pose->T_cam_reference.translation = {0.1 * index, 0, 0};
    return frame;
  }
  /// What a frontend whose own frames begin with `first` is handed out.
  std::vector<RememberedFrame> Left(uint32_t first, size_t most = kMost) const {
    FrameMemory memory(folder_, kSession, 0, most);
    memory.Open(first);
    std::vector<RememberedFrame> frames;
    memory.ForEach(first, [&](RememberedFrame frame) { frames.push_back(std::move(frame)); });
    return frames;
  }
  static std::vector<uint32_t> Numbers(const std::vector<RememberedFrame>& frames) {
    std::vector<uint32_t> numbers(frames.size());
    std::ranges::transform(frames, numbers.begin(),
                           [](const RememberedFrame& frame) { return frame.seen.id.frame_index(); });
    return numbers;
  }
  /// A file takes one frame beyond these.
  size_t BytesOf(size_t num_frames) const {
    FrameMemory memory(folder_, kSession, 0, kMost);
    memory.Open(0);
    memory.Add(Frame(0));
    const size_t bytes = fs::file_size(fs::directory_iterator(folder_)->path());
    memory.Remove();
    return num_frames * bytes;
  }
  size_t NumFiles() const {
    return static_cast<size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  std::string folder_;
};

using Numbered = std::vector<uint32_t>;

TEST_F(FrameMemoryTest, TheNextFrontendHasTheFramesOfTheOneBefore) {
  {
    FrameMemory memory(folder_, kSession, 0, kMost);
    memory.Open(0);
    memory.Add(Frame(0));
    memory.Add(Frame(1, 5));
    memory.Add(Frame(2, 6));
  }
  const std::vector<RememberedFrame> frames = Left(3);
  ASSERT_EQ(Numbers(frames), (Numbered{2, 1, 0}));
  ASSERT_TRUE(frames[1].pose);
  EXPECT_EQ(frames[1].pose->T_cam_reference.translation.x(), 0.1);
  EXPECT_EQ(frames[1].seen.stamp_ns, 1000);
  EXPECT_EQ(frames[1].seen.features.size(), 3u);
  ASSERT_EQ(frames[1].seen.matches.size(), 1u);
  EXPECT_EQ(frames[1].seen.matches[0].landmark, LandmarkId::Make(kSession, 5));
  EXPECT_FALSE(frames[2].pose);
}

TEST_F(FrameMemoryTest, WhatWasToldLastCounts) {
  FrameMemory memory(folder_, kSession, 0, kMost);
  memory.Open(0);
  memory.Add(Frame(0));
  memory.Add(Frame(1));
  memory.Add(Frame(0, 5));
  const std::vector<RememberedFrame> frames = Left(2);
  ASSERT_EQ(Numbers(frames), (Numbered{1, 0}));
  EXPECT_TRUE(frames[1].pose);
}

TEST_F(FrameMemoryTest, FramesThatAnotherOneTracksItselfAreItsOwn) {
  FrameMemory memory(folder_, kSession, 0, kMost);
  memory.Open(0);
  for (uint32_t i = 0; i < 5; ++i) memory.Add(Frame(i));
  EXPECT_EQ(Numbers(Left(3)), (Numbered{2, 1, 0}));
}

TEST_F(FrameMemoryTest, TheFramesOfSeveralFrontendsAreThere) {
  for (uint32_t first : {0u, 2u}) {
    FrameMemory memory(folder_, kSession, 0, kMost);
    memory.Open(first);
    memory.Add(Frame(first));
    memory.Add(Frame(first + 1));
  }
  EXPECT_EQ(Numbers(Left(4)), (Numbered{3, 2, 1, 0}));
}

TEST_F(FrameMemoryTest, ANewRunOfThatSessionBeginsAnew) {
  {
    FrameMemory memory(folder_, kSession, 0, kMost);
    memory.Open(0);
    for (uint32_t i = 0; i < 5; ++i) memory.Add(Frame(i));
  }
  EXPECT_TRUE(Left(0).empty());
  EXPECT_TRUE(Left(5).empty()) << "they are gone";
}

TEST_F(FrameMemoryTest, TheOldestAreForgotten) {
  constexpr size_t kFew = 3;
  const size_t most = BytesOf(kFew);
  for (uint32_t last = 3; last < 20; ++last) {
    fs::remove_all(folder_);
    FrameMemory memory(folder_, kSession, 0, most);
    memory.Open(0);
    for (uint32_t i = 0; i <= last; ++i) memory.Add(Frame(i));
    const Numbered numbers = Numbers(Left(last + 1, most));
    ASSERT_GE(numbers.size(), kFew) << last;
    ASSERT_LE(numbers.size(), 2 * (kFew + 1)) << last;
    for (uint32_t i = 0; i < numbers.size(); ++i) ASSERT_EQ(numbers[i], last - i);
  }
}

TEST_F(FrameMemoryTest, AFrontendThatGoesOnInTheSecondFileForgetsAsMany) {
  constexpr size_t kFew = 3;
  const size_t most = BytesOf(kFew);
  for (uint32_t i = 0; i < 20; ++i) {  // each frame has a frontend of its own
    FrameMemory memory(folder_, kSession, 0, most);
    memory.Open(i);
    memory.Add(Frame(i));
  }
  const Numbered numbers = Numbers(Left(20, most));
  EXPECT_GE(numbers.size(), kFew);
  EXPECT_LE(numbers.size(), 2 * (kFew + 1));
  EXPECT_EQ(numbers.front(), 19u);
}

TEST_F(FrameMemoryTest, AFrameThatWasNotWrittenWholeIsNotThere) {
  {
    FrameMemory memory(folder_, kSession, 0, kMost);
    memory.Open(0);
    for (uint32_t i = 0; i < 3; ++i) memory.Add(Frame(i));
  }
  for (const auto& entry : fs::directory_iterator(folder_)) fs::resize_file(entry, fs::file_size(entry) - 1);
  EXPECT_EQ(Numbers(Left(3)), (Numbered{1, 0}));
}

TEST_F(FrameMemoryTest, OtherSessionsAreRemovedAndOtherCamerasStay) {
  for (const auto& [session, camera] : {std::pair{6u, CameraId{0}}, {kSession, CameraId{1}}}) {
    FrameMemory memory(folder_, session, camera, kMost);
    memory.Open(0);
    memory.Add(Frame(0));
  }
  EXPECT_EQ(NumFiles(), 2u);
  FrameMemory memory(folder_, kSession, 0, kMost);
  memory.Open(0);
  memory.Add(Frame(0));
  EXPECT_EQ(NumFiles(), 2u) << "that of session 6 is gone";
  memory.Remove();
  EXPECT_EQ(NumFiles(), 1u) << "the other camera's stays";
}

TEST_F(FrameMemoryTest, TheFolderMayEndInASlash) {
  {
    FrameMemory memory(folder_ + "/", kSession, 0, kMost);
    memory.Open(0);
    memory.Add(Frame(0));
  }
  FrameMemory memory(folder_ + "/", kSession, 0, kMost);
  memory.Open(1);
  int frames = 0;
  memory.ForEach(1, [&](const RememberedFrame&) { ++frames; });
  EXPECT_EQ(frames, 1);
}

TEST_F(FrameMemoryTest, FramesThatAreToldAgainAfterTheSecondFileWasBegunHideNoOthers) {
  const size_t most = BytesOf(3);
  FrameMemory memory(folder_, kSession, 0, most);
  memory.Open(0);
  for (uint32_t i = 0; i < 6; ++i) memory.Add(Frame(i));
  memory.Add(Frame(1, 5));
  EXPECT_EQ(Numbers(Left(6, most)), (Numbered{5, 4, 3, 2, 1, 0}));
}

TEST_F(FrameMemoryTest, WhenNobodyNeedsItNothingIsLeft) {
  FrameMemory memory(folder_, kSession, 0, kMost);
  memory.Open(0);
  memory.Add(Frame(0));
  memory.Remove();
  EXPECT_FALSE(fs::exists(folder_));
}

TEST_F(FrameMemoryTest, AFolderThatCannotBeMadeIsNamed) {
  std::ofstream(folder_) << "a file";
  FrameMemory memory(folder_, kSession, 0, kMost);
  try {
    memory.Open(0);
    FAIL() << "it was taken";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(folder_), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("--frame-memory"), std::string::npos);
  }
}

}  // namespace
}  // namespace dmslam
