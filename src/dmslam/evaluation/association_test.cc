#include "dmslam/evaluation/association.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "dmslam/evaluation/coverage.h"
#include "dmslam/evaluation/evaluation_test_util.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

std::vector<StampedPose> AtMilliseconds(std::initializer_list<int64_t> stamps_ms) {
  std::vector<StampedPose> poses;
  for (const int64_t ms : stamps_ms) {
    poses.push_back(
        {ms * 1'000'000, Rigid3d(Eigen::Quaterniond::Identity(), {1e-3 * static_cast<double>(ms), 0, 0})});
  }
  return poses;
}

// The definition, without any search structure.
std::vector<PosePair> AssociateByDefinition(const std::vector<StampedPose>& ground_truth,
                                            const std::vector<StampedPose>& estimate, int64_t limit_ns) {
  const bool swap = estimate.size() > ground_truth.size();
  const auto& shorter = swap ? ground_truth : estimate;
  const auto& longer = swap ? estimate : ground_truth;
  std::vector<PosePair> pairs;
  for (size_t i = 0; i < shorter.size(); ++i) {
    size_t best = 0;
    for (size_t j = 1; j < longer.size(); ++j) {
      if (std::abs(longer[j].stamp_ns - shorter[i].stamp_ns) <
          std::abs(longer[best].stamp_ns - shorter[i].stamp_ns)) {
        best = j;
      }
    }
    if (std::abs(longer[best].stamp_ns - shorter[i].stamp_ns) > limit_ns) continue;
    pairs.push_back(swap ? PosePair{i, best} : PosePair{best, i});
  }
  return pairs;
}

TEST(Association, FollowsItsDefinitionOnRandomStamps) {
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    Random random(seed);
    std::vector<StampedPose> a, b;
    constexpr int64_t kUnitNs = 15'625'000;  // 1/64 s: exact as a double, so that ties are ties
    for (int64_t t = 0; t < 200; ++t) {
      if (random.Below(3) > 0) a.push_back({t * 10 * kUnitNs, {}});
      if (random.Below(4) > 1) b.push_back({(t * 10 + random.Below(8)) * kUnitNs, {}});
    }
    const auto found = AssociateByTime(a, b, 10 * kUnitNs);
    const auto wanted = AssociateByDefinition(a, b, 10 * kUnitNs);
    ASSERT_EQ(found.size(), wanted.size());
    for (size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].ground_truth, wanted[i].ground_truth);
      EXPECT_EQ(found[i].estimate, wanted[i].estimate);
    }
  }
}

TEST(Association, LimitIsIncludedAndTheEarlierOfTwoEquallyNearIsTaken) {
  const auto ground_truth = AtMilliseconds({0, 40, 100, 200});
  const auto estimate = AtMilliseconds({20, 119, 221});
  const auto pairs = AssociateByTime(ground_truth, estimate, 20'000'000);
  ASSERT_EQ(pairs.size(), 2u);
  EXPECT_EQ(pairs[0].ground_truth, 0u);
  EXPECT_EQ(pairs[1].ground_truth, 2u);
}

TEST(Association, NamesWhyThereIsNone) {
  const auto path = CurvedPath(20);
  const auto later = AtMilliseconds({100'000, 100'033, 100'066});
  EXPECT_NE(AssociateForEvaluation(path, later, 1000).reason.find("no overlap in time"), std::string::npos);
  const std::vector<StampedPose> two(path.begin(), path.begin() + 2);
  EXPECT_NE(AssociateForEvaluation(path, two, 1000).reason.find("fewer than three pairs: 2"),
            std::string::npos);
  auto unsorted = path;
  std::swap(unsorted[4], unsorted[5]);
  EXPECT_NE(AssociateForEvaluation(path, unsorted, 1000).reason.find("estimate: pose 6"), std::string::npos);
  auto repeated = path;
  repeated[7].stamp_ns = repeated[6].stamp_ns;
  EXPECT_NE(AssociateForEvaluation(repeated, path, 1000).reason.find("ground truth: pose 8"),
            std::string::npos);
  auto infinite = path;
  infinite[3].T_world_cam.translation.x() = std::numeric_limits<double>::infinity();
  EXPECT_NE(AssociateForEvaluation(path, infinite, 1000).reason.find("not finite"), std::string::npos);
  EXPECT_NE(AssociateForEvaluation(path, {}, 1000).reason.find("no pose"), std::string::npos);
  EXPECT_TRUE(AssociateForEvaluation(path, path, 1000).reason.empty());
}

TEST(Coverage, CountsListedFramesOnly) {
  const std::vector<int64_t> frames_ns = {0, 33'333'333, 66'666'667, 100'000'000};
  const std::vector<StampedPose> poses = {{33'333'000, {}}, {50'000'000, {}}, {100'000'000, {}}};
  const Coverage coverage = ComputeCoverage(poses, frames_ns);
  EXPECT_EQ(coverage.poses_of_no_frame, 1u);
  EXPECT_DOUBLE_EQ(*coverage.percent, 50.0);
  EXPECT_NEAR(*coverage.time_to_first_pose_s, 0.033333333, 1e-9);
  EXPECT_DOUBLE_EQ(*ComputeCoverage(poses, 6).percent, 50.0);
  EXPECT_FALSE(ComputeCoverage(poses, size_t{0}).percent);
}

TEST(Coverage, IsOfFramesHoweverManyPosesTheyHave) {
  const std::vector<int64_t> frames_ns = {0, 33'333'333, 66'666'667, 100'000'000};
  const std::vector<StampedPose> poses = {
      {-5'000'000, {}}, {66'600'000, {}}, {66'666'667, {}}, {66'700'000, {}}};
  const Coverage coverage = ComputeCoverage(poses, frames_ns);
  EXPECT_EQ(coverage.poses_of_no_frame, 1u);
  EXPECT_DOUBLE_EQ(*coverage.percent, 25.0);
  EXPECT_NEAR(*coverage.time_to_first_pose_s, 0.066666667, 1e-9);
  const std::vector<StampedPose> elsewhere = {{700'000'000, {}}};
  EXPECT_DOUBLE_EQ(*ComputeCoverage(elsewhere, frames_ns).percent, 0.0);
  EXPECT_FALSE(ComputeCoverage(elsewhere, frames_ns).time_to_first_pose_s);
}

class FrameList : public ::testing::Test {
 protected:
  std::string Write(const std::string& text) {
    const auto path = std::filesystem::temp_directory_path() /
                      (std::string("dmslam_frames_") +
                       ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".txt");
    std::ofstream(path) << text;
    return path.string();
  }
  static std::string Error(const std::string& path) {
    try {
      ReadFrameStamps(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }
};

TEST_F(FrameList, IsRead) {
  EXPECT_EQ(ReadFrameStamps(Write("# color images\n1.5 rgb/a.png\n1.533333 rgb/b.png\n")),
            (std::vector<int64_t>{1'500'000'000, 1'533'333'000}));
}

TEST_F(FrameList, BadLinesAreNamed) {
  EXPECT_NE(Error(Write("1.5 rgb/a.png\n1.6\n")).find(":2"), std::string::npos);
  EXPECT_NE(Error(Write("1.5 a\nx b\n")).find("'x'"), std::string::npos);
  EXPECT_NE(Error(Write("1.5 a\n1.5 b\n")).find("not later"), std::string::npos);
  EXPECT_NE(Error(Write("# nothing\n")).find("lists no frame"), std::string::npos);
}

}  // namespace
}  // namespace dmslam
