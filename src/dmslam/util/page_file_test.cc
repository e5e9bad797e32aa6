#include "dmslam/util/page_file.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "dmslam/util/testing/small_disk.h"

namespace dmslam {
namespace {

constexpr size_t kMegabyte = size_t{1} << 20;

/// Of this process, in pages of files.
size_t ResidentFilePages() {
  std::ifstream statm("/proc/self/statm");
  size_t size = 0, resident = 0, shared = 0;
  statm >> size >> resident >> shared;
  return shared;
}

void Fill(std::byte* data, size_t bytes, int seed) {
  for (size_t i = 0; i < bytes; ++i)
    data[i] = static_cast<std::byte>((i * 31 + static_cast<size_t>(seed)) % 251);
}

bool Holds(const std::byte* data, size_t bytes, int seed) {
  std::vector<std::byte> expected(bytes);
  Fill(expected.data(), bytes, seed);
  return std::memcmp(expected.data(), data, bytes) == 0;
}

TEST(PageFile, WhatWasLetGoIsReadAgain) {
  PageFile file(testing::TempDir());
  std::vector<std::shared_ptr<std::byte>> pieces;
  for (int i = 0; i < 40; ++i) {
    pieces.push_back(file.Take(kMegabyte + 100));
    ASSERT_NE(pieces.back(), nullptr) << file.problem();
    Fill(pieces.back().get(), kMegabyte + 100, i);
  }
  const size_t before = ResidentFilePages();
  file.LetGo();
  const size_t after = ResidentFilePages();
  EXPECT_GT(before - after, 39 * kMegabyte / static_cast<size_t>(sysconf(_SC_PAGESIZE)));
  for (int i = 0; i < 40; ++i)
    EXPECT_TRUE(Holds(pieces[static_cast<size_t>(i)].get(), kMegabyte + 100, i)) << i;
}

TEST(PageFile, LeavesNothingInTheFolder) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "pages_leave_nothing";
  std::filesystem::create_directory(folder);
  {
    PageFile file(folder);
    EXPECT_NE(file.Take(10), nullptr);
    EXPECT_TRUE(std::filesystem::is_empty(folder));
  }
  EXPECT_TRUE(std::filesystem::remove(folder));
}

TEST(PageFile, PiecesOutliveIt) {
  auto file = std::make_unique<PageFile>(testing::TempDir());
  const std::shared_ptr<std::byte> piece = file->Take(5000);
  ASSERT_NE(piece, nullptr) << file->problem();
  Fill(piece.get(), 5000, 1);
  file.reset();
  EXPECT_TRUE(Holds(piece.get(), 5000, 1));
}

TEST(PageFile, AFullDiskIsToldAndHarmsNothing) {
  PageFile file(testing::TempDir());
  const std::shared_ptr<std::byte> before = file.Take(kMegabyte);
  ASSERT_NE(before, nullptr) << file.problem();
  Fill(before.get(), kMegabyte, 2);
  {
    const SmallDisk full(4096);
    EXPECT_EQ(file.Take(64 * kMegabyte), nullptr);
    EXPECT_NE(file.problem().find(testing::TempDir()), std::string::npos) << file.problem();
  }
  file.LetGo();
  EXPECT_TRUE(Holds(before.get(), kMegabyte, 2));
  EXPECT_NE(file.Take(64 * kMegabyte), nullptr) << "the disk has room again";
  EXPECT_EQ(file.problem(), "");
}

TEST(PageFile, AFolderThatIsNotThereIsNamed) {
  PageFile file("/no/such/folder");
  EXPECT_EQ(file.Take(1), nullptr);
  EXPECT_EQ(file.problem(), "/no/such/folder: No such file or directory");
  EXPECT_FALSE(file.used());
}

TEST(PageFile, WhatIsDroppedIsNoMoreOnTheDisk) {
  PageFile file(testing::TempDir());
  const std::shared_ptr<std::byte> other = file.Take(kMegabyte);
  std::shared_ptr<std::byte> piece = file.Take(kMegabyte);
  ASSERT_NE(piece, nullptr) << file.problem();
  Fill(piece.get(), kMegabyte, 3);
  const std::byte* at = piece.get();
  piece.reset();  // the other keeps the mapping
  EXPECT_TRUE(std::all_of(at, at + kMegabyte, [](std::byte b) { return b == std::byte{0}; }));
}

}  // namespace
}  // namespace dmslam
