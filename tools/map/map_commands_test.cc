#include "map_commands.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <utility>

#include "dmslam/map/testing/map_scene.h"
#include "dmslam/util/check.h"
#include "landmark_text.h"

namespace dmslam {
namespace {

using testing::MapScene;

bool Has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// Maps of two runs, which do not show the same place. Both are of session 1.
class MapCommandsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_);
    Make("a.map", 41);
    Make("b.map", 42);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  void Make(const std::string& name, uint64_t seed, std::optional<uint64_t> vocabulary = {}) const {
    MapScene scene(seed);
    scene.AddCloud(30, {0, 0, 4}, {0.5, 0.5, 0.2});
    scene.MapAll(4);
    SessionStart start;
    start.session = MapScene::kSession;
    start.seed = seed;
    start.configuration_hash = 0xabc00 + seed;
    start.profile = "dm";
    start.sequence = "way of seed " + std::to_string(seed);
    start.camera = scene.map().camera();
    start.pyramid = scene.map().pyramid();
    start.vocabulary_checksum = vocabulary;
    SaveMap(Path(name), scene.map(), start);
  }
  /// Both, one beside the other.
  void Join(const std::string& name) const {
    const char* source = std::getenv("DMSLAM_SOURCE_DIR");
    MergeArguments arguments;
    arguments.a = Path("a.map");
    arguments.b = Path("b.map");
    arguments.save = Path(name);
    arguments.vocabulary = std::string(source == nullptr ? "." : source) + "/data/vocabulary.dmv";
    arguments.renumber = arguments.apart = true;
    ASSERT_EQ(MergeMaps(arguments, {}), 0);
  }
  /// What the file proves of a landmark.
  std::string ProofOf(const std::string& name, LandmarkId id) const {
    const LandmarkProofs proofs = ReadProofs({.path = Path(name), .config = "", .overrides = {}}, {}, {});
    return ProofText(proofs, proofs.histories.landmarks().at(id));
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("map_commands_" + std::to_string(getpid()));
};

TEST_F(MapCommandsTest, InAJoinedMapEachLandmarkIsOfItsOwnRun) {
  Join("c.map");
  const std::string of_a = ProofOf("c.map", LandmarkId::Make(1, 3)),
                    of_b = ProofOf("c.map", LandmarkId::Make(2, 3));
  EXPECT_TRUE(Has(of_a, "session 1, seed 41, configuration 00000000000abc29")) << of_a;
  EXPECT_TRUE(Has(of_a, "sequence way of seed 41,")) << of_a;
  EXPECT_TRUE(Has(of_b, "session 2, seed 42, configuration 00000000000abc2a")) << of_b;
  EXPECT_TRUE(Has(of_b, "sequence way of seed 42,")) << of_b;
}

TEST_F(MapCommandsTest, AMapThatWasSplitOffIsOfItsOwnRunAlone) {
  Join("c.map");
  ASSERT_EQ(SplitMaps(Path("c.map"), Path("part"), {}), 0);
  const std::string of_a = ProofOf("part1.map", LandmarkId::Make(1, 3)),
                    of_b = ProofOf("part2.map", LandmarkId::Make(2, 3));
  EXPECT_TRUE(Has(of_a, "session 1, seed 41")) << of_a;
  EXPECT_TRUE(Has(of_b, "session 2, seed 42")) << of_b;
  const RebuiltMap part = LoadMap(Path("part2.map"));
  EXPECT_EQ(part.runs.size(), 1u);
  EXPECT_EQ(part.session.seed, 42u);
  EXPECT_EQ(part.session.sequence, "way of seed 42");
}

/// What is said where it is refused.
template <typename Command>
std::string Refusal(const Command& command) {
  try {
    command();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST_F(MapCommandsTest, AFolderInAFilesPlaceIsRefused) {
  std::filesystem::create_directories(Path("adir"));
  MergeArguments merge;
  merge.save = Path("adir");
  EXPECT_EQ(Refusal([&] { MergeMaps(merge, {}); }), Path("adir") + ": is a folder; give the name of a file");
  Join("c.map");
  for (const std::string& prefix : {Path("adir"), Path("adir/")}) {
    ASSERT_EQ(SplitMaps(Path("c.map"), prefix, {}), 0);
    EXPECT_TRUE(std::filesystem::is_regular_file(prefix + "2.map")) << "a prefix may be a folder's name";
  }
}

TEST_F(MapCommandsTest, MapsOfTwoVocabulariesCanNeverBeJoined) {
  Make("a.map", 41, 0xabc);
  Make("b.map", 42, 0xdef);
  MergeArguments merge;
  merge.a = Path("a.map");
  merge.b = Path("b.map");
  merge.save = Path("c.map");
  merge.renumber = true;
  EXPECT_THROW(MergeMaps(merge, {}), MisfitError);
  EXPECT_EQ(Refusal([&] { MergeMaps(merge, {}); }),
            merge.a + " and " + merge.b +
                ": were made with different vocabularies (checksums 0000000000000abc and 0000000000000def), "
                "and can never be joined: make one of them anew, with the vocabulary of the other");
  EXPECT_FALSE(std::filesystem::exists(merge.save));
}

/// What `diff` says of two files, and its exit code.
std::pair<int, std::string> Diff(const std::string& a, const std::string& b) {
  ::testing::internal::CaptureStdout();
  const int code = DiffMaps(a, b, {});
  return {code, ::testing::internal::GetCapturedStdout()};
}

TEST_F(MapCommandsTest, OtherRunsOfOneSessionHaveNothingInCommon) {
  const auto [code, said] = Diff(Path("a.map"), Path("b.map"));
  EXPECT_EQ(code, 1);
  EXPECT_TRUE(Has(said,
                  "session 1 is another run in each: seed 41, configuration 00000000000abc29, sequence "
                  "way of seed 41 in A; seed 42, "))
      << said;
  EXPECT_TRUE(Has(said, "A and B have nothing in common")) << said;
  EXPECT_TRUE(Has(said, "30 only in A        30 only in B         0 in both")) << said;
  EXPECT_FALSE(Has(said, "moved")) << said;
  EXPECT_EQ(Diff(Path("a.map"), Path("a.map")), std::make_pair(0, std::string()));
}

TEST_F(MapCommandsTest, AMapIsFoundAgainInTheJoinedOne) {
  Join("c.map");
  const auto [code, said] = Diff(Path("a.map"), Path("c.map"));
  EXPECT_EQ(code, 1);
  EXPECT_TRUE(Has(said, " 0 only in A        30 only in B        30 in both, 0 of them with another history"))
      << said;
  EXPECT_TRUE(Has(said, "map 1 of A is in map 1 of B")) << said;
  EXPECT_FALSE(Has(said, "nothing in common")) << said;
}

TEST_F(MapCommandsTest, AJoinedMapIsOfNoRunAsAWhole) {
  Join("c.map");
  const RebuiltMap joined = LoadMap(Path("c.map"));
  EXPECT_EQ(joined.session.session, 2u) << "who begins in it takes a later one";
  EXPECT_EQ(joined.session.seed, 0u);
  EXPECT_EQ(joined.session.configuration_hash, 0u);
  EXPECT_EQ(joined.session.sequence, "way of seed 41 + way of seed 42");
  EXPECT_EQ(joined.runs.size(), 2u);
}

}  // namespace
}  // namespace dmslam
