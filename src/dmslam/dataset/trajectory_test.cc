#include "dmslam/dataset/trajectory.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

class TrajectoryTest : public testing::Test {
 protected:
  std::string Write(const std::string& text) {
    const std::string path =
        testing::TempDir() + testing::UnitTest::GetInstance()->current_test_info()->name() + ".txt";
    std::ofstream(path) << text;
    return path;
  }
  /// The error that reading `text` gives; empty when there is none.
  std::string ErrorOf(const std::string& text) {
    try {
      ReadTrajectory(Write(text));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(TrajectoryTest, ReadsStampsExactlyAndNormalisesQuaternions) {
  const auto poses =
      ReadTrajectory(Write("# c\n\n1305031102.175304 1 2 3 0 0 0 2\r\n1305031102.2,4,5,6,0,0,1,0\n"));
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[0].stamp_ns, 1305031102175304000);
  EXPECT_EQ(poses[1].stamp_ns, 1305031102200000000);
  EXPECT_DOUBLE_EQ(poses[0].T_world_cam.rotation.w(), 1.0);
  EXPECT_EQ(poses[1].T_world_cam.translation, Eigen::Vector3d(4, 5, 6));
}

TEST_F(TrajectoryTest, RoundTripIsByteIdentical) {
  std::vector<StampedPose> poses;
  Random random(7);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d t(random.Gaussian(), random.Gaussian(), random.Gaussian());
    poses.push_back({i * 33'333'000LL, Rigid3d(ExpSo3(2.0 * t), 10.0 * t)});
  }
  const std::string first = testing::TempDir() + "first.txt", second = testing::TempDir() + "second.txt";
  WriteTrajectory(first, poses);
  const auto read = ReadTrajectory(first);
  ASSERT_EQ(read.size(), poses.size());
  for (size_t i = 0; i < read.size(); ++i) {
    EXPECT_LT((read[i].T_world_cam.translation - poses[i].T_world_cam.translation).norm(), 2e-9);
    EXPECT_LT(AngleBetween(read[i].T_world_cam.rotation, poses[i].T_world_cam.rotation), 1e-8);
  }
  WriteTrajectory(second, read);
  std::stringstream a, b;
  a << std::ifstream(first).rdbuf();
  b << std::ifstream(second).rdbuf();
  EXPECT_EQ(a.str(), b.str());
}

TEST_F(TrajectoryTest, BadInputNamesFileLineAndReason) {
  const std::string good = "1 0 0 0 0 0 0 1\n";
  EXPECT_NE(ErrorOf(good + "2 0 0 0 0 0 1\n").find(".txt:2: has 7 columns"), std::string::npos);
  EXPECT_NE(ErrorOf(good + "2 0 0 0 0 0 0 1 9\n").find(":2: has 9 columns"), std::string::npos);
  EXPECT_NE(ErrorOf(good + "# x\n1 0 0 0 0 0 0 1\n").find(":3: stamp 1.000000 repeats"), std::string::npos);
  EXPECT_NE(ErrorOf(good + "0.5 0 0 0 0 0 0 1\n").find(":2: stamp 0.500000 is earlier"), std::string::npos);
  EXPECT_NE(ErrorOf("nan 0 0 0 0 0 0 1\n").find(":1: 'nan' is not a stamp"), std::string::npos);
  EXPECT_NE(ErrorOf("1 0 inf 0 0 0 0 1\n").find(":1: 'inf' is not a finite number"), std::string::npos);
  EXPECT_NE(ErrorOf("1 0 0 1e999 0 0 0 1\n").find("is not a finite number"), std::string::npos);
  EXPECT_NE(ErrorOf("1 0 0 0x 0 0 0 1\n").find("'0x' is not a finite number"), std::string::npos);
  EXPECT_NE(ErrorOf("1 0 0 0 0 0 0 0\n").find(":1: the quaternion is zero"), std::string::npos);
  EXPECT_NE(ErrorOf("# nothing\n").find("holds no pose"), std::string::npos);
  EXPECT_THROW(ReadTrajectory("/nonexistent/trajectory.txt"), InputError);
  EXPECT_THROW(ReadTrajectory(testing::TempDir()), InputError);
  EXPECT_THROW(WriteTrajectory("/nonexistent/trajectory.txt", {}), InputError);
}

TEST_F(TrajectoryTest, AGroundTruthMayRepeatOneStampInAThousand) {
  const auto text = [](int poses) {
    std::string lines = "1.0 1 0 0 0 0 0 1\n1.0 9 9 9 0 0 0 1\n";
    for (int i = 1; i < poses; ++i) lines += std::to_string(1 + i) + ".0 1 0 0 0 0 0 1\n";
    return lines;
  };
  const GroundTruth truth = ReadGroundTruth(Write(text(1000)));
  ASSERT_EQ(truth.poses.size(), 1000u);
  EXPECT_EQ(truth.poses[0].T_world_cam.translation.x(), 1);
  ASSERT_EQ(truth.repeated.size(), 1u);
  EXPECT_TRUE(truth.repeated[0].ends_with(":2"));
  EXPECT_THROW(ReadGroundTruth(Write(text(999))), InputError);
  EXPECT_THROW(ReadTrajectory(Write(text(1000))), InputError);
}

}  // namespace
}  // namespace dmslam
