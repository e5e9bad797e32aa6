#include "collector/collector_node.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/mapping/testing/wall_scene.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/testing/node_on_bus.h"
#include "dmslam/settings/settings.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr uint32_t kSession = 1;         ///< the scene's
constexpr int64_t kFrameNs = 100 * kMs;  ///< between frames

/// A collector on a bus with a frontend's and a mapper's stream, and whoever else says something; its results
/// go to a folder.
class CollectorNodeTest : public testing::Test {
 protected:
  CollectorNodeTest() : others_(&bus_.AddPort(), [this] { return now_ns_; }) {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    out_dir_ = std::filesystem::path(testing::TempDir()) /
               ("dmslam_collector_" + std::string(test->name()) + "_" + std::to_string(getpid()));
    std::filesystem::remove_all(out_dir_);
    others_.SetOtherHandler({channels::kKeyframe},
                            [this](const std::string&, std::span<const uint8_t> bytes) {
                              said_again_.emplace_back(bytes.begin(), bytes.end());
                            });
  }
  ~CollectorNodeTest() override { std::filesystem::remove_all(out_dir_); }

  /// `fresh`: of a run that begins; else it follows the one before it.
  void Start(bool fresh = true, bool take_over = false) {
    NodeContext context = ContextOnBus(&bus_.AddPort(), &now_ns_, "collector");
    context.random_id = static_cast<int64_t>(7 + nodes_.size());
    context.fresh_system = fresh;
    NodeOptions options;
    options.session = kSession;
    options.take_over = take_over;
    options.settings = settings_;
    CollectorOptions collector;
    collector.out_dir = out_dir_;
    collector.for_people = false;
    nodes_.push_back(std::make_unique<CollectorNode>(context, options, collector));
  }
  CollectorNode& node() { return *nodes_.back(); }
  void SayCamera() {
    CameraInfo info;
    info.session = kSession;
    info.camera = TestCamera();
    info.sequence = "wall";
    info.num_frames = 5;
    for (int said = 0; said < 2; ++said) {
      Say(info);
      Run(200);
    }
  }
  void BeginStreams() {
    frontend_ = MakeWriter(StreamId::kFrontend, "frontend");
    mapper_ = MakeWriter(StreamId::kMap, "mapper");
    SessionStart start;
    start.session = kSession;
    start.configuration_hash = settings_.Hash();
    start.camera = TestCamera();
    PublishFrom(*frontend_, start);
  }
  std::unique_ptr<StreamWriter> MakeWriter(StreamId stream, const std::string& role) {
    auto writer = std::make_unique<StreamWriter>(WriterOfRole(kSession, stream, role, "collector"),
                                                 Term{10, 3}, Version{});
    others_.AddWriter(writer.get(), OwnerName(role), {"COLLECTOR"});
    return writer;
  }
  template <typename Message>
  void PublishFrom(StreamWriter& writer, const Message& message) {
    writer.Publish(wire::Info<Message>().channel, wire::Encode(message), now_ns_);
    Run(50);
  }
  template <typename Message>
  void Say(const Message& message) {
    dmslam::Say(others_.bus(), message);
  }
  void SayBytes(const std::string& channel, Bytes bytes) {
    dmslam::SayBytes(others_.bus(), channel, std::move(bytes));
  }
  void SayEnd() {
    EndOfSequence end;
    end.session = kSession;
    end.frames_published = 5;
    end.frames_missing = 2;
    Say(end);
    Run(50);
  }
  void Run(int64_t ms) {
    for (const int64_t end_ns = now_ns_ + ms * kMs; now_ns_ < end_ns; now_ns_ += 5 * kMs) {
      others_.Advance();
      DeliverAll(bus_);
      for (const auto& node : nodes_) {
        if (node == nodes_.back() || (all_live_ && !node->exit_code())) node->Advance();
      }
      DeliverAll(bus_);
    }
  }

  /// The camera is `x` to the right of keyframe 0.
  void PublishPose(uint32_t frame, double x, TrackingState state = TrackingState::kTracking) {
    FramePose pose;
    pose.frame_index = frame;
    pose.stamp_ns = frame * kFrameNs;
    pose.state = state;
    if (state != TrackingState::kNotInitialized) {
      pose.map_id = 1;
      pose.reference = WallScene::Id(0);
      pose.T_cam_reference = pose.T_cam_world = WallScene::At(x);
    }
    PublishFrom(*frontend_, pose);
  }
  /// Of the only map; it costs much, and is said until it is believed.
  void PublishReset() {
    MapReset reset;
    reset.map_id = 1;
    reset.fate = MapReset::Fate::kDrop;
    PublishFrom(*frontend_, reset);
    Run(1000);
  }
  void PublishFirstKeyframe() {
    scene_.AddKeyframe(map_, 0, 0);
    PublishFrom(*mapper_, map_.TakeDelta(MapEvent::kMapped, WallScene::Id(0), std::nullopt));
  }
  /// Both streams, and the sequence.
  void EndAll() {
    MapProgress progress = map_.progress();
    progress.ended = true;
    map_.SetProgress(progress);
    MapDelta delta = map_.TakeDelta(MapEvent::kEnded, std::nullopt, std::nullopt);
    delta.progress = progress;
    PublishFrom(*mapper_, delta);
    frontend_->Complete(now_ns_);
    mapper_->Complete(now_ns_);
    for (int s = 0; s < 60 && !node().exit_code(); ++s) Run(1000);
  }

  /// Of a trajectory: x by the stamp as it is written.
  std::vector<std::pair<std::string, double>> ReadPositions(const std::string& file) const {
    std::ifstream in(out_dir_ / file);
    EXPECT_TRUE(in) << file;
    std::vector<std::pair<std::string, double>> positions;
    std::string line;
    while (std::getline(in, line)) {
      std::istringstream fields(line);
      std::string stamp;
      double x = 0;
      if (!line.starts_with('#') && fields >> stamp >> x) positions.emplace_back(stamp, x);
    }
    return positions;
  }
  nlohmann::json Summary() const {
    std::ifstream in(out_dir_ / "summary.json");
    EXPECT_TRUE(in);
    return nlohmann::json::parse(in, nullptr, false);
  }
  bool IsThere(const std::string& file) const { return std::filesystem::exists(out_dir_ / file); }

  const Settings settings_ = LoadSettings("", {});
  std::filesystem::path out_dir_;
  int64_t now_ns_ = kMs;
  MemoryBus bus_;
  Endpoint others_;
  std::vector<Bytes> said_again_;  ///< keyframes, by the collector
  WallScene scene_{4, 3};
  MapEditor map_{TestCamera(), Pyramid()};
  std::unique_ptr<StreamWriter> frontend_, mapper_;
  std::vector<std::unique_ptr<CollectorNode>> nodes_;  ///< the last one runs; the others are dead ...
  bool all_live_ = false;                              ///< ... unless this is set
};

TEST_F(CollectorNodeTest, WritesEachFrameOnceWhenBothStreamsHaveEnded) {
  Start();
  SayCamera();
  BeginStreams();
  PublishFirstKeyframe();
  PublishPose(0, 0, TrackingState::kNotInitialized);
  for (const uint32_t frame : {1, 2, 3}) PublishPose(frame, frame);
  PublishPose(0, 0.25, TrackingState::kLocalizedLater);
  PublishPose(2, 2.5, TrackingState::kLocalizedLater);
  SayEnd();
  Run(2000);
  EXPECT_FALSE(IsThere("trajectory.txt")) << "the streams go on";
  EndAll();
  EXPECT_EQ(node().exit_code(), kExitDone) << node().problem();
  using Positions = std::vector<std::pair<std::string, double>>;
  EXPECT_EQ(ReadPositions("trajectory.txt"),
            (Positions{{"0.000000", 0.25}, {"0.100000", 1}, {"0.200000", 2.5}, {"0.300000", 3}}));
  EXPECT_EQ(ReadPositions("trajectory_online.txt"),
            (Positions{{"0.100000", 1}, {"0.200000", 2}, {"0.300000", 3}}));
  EXPECT_EQ(ReadPositions("keyframes.txt").size(), 1U);
  const nlohmann::json summary = Summary();
  EXPECT_EQ(summary["sequence"], "wall");
  EXPECT_EQ(summary["frames"], 5);
  EXPECT_EQ(summary["frames_missing"], 2);
  EXPECT_EQ(summary["messages_dropped"], 0);
  EXPECT_FALSE(std::filesystem::exists(JournalPath(out_dir_))) << "nobody goes on with this run";
}

TEST_F(CollectorNodeTest, ForeignAndDamagedMessagesAreDroppedAndCounted) {
  Start();
  SayCamera();
  BeginStreams();
  PublishFirstKeyframe();
  PublishPose(1, 1);
  EndOfSequence foreign;
  foreign.session = kSession + 1;
  foreign.frames_published = 99;
  Say(foreign);
  SayBytes(channels::kEndOfSequence, Bytes(5, 9));
  Bytes damaged = wire::Encode(FrontendStatus());
  damaged.resize(damaged.size() / 2);
  SayBytes(channels::kFrontendStatus, damaged);
  SayEnd();
  EndAll();
  EXPECT_EQ(node().exit_code(), kExitDone);
  const nlohmann::json summary = Summary();
  EXPECT_EQ(summary["frames"], 5) << "as our own player said";
  EXPECT_EQ(summary["dropped_of_other_sessions"], 1);
  EXPECT_EQ(summary["messages_dropped"], 3);
}

TEST_F(CollectorNodeTest, ACollectorThatFollowsHasWhatWasHeardBeforeIt) {
  Start();
  SayCamera();
  BeginStreams();
  for (const uint32_t frame : {1, 2}) PublishPose(frame, frame);
  SayEnd();
  node().Stop();
  EXPECT_EQ(node().exit_code(), kExitDone);
  EXPECT_EQ(Summary()["keyframes"], 0) << "it writes what there is";

  Start(false);
  Run(200);
  PublishPose(3, 3);
  PublishFirstKeyframe();
  EndAll();
  EXPECT_EQ(node().exit_code(), kExitDone);
  EXPECT_EQ(ReadPositions("trajectory.txt").size(), 3U);
  EXPECT_EQ(Summary()["frames"], 5) << "the player has left";
  EXPECT_EQ(Summary()["frames_missing"], 2);
}

TEST_F(CollectorNodeTest, ASecondOneIsRefusedByNameAndWritesNothing) {
  all_live_ = true;
  Start();
  SayCamera();
  BeginStreams();
  PublishPose(1, 1);
  const std::filesystem::path first_dir = std::exchange(out_dir_, out_dir_.string() + "_second");
  Start(false);
  for (int s = 0; s < 5 && !node().exit_code(); ++s) {
    SayCamera();
    Run(600);
  }
  EXPECT_EQ(node().exit_code(), kExitPresent);
  EXPECT_EQ(node().problem(),
            "session 1: collector writes results of this session already: stop it, or give another "
            "--session, --prefix or port");
  EXPECT_FALSE(std::filesystem::exists(out_dir_));
  EXPECT_EQ(nodes_.front()->exit_code(), std::nullopt) << "nothing happens to the first one";

  std::swap(nodes_.front(), nodes_.back());
  out_dir_ = first_dir;
  PublishPose(2, 2);
  PublishFirstKeyframe();
  EndAll();
  EXPECT_EQ(node().exit_code(), kExitDone);
  EXPECT_EQ(Summary()["restarts"], 0);
  EXPECT_EQ(ReadPositions("trajectory.txt").size(), 2U);
}

TEST_F(CollectorNodeTest, WhoIsToTakeOverWaitsUntilTheOtherOneHasEnded) {
  all_live_ = true;
  Start();
  SayCamera();
  BeginStreams();
  PublishPose(1, 1);
  Start(false, true);
  for (int s = 0; s < 5; ++s) {
    SayCamera();
    Run(600);
  }
  EXPECT_EQ(node().exit_code(), std::nullopt) << node().problem();
  nodes_.front()->Stop();
  Run(2500);
  PublishPose(2, 2);
  PublishFirstKeyframe();
  EndAll();
  EXPECT_EQ(node().exit_code(), kExitDone) << node().problem();
  EXPECT_EQ(ReadPositions("trajectory.txt").size(), 2U);
}

TEST_F(CollectorNodeTest, OfTwoThatBeginTogetherOneGoesOn) {
  all_live_ = true;
  Start(false);
  Start(false);
  SayCamera();
  BeginStreams();
  Run(6000);
  EXPECT_EQ(nodes_.front()->exit_code(), std::nullopt) << nodes_.front()->problem();
  EXPECT_EQ(nodes_.back()->exit_code(), kExitPresent);
}

TEST_F(CollectorNodeTest, AResetThatNoMapperHasCarriedOutCostsNoPose) {
  Start();
  SayCamera();
  BeginStreams();
  PublishFirstKeyframe();
  PublishPose(1, 1);
  PublishReset();
  EndAll();
  EXPECT_EQ(ReadPositions("trajectory.txt").size(), 1U);
  EXPECT_EQ(Summary()["resets"], 1);
}

TEST_F(CollectorNodeTest, PosesOfAMapThatWasDroppedStayVoidWhereItsNumberIsGivenAgain) {
  Start();
  SayCamera();
  BeginStreams();
  PublishFirstKeyframe();
  PublishPose(1, 1);
  PublishReset();
  map_.DropMap(1);
  PublishFrom(*mapper_, map_.TakeDelta(MapEvent::kMapDropped, std::nullopt, 1));
  PublishFirstKeyframe();
  PublishPose(2, 2);
  EndAll();
  EXPECT_EQ(ReadPositions("trajectory.txt").size(), 1U);
}

TEST_F(CollectorNodeTest, WhereNoFrameWasTrackedTheFrontendsWordSaysWhy) {
  Start();
  SayCamera();
  BeginStreams();
  PublishPose(0, 0, TrackingState::kNotInitialized);
  FrontendStatus status;
  status.head.session = kSession;
  status.head.reason = "too dark";
  Say(status);
  Run(50);
  EndAll();
  EXPECT_EQ(node().exit_code(), kExitNoFrame);
  EXPECT_NE(node().problem().find("too dark"), std::string::npos) << node().problem();
  EXPECT_TRUE(IsThere("summary.json"));
}

TEST_F(CollectorNodeTest, AFrontendWithOtherSettingsEndsIt) {
  Start();
  SayCamera();
  frontend_ = MakeWriter(StreamId::kFrontend, "frontend");
  SessionStart start;
  start.session = kSession;
  start.configuration_hash = settings_.Hash() + 1;
  start.camera = TestCamera();
  PublishFrom(*frontend_, start);
  Run(2000);
  EXPECT_EQ(node().exit_code(), kExitMisfit);
  EXPECT_NE(node().problem().find("other settings"), std::string::npos) << node().problem();
}

TEST_F(CollectorNodeTest, WhatASilentFrontendHasProposedIsSaidAgainUntilItIsInTheMap) {
  Start();
  SayCamera();
  BeginStreams();
  PublishFrom(*frontend_, scene_.Propose(0, 0, 0, 0, 0));
  Run(1500);
  EXPECT_TRUE(said_again_.empty()) << "its frontend says it itself";
  others_.Remove(frontend_.get());
  Run(3000);
  ASSERT_FALSE(said_again_.empty());
  const auto proposal = wire::Decode<KeyframeProposal>(std::span<const uint8_t>(said_again_.front()));
  ASSERT_TRUE(proposal);
  EXPECT_EQ(proposal->id, WallScene::Id(0));
  PublishFirstKeyframe();
  said_again_.clear();
  Run(3000);
  EXPECT_TRUE(said_again_.empty());
}

TEST_F(CollectorNodeTest, AFolderThatCannotBeMadeIsNamed) {
  { std::ofstream file(out_dir_); }
  out_dir_ /= "below_a_file";
  Start();
  try {
    SayCamera();
    FAIL() << "it has no place for what it hears";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("--out"), std::string::npos) << error.what();
  }
  out_dir_ = out_dir_.parent_path();
}

}  // namespace
}  // namespace dmslam
