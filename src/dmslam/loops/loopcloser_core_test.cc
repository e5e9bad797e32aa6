#include "dmslam/loops/loopcloser_core.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/loops/testing/indexed_room.h"
#include "dmslam/loops/testing/ring_room.h"

namespace dmslam {
namespace {

using namespace testing;  // NOLINT(google-build-using-namespace): the room and all it is made of

struct Answers {
  std::vector<LoopAnswer> loops, adjustments;
};

Answers Play(Room& room, LoopcloserCore& core, MapEvent said = MapEvent::kCorrected) {
  Answers answers;
  for (int k = 0; k < kKeyframes; ++k) {
    const MapDelta delta = room.Next();
    core.ApplyMapDelta(delta);
    LoopAnswer answer = core.Check(*delta.about);
    EXPECT_EQ(answer.keyframe, delta.about);
    EXPECT_EQ(answer.base_version, core.map().version());
    if (answer.kind != LoopAnswer::Kind::kNone) core.ApplyMapDelta(room.SayOf(answer, said));
    if (answer.kind == LoopAnswer::Kind::kLoop) answers.loops.push_back(std::move(answer));
    if (answer.kind == LoopAnswer::Kind::kGlobalAdjustment) answers.adjustments.push_back(std::move(answer));
  }
  return answers;
}

LoopcloserCore MakeCore(const LoopcloserOptions& options = {}) {
  return LoopcloserCore(options, TestCamera(525, 319.5, 239.5), Pyramid(), 1, ShippedVocabulary());
}

/// The pose of a keyframe after a correction.
Rigid3d Corrected(const Room& room, const LoopAnswer& answer, KeyframeId id) {
  for (const auto& c : answer.corrections) {
    if (c.keyframe == id) {
      return (Sim3d(room.map().FindKeyframe(id)->T_cam_world) * c.corrected_from_base.Inverse()).ToRigid();
    }
  }
  ADD_FAILURE() << "no correction for keyframe " << id.frame_index();
  return {};
}

TEST(LoopcloserCoreTest, AReturnIsFoundAndTheDriftTakenOut) {
  Room room({});
  LoopcloserCore core = MakeCore();
  const Answers answers = Play(room, core);
  ASSERT_GE(answers.loops.size(), 1u);
  const LoopAnswer& loop = answers.loops.front();
  const int here = static_cast<int>(loop.keyframe.frame_index()) - 1;
  const int there = static_cast<int>(loop.matched->frame_index()) - 1;
  EXPECT_GE(here, kPerRound - 12);
  EXPECT_LE(here, kPerRound + 12);
  EXPECT_LE(std::abs(here - kPerRound - there), 12) << here << " was matched with " << there;
  EXPECT_GE(loop.fusions.size(), 20u);
  // Where the two keyframes stand to one another, before and after, in truth's units.
  const Eigen::Vector3d truth = TruePose(here).Center() - TruePose(there).Center();
  const auto error = [&](const Rigid3d& a, const Rigid3d& b) {
    return (a.Center() - b.Center() - truth).norm();
  };
  const double before = error(room.map().FindKeyframe(loop.keyframe)->T_cam_world,
                              room.map().FindKeyframe(*loop.matched)->T_cam_world);
  const double after = error(Corrected(room, loop, loop.keyframe), Corrected(room, loop, *loop.matched));
  EXPECT_GT(before, 0.15);
  EXPECT_LT(after, before / 5);
  // The correction is spread: a keyframe in the middle moves, but less.
  const KeyframeId middle = KeyframeId::Make(1, kPerRound / 2);
  const double moved_middle =
      (Corrected(room, loop, middle).Center() - room.map().FindKeyframe(middle)->T_cam_world.Center()).norm();
  EXPECT_GT(moved_middle, 0.02);
  EXPECT_LT(moved_middle, before);
}

TEST(LoopcloserCoreTest, AReturnIsFoundWithFewLandmarksOfItsOwn) {
  Room room({.landmark_every = 25});
  LoopcloserCore core = MakeCore();
  const Answers answers = Play(room, core);
  ASSERT_GE(answers.loops.size(), 1u);
  const LoopAnswer& loop = answers.loops.front();
  const auto relative = [](const Rigid3d& a, const Rigid3d& b) { return a * b.Inverse(); };
  const Rigid3d truth = relative(TruePose(static_cast<int>(loop.keyframe.frame_index()) - 1),
                                 TruePose(static_cast<int>(loop.matched->frame_index()) - 1));
  const Rigid3d found = relative(Corrected(room, loop, loop.keyframe), Corrected(room, loop, *loop.matched));
  EXPECT_LT((found.Center() - truth.Center()).norm(), 0.05);
  EXPECT_LT(AngleBetween(found.rotation, truth.rotation), 0.02);
}

TEST(LoopcloserCoreTest, ALoopIsConfirmedWhereLocalMappingFusedAFewOfItsLandmarks) {
  Room room({.fused_every = 12});
  LoopcloserCore core = MakeCore();
  EXPECT_GE(Play(room, core).loops.size(), 1u);
}

TEST(LoopcloserCoreTest, TheKeyframeAfterALoopIsAnsweredWithAGlobalAdjustment) {
  Room room({});
  LoopcloserCore core = MakeCore();
  const Answers answers = Play(room, core);
  ASSERT_GE(answers.loops.size(), 1u);
  ASSERT_GE(answers.adjustments.size(), 1u);
  EXPECT_EQ(answers.adjustments.front().keyframe.frame_index(),
            answers.loops.front().keyframe.frame_index() + 1);
  EXPECT_FALSE(answers.adjustments.front().landmark_offsets.empty());
  EXPECT_EQ(core.counters().loops, answers.loops.size());
}

TEST(LoopcloserCoreTest, ItsStepsAreToldAndThatItWaitsForTheMapper) {
  using Step = LoopcloserCore::Step;
  Room room({});
  LoopcloserCore core = MakeCore();
  std::vector<Step> steps;
  core.SetOnStep([&](Step step) { steps.push_back(step); });
  LoopAnswer answer;
  while (answer.kind == LoopAnswer::Kind::kNone) {
    ASSERT_LT(core.counters().checked, static_cast<uint64_t>(kKeyframes));
    EXPECT_FALSE(core.AwaitsMapper());
    const MapDelta delta = room.Next();
    core.ApplyMapDelta(delta);
    steps.clear();
    answer = core.Check(*delta.about);
    ASSERT_GE(steps.size(), 2u);
    EXPECT_EQ(steps[0], Step::kNamePlaces);
    EXPECT_EQ(steps[1], Step::kVerify);
  }
  EXPECT_EQ(steps.back(), Step::kCorrect);
  EXPECT_TRUE(core.AwaitsMapper());
  core.ApplyMapDelta(room.SayOf(answer, MapEvent::kCorrected));
  EXPECT_FALSE(core.AwaitsMapper());
  const MapDelta delta = room.Next();
  core.ApplyMapDelta(delta);
  steps.clear();
  EXPECT_EQ(core.Check(*delta.about).kind, LoopAnswer::Kind::kGlobalAdjustment);
  EXPECT_EQ(steps, std::vector<Step>{Step::kCorrect});
}

TEST(LoopcloserCoreTest, ALoopThatWasRefusedIsFoundAgainAndNotAdjusted) {
  Room room({});
  LoopcloserCore core = MakeCore();
  const Answers answers = Play(room, core, MapEvent::kCorrectionRefused);
  EXPECT_GE(answers.loops.size(), 2u);
  EXPECT_TRUE(answers.adjustments.empty());
  EXPECT_EQ(core.counters().loops, 0u);
  EXPECT_EQ(core.counters().last_loop_keyframe, std::nullopt);
}

TEST(LoopcloserCoreTest, UntilTheMapperHasSpokenNothingMoreIsProposed) {
  Room room({});
  LoopcloserCore core = MakeCore();
  std::optional<LoopAnswer> loop;
  for (int k = 0; k < kKeyframes; ++k) {
    const MapDelta delta = room.Next();
    core.ApplyMapDelta(delta);
    LoopAnswer answer = core.Check(*delta.about);
    if (loop) {
      EXPECT_EQ(answer.kind, LoopAnswer::Kind::kNone);
    }
    if (!loop && answer.kind == LoopAnswer::Kind::kLoop) loop = std::move(answer);
  }
  ASSERT_TRUE(loop);
  core.ApplyMapDelta(room.SayOf(*loop, MapEvent::kCorrected));
  const MapDelta delta = room.Next();
  core.ApplyMapDelta(delta);
  EXPECT_EQ(core.Check(*delta.about).kind, LoopAnswer::Kind::kGlobalAdjustment);
}

TEST(LoopcloserCoreTest, MovingLandmarksDoNotVote) {
  Room room({.first_wall_moves = true});
  LoopcloserCore core = MakeCore();
  EXPECT_TRUE(Play(room, core).loops.empty());
}

TEST(LoopcloserCoreTest, OnePictureThatHangsInTwoPlacesIsNoLoop) {
  Room room({.second_visit_elsewhere = true, .picture_rad = 0.25});
  LoopcloserCore core = MakeCore();
  const Answers answers = Play(room, core);
  EXPECT_TRUE(answers.loops.empty());
}

/// Loops long before the camera comes back.
ptrdiff_t CountFalse(const Answers& answers) {
  return std::count_if(answers.loops.begin(), answers.loops.end(), [](const LoopAnswer& loop) {
    return static_cast<int>(loop.keyframe.frame_index()) < kPerRound - 12;
  });
}

ptrdiff_t CountFalse(const WorldOptions& world, const LoopcloserOptions& options) {
  Room room(world);
  LoopcloserCore core = MakeCore(options);
  return CountFalse(Play(room, core));
}

TEST(LoopcloserCoreTest, SomebodyWhoStoodInTwoPlacesIsNoLoop) {
  const WorldOptions world{.person_at = {20, 68}};
  ASSERT_GE(CountFalse(world, Trusting()), 1) << "the scene is no trap";
  Room room(world);
  LoopcloserCore core = MakeCore();
  const Answers answers = Play(room, core);
  EXPECT_EQ(CountFalse(answers), 0);
  EXPECT_GE(answers.loops.size(), 1u) << "the return is not found any more";
}

TEST(LoopcloserCoreTest, EachOfTheTestsAloneKnowsAPersonFromAPlace) {
  const WorldOptions world{.person_at = {20, 68}};
  LoopcloserOptions proven = Trusting(), chain = Trusting(), other_side = Trusting();
  proven.min_proven = LoopcloserOptions().min_proven;
  chain.max_drift_sigmas = LoopcloserOptions().max_drift_sigmas;
  other_side.min_told = 5;
  EXPECT_EQ(CountFalse(world, proven), 0);
  EXPECT_EQ(CountFalse(world, chain), 0);
  EXPECT_EQ(CountFalse(world, other_side), 0);
}

TEST(LoopcloserCoreTest, ALoopIsClosedOnlyWhenLaterKeyframesSawItOverSomeTime) {
  LoopcloserOptions at_once;
  at_once.confirmation.times = 1;
  at_once.confirmation.for_s = 0;
  LoopcloserOptions patient = at_once;
  patient.confirmation.for_s = 3.0;
  const auto first_loop = [](const LoopcloserOptions& options) {
    Room room({});
    LoopcloserCore core = MakeCore(options);
    const Answers answers = Play(room, core);
    return answers.loops.empty() ? 0U : answers.loops.front().keyframe.frame_index();
  };
  const uint32_t early = first_loop(at_once), late = first_loop(patient);
  ASSERT_GT(early, 0U);
  EXPECT_GE((late - early) * static_cast<double>(kInterval_ns) * 1e-9, 2.0);
}

TEST(LoopcloserCoreTest, ALoopThatTheChainCannotHaveDriftedIsRefused) {
  Room room({});
  LoopcloserOptions options;
  options.max_drift_sigmas = 0.1;
  LoopcloserCore core = MakeCore(options);
  EXPECT_TRUE(Play(room, core).loops.empty());
}

/// Whether the answer lays the two maps onto one another as they are in truth, seen from the loop's
/// keyframes.
void ExpectWelds(const Room& room, const LoopAnswer& weld) {
  const KeyframeId end = *weld.seen_from;
  const MapId map_id = room.map().FindKeyframe(end)->map_id;
  EXPECT_NE(map_id, room.map().FindKeyframe(*weld.matched)->map_id);
  const auto whole = std::ranges::count_if(room.map().KeyframesOf(map_id), [&](const Keyframe* keyframe) {
    return keyframe->id <= weld.keyframe;
  });
  EXPECT_EQ(std::ssize(weld.corrections), whole) << "a map goes as a whole";
  const int here = static_cast<int>(end.frame_index()) - 1;
  const int there = static_cast<int>(weld.matched->frame_index()) - 1;
  const Rigid3d found =
      Corrected(room, weld, end) * room.map().FindKeyframe(*weld.matched)->T_cam_world.Inverse();
  const Rigid3d truth = TruePose(here) * TruePose(there).Inverse();
  EXPECT_LT(AngleBetween(found.rotation, truth.rotation), 0.02);
  const double unit = map_id == 2 ? Drift(there).scale : SecondWorld().scale;  // of the place's map
  EXPECT_LT((found.Center() - unit * truth.Center()).norm(), 0.1 * unit);
  const double scale = map_id == 2 ? 2.0 * unit : unit;
  EXPECT_NEAR(weld.corrections.front().corrected_from_base.scale / scale, 1.0, 0.03);
}

TEST(LoopcloserCoreTest, AMapBegunMeanwhileIsWeldedToTheOldOne) {
  Room room({.second_map_at = kPerRound - 2});
  LoopcloserCore core = MakeCore();
  const Answers answers = Play(room, core);
  ASSERT_GE(answers.loops.size(), 1u);
  const LoopAnswer& weld = answers.loops.front();
  EXPECT_LE(static_cast<int>(weld.keyframe.frame_index()), kPerRound + 6) << "within a few seconds";
  ExpectWelds(room, weld);
}

/// (The mapper of these tests leaves the maps as they are.)
TEST(LoopcloserCoreTest, AfterAWeldTheNextOneNeedNotWait) {
  Room room({.second_map_at = kPerRound - 2});
  LoopcloserCore core = MakeCore();
  const Answers answers = Play(room, core);
  ASSERT_GE(answers.loops.size(), 2u);
  const uint32_t first = answers.loops[0].keyframe.frame_index();
  EXPECT_LE(answers.loops[1].keyframe.frame_index(), first + 4);
}

/// The camera goes on to where the old map shows nothing. What that one has seen is there again in the new
/// map.
TEST(LoopcloserCoreTest, KeyframesOfAMapThatWasLeftAreAskedAgain) {
  for (const int asked_again : {0, 2}) {
    Room room({.second_map_at = 8});
    LoopcloserOptions options;
    options.asked_again = asked_again;
    LoopcloserCore core = MakeCore(options);
    std::optional<LoopAnswer> weld;
    for (int k = 0; k < kKeyframes && !weld; ++k) {
      const MapDelta delta = room.Next();
      core.ApplyMapDelta(delta);
      if (k < kPerRound + 18) continue;  // past what the old map shows
      LoopAnswer answer = core.Check(*delta.about);
      if (answer.kind == LoopAnswer::Kind::kLoop) weld = std::move(answer);
    }
    ASSERT_EQ(weld.has_value(), asked_again > 0);
    if (!weld) continue;
    EXPECT_EQ(room.map().FindKeyframe(*weld->seen_from)->map_id, 1u);
    EXPECT_EQ(room.map().FindKeyframe(*weld->matched)->map_id, 2u);
    ExpectWelds(room, *weld);
  }
}

/// What the neighbours of a keyframe see is not asked for here: others say the same of the two maps.
TEST(LoopcloserCoreTest, KeyframesThatAgreeJoinTwoMaps) {
  for (const int sightings : {2, 1000}) {
    Room room({.second_map_at = kPerRound - 2});
    LoopcloserOptions options;
    options.confirmation.for_s = 1000;
    options.joining.sightings = sightings;
    LoopcloserCore core = MakeCore(options);
    const Answers answers = Play(room, core);
    ASSERT_EQ(answers.loops.empty(), sightings == 1000);
    if (!answers.loops.empty()) ExpectWelds(room, answers.loops.front());
  }
}

/// The old map is too young to have anything proven; what the camera sees of it now is.
TEST(LoopcloserCoreTest, AMapTooYoungToProveAnythingIsWeldedByWhatIsProvenInTheOther) {
  Room room({.second_map_at = 5});
  LoopcloserCore core = MakeCore();
  const Answers answers = Play(room, core);
  ASSERT_GE(answers.loops.size(), 1u);
  ExpectWelds(room, answers.loops.front());
}

TEST(LoopcloserCoreTest, MapsAreWeldedBehindPeopleByWhatOutlastsThem) {
  Room room({.person_at = {96, 103, 110, 117}, .second_map_at = kPerRound - 6});
  LoopcloserCore core = MakeCore();
  const Answers answers = Play(room, core);
  ASSERT_GE(answers.loops.size(), 1u);
  ExpectWelds(room, answers.loops.front());
}

TEST(LoopcloserCoreTest, SomebodyWhoStoodInTwoMapsDoesNotWeldThem) {
  const WorldOptions world{.second_visit_elsewhere = true, .person_at = {20, 100}, .second_map_at = 97};
  LoopcloserOptions trusting = Trusting();
  trusting.joining.min_share = trusting.min_share;
  {
    Room room(world);
    LoopcloserCore core = MakeCore(trusting);
    ASSERT_GE(Play(room, core).loops.size(), 1u) << "the scene is no trap";
  }
  Room room(world);
  LoopcloserCore core = MakeCore();
  EXPECT_TRUE(Play(room, core).loops.empty());
}

/// As where the camera was soon lost in both: nothing outlasts people in either.
LoopcloserOptions WithNothingProven() {
  LoopcloserOptions options;
  options.proven.standing_s = 1000;
  return options;
}

TEST(LoopcloserCoreTest, TwoYoungMapsAreWeldedByAPlaceThatFillsTheImage) {
  for (const int cells : {LoopcloserOptions().joining.min_filled_cells, 49}) {
    Room room({.points = 3 * kPoints, .second_map_at = kPerRound - 2});
    LoopcloserOptions options = WithNothingProven();
    options.joining.min_filled_cells = cells;
    LoopcloserCore core = MakeCore(options);
    const Answers answers = Play(room, core);
    ASSERT_EQ(answers.loops.empty(), cells == 49);
    if (!answers.loops.empty()) ExpectWelds(room, answers.loops.front());
  }
}

/// His surroundings are others.
TEST(LoopcloserCoreTest, SomebodyWhoStoodInTwoYoungMapsDoesNotWeldThem) {
  const WorldOptions world{.points = 3 * kPoints,
                           .second_visit_elsewhere = true,
                           .person_at = {20, 100},
                           .person_half_width_rad = 0.3,
                           .second_map_at = 97};
  LoopcloserOptions trusting = WithNothingProven();
  trusting.joining.min_filled_cells = trusting.joining.min_filled_rim_cells = 0;
  trusting.joining.min_filled_share = 0;
  {
    Room room(world);
    LoopcloserCore core = MakeCore(trusting);
    ASSERT_GE(Play(room, core).loops.size(), 1u) << "the scene is no trap";
  }
  Room room(world);
  LoopcloserCore core = MakeCore(WithNothingProven());
  EXPECT_TRUE(Play(room, core).loops.empty());
}

TEST(LoopcloserCoreTest, OnePictureThatHangsInTwoMapsDoesNotWeldThem) {
  Room room({.second_visit_elsewhere = true, .picture_rad = 0.25, .second_map_at = kPerRound / 4});
  LoopcloserCore core = MakeCore();
  EXPECT_TRUE(Play(room, core).loops.empty());
}

TEST(LoopcloserCoreTest, SwitchedOffItAnswersNone) {
  Room room({});
  LoopcloserOptions options;
  options.enabled = false;
  LoopcloserCore core = MakeCore(options);
  const Answers answers = Play(room, core);
  EXPECT_TRUE(answers.loops.empty());
  EXPECT_EQ(core.counters().checked, static_cast<uint64_t>(kKeyframes));
}

TEST(LoopcloserCoreTest, TheSameRecordsGiveTheSameAnswers) {
  Room room_a({}), room_b({});
  LoopcloserCore core_a = MakeCore(), core_b = MakeCore();
  const Answers a = Play(room_a, core_a), b = Play(room_b, core_b);
  ASSERT_EQ(a.loops.size(), b.loops.size());
  for (size_t i = 0; i < a.loops.size(); ++i) {
    ASSERT_EQ(a.loops[i].corrections.size(), b.loops[i].corrections.size());
    for (size_t j = 0; j < a.loops[i].corrections.size(); ++j) {
      EXPECT_EQ(a.loops[i].corrections[j].corrected_from_base.translation,
                b.loops[i].corrections[j].corrected_from_base.translation);
    }
  }
}

}  // namespace
}  // namespace dmslam
