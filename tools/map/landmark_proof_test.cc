#include "landmark_proof.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "dmslam/map/renumbering.h"
#include "dmslam/map/testing/map_scene.h"
#include "dmslam/util/check.h"
#include "landmark_text.h"

namespace dmslam {
namespace {

using testing::MapScene;

bool Has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(LandmarkName, IsOrdinalAndNumberOrBothAsOne) {
  EXPECT_EQ(ParseLandmarkId("1:217"), LandmarkId::Make(1, 217));
  EXPECT_EQ(ParseLandmarkId("281474976710873"), LandmarkId::Make(1, 217));
  EXPECT_EQ(ParseLandmarkId("65535:1"), LandmarkId::Make(65535, 1));
  EXPECT_EQ(NameOf(LandmarkId::Make(3, 4)), "3:4");
  for (const char* none : {"", "0", "0:0", "1:", ":1", "a", "1:2:3", "-1", "1:-2", "1.5", "65536:1", " 1:2",
                           "1:281474976710656", "99999999999999999999"})
    EXPECT_FALSE(ParseLandmarkId(none)) << none;
}

TEST(RecordName, IsThatOfTheMessageType) {
  EXPECT_EQ(NameOf(MapEvent::kKeyframeInserted), "KEYFRAME_INSERTED");
  EXPECT_EQ(NameOf(MapEvent::kSnapshot), "SNAPSHOT");
  EXPECT_EQ(NameOf(MapEvent::kTurn), "TURN");
  EXPECT_EQ(NameOf(LandmarkFate::kFused), "fused");
  EXPECT_EQ(NameOf(LandmarkFate::kLeftOut), "left out");
}

/// A map of four keyframes, of which landmark 1 went and landmark 2 became landmark 3, saved by a run.
class OfASavedMap : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() / ("landmark_proof_" + std::to_string(getpid()) + ".map");
    MapScene scene;
    scene.AddCloud(6, {0, 0, 4}, {0.5, 0.5, 0.2});
    scene.MapAll(4);
    MapEditor& map = scene.map();
    map.RemoveLandmark(map.At(MapScene::IdOf(0)));
    map.Fuse(map.At(MapScene::IdOf(1)), map.At(MapScene::IdOf(2)), {20, 18, 0, -4.0F, {}});
    SessionStart start;
    start.session = MapScene::kSession;
    start.seed = 42;
    start.configuration_hash = 0xabcdef;
    start.profile = "dm";
    start.camera = map.camera();
    start.pyramid = map.pyramid();
    SaveMap(path_, map, start);
  }
  void TearDown() override { std::filesystem::remove(path_); }

  std::string TextOf(size_t point) const {
    const LandmarkProofs proofs = ReadProofs({.path = path_, .config = "", .overrides = {}}, {}, {});
    return ProofText(proofs, proofs.histories.landmarks().at(MapScene::IdOf(point)));
  }

  std::string path_;
};

TEST_F(OfASavedMap, TellsWhatItHoldsAndWhatOnlyALogTells) {
  const std::string text = TextOf(2);
  EXPECT_TRUE(Has(text, "landmark    1:3 (")) << text;
  EXPECT_TRUE(Has(text, "seed 42, configuration 0000000000abcdef")) << text;
  EXPECT_TRUE(Has(text, "in the map, static")) << text;
  EXPECT_TRUE(Has(text, "found in 18 of 20 frames")) << text;
  EXPECT_TRUE(Has(text, "seen by     4 keyframes")) << text;
  EXPECT_TRUE(Has(text, "1:2, before the map was saved")) << text;
  EXPECT_TRUE(Has(text, "the log of its run does")) << text;
}

TEST_F(OfASavedMap, TellsWhatBecameOfOneThatIsGone) {
  EXPECT_TRUE(Has(TextOf(1), "fused into 1:3, which is in the map")) << TextOf(1);
  EXPECT_TRUE(Has(TextOf(0), "not in the map; only the log of the run tells why")) << TextOf(0);
}

/// Of two runs, sessions 1 and 2: landmark 2:2 of the second has taken in 1:2 of the first.
class OfAMapOfTwoRuns : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() / ("landmark_runs_" + std::to_string(getpid()) + ".map");
    MapScene scene;
    scene.AddCloud(6, {0, 0, 4}, {0.5, 0.5, 0.2});
    scene.MapAll(4);
    map_.emplace(Beside(scene.map(), scene.map(), NamesBeside(scene.map(), scene.map(), true)));
    map_->SetMapId(map_->At(LandmarkId::Make(2, 2)), MapScene::kMap);
    map_->Fuse(map_->At(LandmarkId::Make(1, 2)), map_->At(LandmarkId::Make(2, 2)), {});
    for (const uint32_t session : {1, 2}) {
      SessionStart& run = runs_[session];
      run.session = session;
      run.seed = 40 + session;
      run.configuration_hash = 0xabc0 + session;
      run.profile = "dm";
      run.sequence = "way " + std::to_string(session);
      run.camera = map_->camera();
      run.pyramid = map_->pyramid();
    }
  }
  void TearDown() override { std::filesystem::remove(path_); }
  std::string TextOf(LandmarkId id) const {
    const LandmarkProofs proofs = ReadProofs({.path = path_, .config = "", .overrides = {}}, {}, {});
    return ProofText(proofs, proofs.histories.landmarks().at(id));
  }

  std::string path_;
  std::optional<MapEditor> map_;
  SessionRuns runs_;
};

TEST_F(OfAMapOfTwoRuns, EachLandmarkIsOfItsOwnRun) {
  SaveMap(path_, *map_, runs_.at(1), runs_);
  const std::string first = TextOf(LandmarkId::Make(1, 4)), second = TextOf(LandmarkId::Make(2, 4));
  EXPECT_TRUE(Has(first, "run         session 1, seed 41, configuration 000000000000abc1")) << first;
  EXPECT_TRUE(Has(first, "sequence way 1")) << first;
  EXPECT_FALSE(Has(first, "session 2")) << first;
  EXPECT_TRUE(Has(second, "run         session 2, seed 42, configuration 000000000000abc2")) << second;
  EXPECT_TRUE(Has(second, "sequence way 2")) << second;
  EXPECT_FALSE(Has(second, "seed 41")) << second;
  EXPECT_TRUE(Has(second, "follows frame 0 of session 2")) << second;
}

TEST_F(OfAMapOfTwoRuns, OneThatTookInOneOfTheOtherIsOfBoth) {
  SaveMap(path_, *map_, runs_.at(1), runs_);
  const std::string text = TextOf(LandmarkId::Make(2, 2)), gone = TextOf(LandmarkId::Make(1, 2));
  EXPECT_TRUE(Has(text, "run         session 2, seed 42")) << "it is numbered by the second: " << text;
  EXPECT_TRUE(Has(text, "frames saw it, too, of session 1, seed 41, configuration 000000000000abc1")) << text;
  EXPECT_TRUE(Has(gone, "run         session 1, seed 41")) << gone;
  EXPECT_TRUE(Has(gone, "fused into 2:2")) << gone;
}

TEST_F(OfAMapOfTwoRuns, OfARunThatIsNotToldNoneIsNamed) {
  SaveMap(path_, *map_, runs_.at(2));
  const std::string first = TextOf(LandmarkId::Make(1, 4)), second = TextOf(LandmarkId::Make(2, 4));
  EXPECT_TRUE(
      Has(first, "session 1; seed and configuration are not in this file, but in the log of that run"))
      << first;
  EXPECT_FALSE(Has(first, "seed 42")) << first;
  EXPECT_TRUE(Has(second, "session 2, seed 42")) << second;
  SaveMap(path_, *map_, runs_.at(2), {});
  EXPECT_TRUE(Has(TextOf(LandmarkId::Make(2, 4)), "session 2; seed and configuration are not in this file"))
      << "whose session the file has need not be the run of all that is in it";
}

}  // namespace
}  // namespace dmslam
