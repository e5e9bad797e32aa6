#include "dmslam/place_recognition/keyframe_database.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "dmslam/place_recognition/places_test_util.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

using places_test::SmallVocabulary;
using places_test::SyntheticWorld;

KeyframeId Id(uint32_t index) { return KeyframeId::Make(1, index); }

/// A walk through a synthetic world: place i shows kinds 10 i .. 10 i + 79, so that neighbours overlap.
class KeyframeDatabaseTest : public testing::Test {
 protected:
  static constexpr uint32_t kPlaces = 40;

  BowVector View(uint32_t place, int disturbance = 8) {
    return vocabulary_.Transform(world_.Image(10 * place, 80, disturbance)).words;
  }
  void Fill(KeyframeDatabase& database) {
    for (uint32_t place = 0; place < kPlaces; ++place) database.Add(Id(place + 1), View(place));
  }
  static std::vector<KeyframeId> Neighbours(KeyframeId id) {
    std::vector<KeyframeId> result;
    for (const int offset : {-1, 1, -2, 2}) {
      const int index = static_cast<int>(id.frame_index()) + offset;
      if (index > 0) result.push_back(Id(static_cast<uint32_t>(index)));
    }
    return result;
  }

  Vocabulary vocabulary_ = SmallVocabulary();
  SyntheticWorld world_{400, 7};
};

TEST_F(KeyframeDatabaseTest, FindsThePlaceOfAView) {
  KeyframeDatabase database;
  Fill(database);
  EXPECT_EQ(database.size(), kPlaces);
  for (uint32_t place = 3; place + 3 < kPlaces; place += 4) {
    const auto found = database.Query(View(place));
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found.front().keyframe, Id(place + 1));
    EXPECT_EQ(found.front().group_score, found.front().score);
  }
}

TEST_F(KeyframeDatabaseTest, ExcludedKeyframesAreNotFoundAndDoNotRaiseTheBar) {
  KeyframeDatabase database;
  Fill(database);
  const BowVector view = View(20);
  database.Add(Id(1000), view);  // the query itself
  PlaceQuery query;
  query.excluded = [](KeyframeId id) { return id == Id(1000); };
  const auto found = database.Query(view, query);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.front().keyframe, Id(21));
}

TEST_F(KeyframeDatabaseTest, GroupsSumScoresAndKeepTheirBestKeyframeOnce) {
  KeyframeDatabaseOptions options;
  options.min_common_share = 0.1;
  KeyframeDatabase database(options);
  Fill(database);
  const BowVector view = View(20);
  PlaceQuery query;
  query.neighbours = Neighbours;
  const auto found = database.Query(view, query);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.front().keyframe, Id(21));
  double sum = L1Score(view, *database.Find(Id(21)));
  for (const KeyframeId neighbour : Neighbours(Id(21))) sum += L1Score(view, *database.Find(neighbour));
  EXPECT_NEAR(found.front().group_score, sum, 1e-12);
  for (size_t i = 1; i < found.size(); ++i) {
    EXPECT_GE(found[i - 1].group_score, found[i].group_score);
    EXPECT_GE(found[i].group_score, options.min_group_share * found.front().group_score);
    EXPECT_NE(found[i].keyframe, found.front().keyframe);
  }
}

TEST_F(KeyframeDatabaseTest, MinScoreBarsTheWeak) {
  KeyframeDatabase database;
  Fill(database);
  const BowVector view = View(20);
  const double best = database.Query(view).front().score;
  PlaceQuery query;
  query.min_score = best + 1e-9;
  EXPECT_TRUE(database.Query(view, query).empty());
  query.min_score = best;
  EXPECT_EQ(database.Query(view, query).size(), 1U);
}

TEST_F(KeyframeDatabaseTest, RemovedKeyframesAreGone) {
  KeyframeDatabase database;
  Fill(database);
  EXPECT_TRUE(database.Remove(Id(21)));
  EXPECT_FALSE(database.Remove(Id(21)));
  EXPECT_FALSE(database.Contains(Id(21)));
  EXPECT_EQ(database.Find(Id(21)), nullptr);
  EXPECT_EQ(database.size(), kPlaces - 1);
  for (const auto& candidate : database.Query(View(20))) EXPECT_NE(candidate.keyframe, Id(21));
  database.Clear();
  EXPECT_EQ(database.size(), 0U);
  EXPECT_TRUE(database.Query(View(20)).empty());
}

TEST_F(KeyframeDatabaseTest, ResultsDependOnContentsNotOnHistory) {
  std::vector<BowVector> views;
  for (uint32_t place = 0; place < kPlaces; ++place) views.push_back(View(place));
  KeyframeDatabaseOptions options;
  options.min_common_share = 0;
  options.max_scored = 12;
  options.max_postings = 3000;
  KeyframeDatabase forward(options);
  KeyframeDatabase shuffled(options, vocabulary_.num_words());
  for (uint32_t i = 0; i < kPlaces; ++i) forward.Add(Id(i + 1), views[i]);
  for (uint32_t i = kPlaces; i-- > 0;) shuffled.Add(Id(i + 1), views[(i + 7) % kPlaces]);
  for (uint32_t i = 0; i < kPlaces; i += 3) shuffled.Remove(Id(i + 1));
  for (uint32_t i = 0; i < kPlaces; ++i) shuffled.Add(Id(i + 1), views[i]);  // replaces or adds
  PlaceQuery query;
  query.neighbours = Neighbours;
  for (uint32_t place = 0; place < kPlaces; ++place) {
    EXPECT_EQ(forward.Query(views[place], query), shuffled.Query(views[place], query));
  }
}

TEST_F(KeyframeDatabaseTest, BoundOnReadingLeavesOutTheCommonWordsFirst) {
  // Word 0 is everywhere, words 1.. belong to one keyframe each. Too little budget for word 0: nobody else is
  // scored.
  KeyframeDatabaseOptions options;
  options.max_postings = 50;
  options.min_common_share = 0;
  KeyframeDatabase database(options);
  for (uint32_t i = 1; i <= 100; ++i) database.Add(Id(i), {{0, 0.5F}, {i, 0.5F}});
  const auto found = database.Query({{0, 0.5F}, {42, 0.5F}});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found.front().keyframe, Id(42));
  EXPECT_EQ(found.front().common_words, 1);
  EXPECT_DOUBLE_EQ(found.front().score, 1.0);  // scored over all words
}

TEST_F(KeyframeDatabaseTest, UnknownWordsAndEmptyImagesFindNothing) {
  KeyframeDatabase database;
  EXPECT_TRUE(database.Query({{5, 1.0F}}).empty());
  Fill(database);
  EXPECT_TRUE(database.Query({}).empty());
  EXPECT_TRUE(database.Query({{4000000, 1.0F}}).empty());
  database.Add(Id(500), {});
  EXPECT_TRUE(database.Contains(Id(500)));
  EXPECT_THROW(database.Add(KeyframeId{}, {}), InvariantError);
}

TEST(KeyframeDatabaseOptions, AreChecked) {
  KeyframeDatabaseOptions options;
  options.min_common_share = 1.5;
  EXPECT_THROW(KeyframeDatabase{options}, InputError);
  options = {};
  options.max_scored = 0;
  EXPECT_THROW(KeyframeDatabase{options}, InputError);
}

}  // namespace
}  // namespace dmslam
