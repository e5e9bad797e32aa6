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

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int kKeyframes = 120;  // one and a quarter rounds
constexpr int kPerRound = 96;
constexpr int kPoints = 1600;  // on a cylinder around the path
constexpr double kPathRadius = 2.0, kWallRadius = 5.0;
constexpr double kDriftPerKeyframe = 0.002;    // of the scale, and of the position
constexpr int64_t kInterval_ns = 650'000'000;  // between two keyframes
constexpr int kPersonPoints = 500;
constexpr int kPersonStands = 6;  // keyframes, 3.9 s

std::shared_ptr<const Vocabulary> ShippedVocabulary() {
  const char* source = std::getenv("DMSLAM_SOURCE_DIR");
  return std::make_shared<const Vocabulary>(
      LoadOrbVocabulary(std::string(source == nullptr ? "." : source) + "/data/vocabulary.dmv"));
}

Descriptor RandomDescriptor(Random& random) {
  return {{random.Next(), random.Next(), random.Next(), random.Next()}};
}

/// Looks outwards from a circle, upright.
Rigid3d TruePose(int k) {
  const double angle = 2 * std::numbers::pi * k / kPerRound;
  Eigen::Matrix3d R_world_cam;  // columns: right, down, forward
  R_world_cam.col(2) = Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
  R_world_cam.col(1) = Eigen::Vector3d(0, 0, -1);
  R_world_cam.col(0) = R_world_cam.col(1).cross(R_world_cam.col(2));
  const Eigen::Vector3d center = kPathRadius * R_world_cam.col(2);
  return Rigid3d(Eigen::Quaterniond(R_world_cam), center).Inverse();
}

/// What a keyframe and the landmarks made in it believe of the world: it grows and slides as the camera goes
/// on.
Sim3d Drift(int k) {
  return Sim3d(Eigen::Quaterniond::Identity(), k * kDriftPerKeyframe * Eigen::Vector3d(1, 0.5, 0),
               1.0 + k * kDriftPerKeyframe / 4);
}

struct WorldOptions {
  bool second_visit_elsewhere = false;  ///< after one round the camera sees another wall...
  double picture_rad = 0;               ///< a patch of the wall, so wide, hangs on the other side, too
  bool first_wall_moves = false;        ///< its landmarks are believed to move
  size_t landmark_every = 1;            ///< in the second round only every so many features get a landmark
  size_t fused_every = 0;               ///< every so many points are known again in the second round; 0: none
  /// Keyframes before which somebody stands, near enough to hide most of the wall; he stands for
  /// kPersonStands keyframes each, and looks the same.
  std::vector<int> person_at = {};
  int second_map_at = 1'000'000;  ///< from this keyframe on the camera is in a map of its own
};

/// What the second map believes of the world: it lies turned, elsewhere, and is half as large.
Sim3d SecondWorld() { return Sim3d(ExpSo3(Eigen::Vector3d(0.2, -0.4, 1.0)), Eigen::Vector3d(3, 1, -2), 0.5); }

/// A camera that goes around a room; landmarks of the second round are not known to be those of the first.
class Room {
 public:
  explicit Room(const WorldOptions& options)
      : options_(options), map_(TestCamera(525, 319.5, 239.5), Pyramid()) {
    Random random(7);
    for (int i = 0; i < kPoints; ++i) {
      const double angle = random.Uniform(0, 2 * std::numbers::pi);
      const double radius = kWallRadius + random.Uniform(-0.6, 0.6);
      points_.push_back({radius * std::cos(angle), radius * std::sin(angle), random.Uniform(-2.0, 2.0)});
      first_.push_back(RandomDescriptor(random));
      second_.push_back(RandomDescriptor(random));
      if (!options.second_visit_elsewhere) second_.back() = first_.back();
      if (angle >= options.picture_rad) continue;
      points_.push_back({-points_.back().x(), -points_.back().y(), points_.back().z()});
      first_.push_back(first_.back());
      second_.push_back(second_.back());
    }
    walls_ = points_.size();
    AddPerson(random);
  }

  /// The next keyframe with what it sees, as a delta.
  MapDelta Next() {
    const int k = next_++;
    const KeyframeId id = KeyframeId::Make(1, static_cast<uint32_t>(k + 1));
    Random random(DeriveSeed(3, static_cast<uint64_t>(k), "keyframe"));
    const Rigid3d T_cam_true = TruePose(k);
    FeatureSet features;
    std::vector<size_t> seen;
    for (size_t i = 0; i < points_.size(); ++i) {
      const auto uv = map_.camera().Project(T_cam_true * points_[i]);
      if (!uv || uv->x() < 1 || uv->y() < 1 || uv->x() > 638 || uv->y() > 478) continue;
      if (IsHidden(i, k, *uv)) continue;
      Descriptor descriptor = DescriptorOf(i, k);
      for (int flips = 0; flips < 8; ++flips)
        descriptor.words[random.Below(4)] ^= uint64_t{1} << random.Below(64);
      const Eigen::Vector2d noisy = *uv + 0.3 * Eigen::Vector2d(random.Gaussian(), random.Gaussian());
      features.keypoints.push_back({static_cast<uint16_t>(std::lround(noisy.x() * 16)),
                                    static_cast<uint16_t>(std::lround(noisy.y() * 16)), 1, 0});
      features.descriptors.push_back(descriptor);
      seen.push_back(i);
    }
    AddKeyframe(k, id, std::move(features));
    const size_t step = Round(k) == 0 ? 1 : options_.landmark_every;
    for (size_t feature = 0; feature < seen.size(); feature += step) {
      const LandmarkId landmark = LandmarkFor(seen[feature], k, id);
      map_.SetObservation(map_.At(id), static_cast<uint16_t>(feature), map_.At(landmark));
      map_.UpdateDescriptor(map_.At(landmark));
    }
    return map_.TakeDelta(MapEvent::kMapped, id, MapOf(k));
  }

  /// The mapper's word on a correction. It stays where it is: these tests look at answers alone.
  MapDelta SayOf(const LoopAnswer& answer, MapEvent event) {
    MapDelta delta = map_.TakeDelta(event, answer.keyframe, 1);
    delta.correction_id = answer.correction_id;
    return delta;
  }

  const Map& map() const { return map_; }

 private:
  int Round(int k) const { return k / kPerRound; }
  MapId MapOf(int k) const { return k < options_.second_map_at ? 1 : 2; }
  Sim3d Believed(int k) const { return MapOf(k) == 1 ? Drift(k) : SecondWorld(); }
  const Descriptor& DescriptorOf(size_t point, int k) const {
    return Round(k) == 0 ? first_[point] : second_[point];
  }

  /// A slab, rigid, that fills most of the image of the keyframe before which it stands.
  void AddPerson(Random& random) {
    std::vector<Eigen::Vector3d> body;
    std::vector<Descriptor> looks;
    for (int i = 0; i < kPersonPoints; ++i) {
      body.push_back({random.Uniform(-0.45, 0.45), random.Uniform(-0.45, 0.45), random.Uniform(0.9, 1.1)});
      looks.push_back(RandomDescriptor(random));
    }
    for (const int at : options_.person_at) {
      const Rigid3d T_world_cam = TruePose(at).Inverse();
      for (const Eigen::Vector3d& p_cam : body) points_.push_back(T_world_cam * p_cam);
      first_.insert(first_.end(), looks.begin(), looks.end());
      second_.insert(second_.end(), looks.begin(), looks.end());
    }
  }
  /// Before which keyframe somebody stands while keyframe `k` looks; -1: nobody does.
  int PersonBefore(int k) const {
    for (const int at : options_.person_at) {
      if (k >= at - kPersonStands / 2 && k < at + kPersonStands / 2) return at;
    }
    return -1;
  }
  bool IsHidden(size_t point, int k, const Eigen::Vector2d& uv_px) const {
    const int at = PersonBefore(k);
    if (point >= walls_) return at < 0 || options_.person_at[(point - walls_) / kPersonPoints] != at;
    if (at < 0) return false;
    const auto middle =
        map_.camera().Project(TruePose(k) * (TruePose(at).Inverse() * Eigen::Vector3d(0, 0, 1)));
    return middle && std::abs(uv_px.x() - middle->x()) < 240 && std::abs(uv_px.y() - middle->y()) < 240;
  }

  void AddKeyframe(int k, KeyframeId id, FeatureSet features) {
    Keyframe keyframe;
    keyframe.id = id;
    keyframe.map_id = MapOf(k);
    keyframe.stamp_ns = k * kInterval_ns;
    keyframe.T_cam_world = (Sim3d(TruePose(k)) * Believed(k).Inverse()).ToRigid();
    if (k > 0 && k != options_.second_map_at) keyframe.parent = KeyframeId::Make(1, static_cast<uint32_t>(k));
    keyframe.features = MakeFrameFeatures(std::move(features), map_.camera(), map_.pyramid());
    map_.AddKeyframe(std::move(keyframe));
  }

  LandmarkId LandmarkFor(size_t point, int k, KeyframeId id) {
    // Seen again in the second round it is another landmark; so are those that the first round's end sees of
    // its start.
    const bool fused = options_.fused_every > 0 && point % options_.fused_every == 0;
    const int era = MapOf(k) == 1 ? Era(point, k) : 1000;
    const auto [known, is_new] = landmarks_.try_emplace({point, fused ? 0 : era});
    if (!is_new) return known->second;
    Landmark landmark;
    landmark.id = known->second = LandmarkId::Make(1, ++last_landmark_);
    landmark.map_id = MapOf(k);
    landmark.p_world = Believed(k) * points_[point];
    landmark.reference = landmark.first_keyframe = id;
    if (options_.first_wall_moves && Round(k) == 0) landmark.evidence.motion_belief = 2.0F;
    map_.AddLandmark(landmark);
    return landmark.id;
  }
  int Era(size_t point, int k) {
    const auto last = last_seen_.find(point);
    if (last != last_seen_.end() && k - last->second > kPerRound / 2) ++era_[point];
    last_seen_[point] = k;
    return era_[point];
  }

  WorldOptions options_;
  MapEditor map_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Descriptor> first_, second_;
  size_t walls_ = 0;  ///< points of the walls; those of people follow
  std::map<std::pair<size_t, int>, LandmarkId> landmarks_;
  std::map<size_t, int> last_seen_, era_;
  uint64_t last_landmark_ = 0;
  int next_ = 0;
};

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

TEST(LoopcloserCoreTest, ALoopThatWasRefusedIsFoundAgainAndNotAdjusted) {
  Room room({});
  LoopcloserCore core = MakeCore();
  const Answers answers = Play(room, core, MapEvent::kRefused);
  EXPECT_GE(answers.loops.size(), 2u);
  EXPECT_TRUE(answers.adjustments.empty());
  EXPECT_EQ(core.counters().loops, 0u);
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

/// Without what stops loops on people.
LoopcloserOptions Trusting() {
  LoopcloserOptions options;
  options.min_proven = 0;
  options.min_told = 1'000'000;
  options.max_drift_sigmas = 1e9;
  options.confirmations = 1;
  options.confirm_for_s = 0;
  return options;
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
  at_once.confirmations = 1;
  at_once.confirm_for_s = 0;
  LoopcloserOptions patient = at_once;
  patient.confirm_for_s = 3.0;
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
  const MapId map_id = room.map().FindKeyframe(weld.keyframe)->map_id;
  EXPECT_NE(map_id, room.map().FindKeyframe(*weld.matched)->map_id);
  const auto whole = std::ranges::count_if(room.map().KeyframesOf(map_id), [&](const Keyframe* keyframe) {
    return keyframe->id <= weld.keyframe;
  });
  EXPECT_EQ(std::ssize(weld.corrections), whole) << "a map goes as a whole";
  const int here = static_cast<int>(weld.keyframe.frame_index()) - 1;
  const int there = static_cast<int>(weld.matched->frame_index()) - 1;
  const Rigid3d found =
      Corrected(room, weld, weld.keyframe) * room.map().FindKeyframe(*weld.matched)->T_cam_world.Inverse();
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
  trusting.min_joining_share = trusting.min_share;
  {
    Room room(world);
    LoopcloserCore core = MakeCore(trusting);
    ASSERT_GE(Play(room, core).loops.size(), 1u) << "the scene is no trap";
  }
  Room room(world);
  LoopcloserCore core = MakeCore();
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
