#include "mapper/left_map.h"

#include <gtest/gtest.h>

#include <deque>
#include <utility>
#include <vector>

#include "dmslam/map/snapshot.h"
#include "dmslam/map/testing/random_editor.h"
#include "dmslam/wire/channels.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

constexpr int64_t kSession = 7;
constexpr int64_t kStepNs = 2'000'000;
constexpr size_t kOneByOne = 1;  // bytes of a piece: each thing is a piece of its own

/// The pieces of the next snapshots, in turn; those of the last one as often as it is asked for.
class PreparedPieces : public SnapshotSource {
 public:
  std::deque<std::vector<MapDelta>> snapshots;
  void BeginSnapshot(int64_t) override {
    ++begun;
    left_.assign(snapshots.front().begin(), snapshots.front().end());
    if (snapshots.size() > 1) snapshots.pop_front();
  }
  Piece NextPiece() override {
    const MapDelta next = std::move(left_.front());
    left_.pop_front();
    return {channels::kMap, wire::Encode(next), left_.empty()};
  }
  int begun = 0;

 private:
  std::deque<MapDelta> left_;
};

/// A keyframe without features, which sees nothing.
KeyframeState StateNamed(uint32_t frame, MapId map_id) {
  KeyframeState state;
  state.id = KeyframeId::Make(kSession, frame);
  state.map_id = map_id;
  state.features = std::make_shared<const FeatureSet>();
  return state;
}

/// A change by which three keyframes come, as a group of records with one of them each.
std::vector<MapDelta> GroupOfThree() {
  MapDelta change;
  for (const uint32_t frame : {1, 2, 3}) change.keyframes.push_back(StateNamed(frame, 1));
  return wire::Split(change, 1);
}

/// A mapper that fetches the map that a frontend holds.
class LeftMapTest : public testing::Test {
 protected:
  LeftMapTest()
      : server_(
            ServerOptions(), [this] { return held_; }, &pieces_),
        holder_(&bus_.AddPort(), [this] { return now_ns_; }),
        owner_(&bus_.AddPort(), [this] { return now_ns_; }) {
    holder_.AddServer(&server_, owners::kMapper);
    Open();
  }
  static ReplicaServer::Options ServerOptions() {
    ReplicaServer::Options options;
    options.holder.session = kSession;
    options.holder.holder = owners::kFrontend;
    options.holder.role = roles::kFrontend;
    options.holder.id = 5;
    return options;
  }
  void Open(std::shared_ptr<FeatureStore> store = nullptr) {
    left_.reset();
    LeftMap::Options options;
    options.fetch.session = kSession;
    options.fetch.id = 21;
    options.fetch.holders = {{roles::kFrontend, owners::kFrontend}};
    options.camera = TestCamera();
    options.feature_store = std::move(store);
    left_ = std::make_unique<LeftMap>(options, &owner_, now_ns_);
  }

  std::optional<MapDelta> Read(const Record& record) {
    if (++read_ == unreadable_) return std::nullopt;
    return wire::Decode<MapDelta>(*record.bytes);
  }
  void Deliver() {
    owner_.Advance();
    holder_.Advance();
    while (bus_.DeliverOne()) {
    }
  }
  LeftMap::State Step() {
    now_ns_ += kStepNs;
    if (grows_ && now_ns_ % 50'000'000 == 0) ++held_.seq;
    Deliver();
    return left_->Advance(
        now_ns_, [this](const Record& record) { return Read(record); },
        [this](const Record&, const std::string& why) { complaints_.push_back(why); });
  }
  /// Until it is told, or for so long.
  LeftMap::State Fetch(double seconds = 30) {
    const int64_t end_ns = now_ns_ + static_cast<int64_t>(seconds * 1e9);
    LeftMap::State state = LeftMap::State::kFetching;
    while (state == LeftMap::State::kFetching && now_ns_ < end_ns) state = Step();
    return state;
  }
  size_t num_keyframes() const { return left_->replica().keyframes().size(); }

  MemoryBus bus_;
  int64_t now_ns_ = 0;
  PreparedPieces pieces_;
  Version held_{3, 100};
  bool grows_ = false;
  ReplicaServer server_;
  Endpoint holder_, owner_;
  std::unique_ptr<LeftMap> left_;
  int read_ = 0, unreadable_ = 0;
  std::vector<std::string> complaints_;
};

TEST_F(LeftMapTest, TheMapIsThatOfTheHolder) {
  RandomEditor editor(3);
  editor.Steps(600);
  pieces_.snapshots = {CutSnapshot(editor.map(), std::nullopt, kOneByOne)};
  ASSERT_EQ(Fetch(), LeftMap::State::kWhole);
  EXPECT_EQ(left_->version(), held_);
  ExpectSameMaps(editor.map(), left_->replica());
  EXPECT_EQ(left_->TakeReplica().num_landmarks(), editor.map().num_landmarks());
  EXPECT_TRUE(complaints_.empty());
}

TEST_F(LeftMapTest, ItIsToldWhenNobodyHoldsOne) {
  held_ = {};
  EXPECT_EQ(Fetch(), LeftMap::State::kNone) << "the holder says that it has none";
  holder_.Remove(&server_);
  Open();
  EXPECT_EQ(Fetch(4), LeftMap::State::kFetching) << "a holder may still answer";
  EXPECT_EQ(Fetch(), LeftMap::State::kNone);
}

TEST_F(LeftMapTest, AMapThatGrowsForEverIsTold) {
  pieces_.snapshots = {std::vector<MapDelta>(600)};
  for (MapDelta& piece : pieces_.snapshots.front()) piece.note = std::string(200, 'x');
  grows_ = true;
  EXPECT_EQ(Fetch(60), LeftMap::State::kKeepsGrowing);
  EXPECT_GT(now_ns_, 10'000'000'000) << "for a while it may be chance";
  EXPECT_TRUE(complaints_.empty()) << "the pieces that came were sound";
}

TEST_F(LeftMapTest, AGroupOfRecordsIsOneChange) {
  pieces_.snapshots = {GroupOfThree()};
  ASSERT_EQ(pieces_.snapshots.front().size(), 3U);
  ASSERT_EQ(Fetch(), LeftMap::State::kWhole);
  EXPECT_EQ(num_keyframes(), 3U);
  EXPECT_EQ(left_->replica().version(), 0U);
  EXPECT_TRUE(complaints_.empty());
}

TEST_F(LeftMapTest, WithARecordThatCannotBeReadAllIsFetchedAgain) {
  MapDelta alone;
  alone.keyframes = {StateNamed(9, 2)};
  std::vector<MapDelta> pieces = GroupOfThree();
  pieces.insert(pieces.begin(), alone);
  pieces_.snapshots = {pieces};
  unreadable_ = 3;  // in the middle of the group
  ASSERT_EQ(Fetch(), LeftMap::State::kWhole);
  EXPECT_EQ(read_, 3 + 4) << "from the beginning";
  EXPECT_EQ(left_->version(), held_);
  EXPECT_EQ(num_keyframes(), 4U);
  EXPECT_TRUE(complaints_.empty()) << "who reads counts it, and the group that was cut off is forgotten";
}

TEST_F(LeftMapTest, WithAGroupThatIsBrokenAllIsFetchedAgain) {
  std::vector<MapDelta> broken = GroupOfThree();
  broken.erase(broken.begin() + 1);
  broken.emplace_back();  // a sound end
  pieces_.snapshots = {broken, GroupOfThree()};
  for (int i = 0; i < 1000 && complaints_.size() < 2; ++i) ASSERT_EQ(Step(), LeftMap::State::kFetching);
  ASSERT_EQ(complaints_.size(), 2U);
  EXPECT_NE(complaints_[0].find("was due"), std::string::npos) << complaints_[0];
  ++held_.seq;  // the holder has gone on, and cuts its map anew
  ASSERT_EQ(Fetch(), LeftMap::State::kWhole);
  EXPECT_EQ(left_->version(), held_);
  EXPECT_EQ(num_keyframes(), 3U);
}

TEST_F(LeftMapTest, AMapThatIsAlwaysBrokenIsTold) {
  std::vector<MapDelta> broken = GroupOfThree();
  broken.erase(broken.begin() + 1);
  broken.emplace_back();  // a sound end
  pieces_.snapshots = {broken};
  EXPECT_EQ(Fetch(60), LeftMap::State::kBroken);
  EXPECT_GT(now_ns_, 10'000'000'000) << "for a while it may be somebody's forgery";
  EXPECT_GT(complaints_.size(), 5U);
  EXPECT_EQ(left_->giver(), roles::kFrontend);
}

TEST_F(LeftMapTest, WhatCameBeforeAMapGrewIsVoid) {
  MapDelta dropped;
  dropped.keyframes = {StateNamed(9, 2)};
  std::vector<MapDelta> first(600, MapDelta());
  for (MapDelta& piece : first) piece.note = std::string(200, 'x');
  first.front() = dropped;
  pieces_.snapshots = {first, GroupOfThree()};
  for (int i = 0; i < 1000 && read_ < 10; ++i) ASSERT_EQ(Step(), LeftMap::State::kFetching);
  ASSERT_GE(read_, 10);
  ++held_.seq;
  ASSERT_EQ(Fetch(), LeftMap::State::kWhole);
  EXPECT_EQ(pieces_.begun, 2);
  EXPECT_EQ(left_->version(), held_);
  EXPECT_EQ(left_->replica().FindKeyframe(dropped.keyframes[0].id), nullptr);
  EXPECT_EQ(num_keyframes(), 3U);
}

TEST_F(LeftMapTest, FeaturesLieWhereTheMappersDo) {
  Random random(4);
  MapDelta delta;
  delta.keyframes = {StateNamed(1, 1)};
  const std::shared_ptr<const FrameFeatures> features = RandomFeatures(random, 50);
  delta.keyframes[0].features = {features, &features->set};
  pieces_.snapshots = {{delta}};
  const auto store = std::make_shared<FeatureStore>(FeatureStoreOptions{0});
  Open(store);
  ASSERT_EQ(Fetch(), LeftMap::State::kWhole);
  EXPECT_EQ(left_->replica().feature_store(), store);
  EXPECT_GT(store->bytes_in_file(), 0U) << "nothing fits the memory";
}

TEST_F(LeftMapTest, WhoHasTheMapAsksNoMore) {
  EXPECT_LT(owner_.deadline_ns(), INT64_MAX) << "it asks who holds one";
  left_.reset();
  EXPECT_EQ(owner_.deadline_ns(), INT64_MAX);
  owner_.Advance();
  EXPECT_TRUE(bus_.idle());
}

}  // namespace
}  // namespace dmslam
