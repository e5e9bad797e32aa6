#include "mapper/saved_map.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "dmslam/map/testing/random_editor.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr uint32_t kSession = 1;  // that of the editor's keyframes

class SavedMapTest : public testing::Test {
 protected:
  SavedMapTest() {
    editor_.Steps(200);
    made_.session = kSession;
    made_.camera = TestCamera();
    made_.vocabulary_checksum = 0xabc;
    made_.seed = 5;
    made_.configuration_hash = 0xdef;
    SaveMap(path_, editor_.map(), made_);
  }
  void TearDown() override { std::filesystem::remove(path_); }
  SavedMap Load() const { return {path_, nullptr}; }
  /// Why it cannot be continued so; empty: it can.
  std::string Problem(const Camera& camera, const Pyramid& pyramid, uint32_t session) const {
    try {
      Load().Begin(camera, pyramid, session);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  const std::string path_ =
      std::filesystem::temp_directory_path() / ("saved_map_test_" + std::to_string(getpid()) + ".map");
  RandomEditor editor_{3};
  SessionStart made_;
};

TEST_F(SavedMapTest, IsHandedOutWithAnOrdinalThatNobodyHasUsed) {
  SavedMap saved = Load();
  const SavedMap::Beginning beginning = saved.Begin(TestCamera(), Pyramid(), kSession + 1);
  ExpectSameMaps(editor_.map(), beginning.map);
  EXPECT_EQ(beginning.ordinal, NewestOrdinal(editor_.map()) + 1);
}

TEST_F(SavedMapTest, IsNotContinuedInASessionWhoseIdsItHolds) {
  EXPECT_NE(Problem(TestCamera(), Pyramid(), kSession).find("holds keyframes of session 1;"),
            std::string::npos);
  EXPECT_EQ(Problem(TestCamera(), Pyramid(), kSession + 1), "");
}

TEST_F(SavedMapTest, IsNotContinuedWithWhatItWasNotMadeWith) {
  Camera camera = TestCamera();
  camera.fx_px *= 2;
  EXPECT_EQ(
      Problem(camera, Pyramid(), kSession + 1),
      path_ + ": was made with fx 500, the camera that plays has fx 1000: give the camera file of that map");
  Pyramid pyramid;
  ++pyramid.levels;
  EXPECT_NE(Problem(TestCamera(), pyramid, kSession + 1).find("features.levels"), std::string::npos);
}

TEST_F(SavedMapTest, GoesWithItsVocabularyEvenAfterItWasHandedOut) {
  SavedMap saved = Load();
  saved.Begin(TestCamera(), Pyramid(), kSession + 1);
  EXPECT_EQ(saved.WhyMisfits(0xabc), "");
  EXPECT_EQ(saved.WhyMisfits(std::nullopt), "");
  EXPECT_NE(saved.WhyMisfits(0xdef).find(path_ + ": was made with another vocabulary"), std::string::npos);
}

TEST_F(SavedMapTest, TellsOfWhichRunsItIsMadeEvenAfterItWasHandedOut) {
  SavedMap saved = Load();
  saved.Begin(TestCamera(), Pyramid(), kSession + 1);
  ASSERT_EQ(saved.runs().size(), 1u);
  EXPECT_EQ(saved.runs().at(kSession).seed, 5u);
}

TEST_F(SavedMapTest, AFileThatIsNotThereIsNamed) {
  EXPECT_THROW(SavedMap("/nowhere/at/all.map", nullptr), InputError);
}

}  // namespace
}  // namespace dmslam
