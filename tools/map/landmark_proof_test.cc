#include "landmark_proof.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

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

}  // namespace
}  // namespace dmslam
