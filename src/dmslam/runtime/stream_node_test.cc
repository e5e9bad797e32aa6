#include "dmslam/runtime/stream_node.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/map/replica.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/event_loop.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/testing/node_on_bus.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr uint32_t kSession = 4;

/// Holds a replica of the map, and nothing else.
class Holder : public StreamNode {
 public:
  Holder(NodeContext context, NodeOptions options)
      : StreamNode(std::move(context), std::move(options), "collector"), map_(TestCamera(), Pyramid()) {}

  const Map& map() const { return map_; }
  int applied() const { return applied_; }
  Version held() const { return MapHeld(*reader_); }
  const std::optional<CameraInfo>& camera() const { return camera_info_; }
  ProcessHealth health() const { return MakeStatusHead("", {reader_.get()}).health; }
  int64_t malformed() const { return MakeStatusHead("", {}).health.dropped_malformed; }

 private:
  void Begin(const CameraInfo&) override { reader_ = MakeReader(StreamId::kMap); }
  bool WorkOnce() override {
    const std::optional<Record> record = reader_->Take();
    if (!record) return false;
    if (record->begins_anew()) map_.Clear();
    const auto delta = ReadMapRecord(*record, reader_.get());
    if (!delta) return true;
    map_.Apply(*delta);
    ++applied_;
    reader_->AcceptTaken();
    return true;
  }

  std::unique_ptr<StreamReader> reader_;
  Replica map_;
  int applied_ = 0;
};

Keyframe MakeKeyframe(uint32_t frame) {
  Keyframe keyframe;
  keyframe.id = KeyframeId::Make(kSession, frame);
  keyframe.map_id = 1;
  keyframe.features = MakeFrameFeatures({}, TestCamera(), Pyramid());
  return keyframe;
}

/// A mapper's stream on a bus with one holder of a replica.
class MapStreamTest : public testing::Test {
 protected:
  MapStreamTest()
      : map_(TestCamera(), Pyramid()),
        snapshots_(&map_),
        mapper_(&bus_.AddPort(), [this] { return now_ns_; }) {
    writer_ = std::make_unique<StreamWriter>(WriterOfRole(kSession, StreamId::kMap, "mapper", "collector"),
                                             Term{10, 3}, Version{}, &snapshots_);
    mapper_.AddWriter(writer_.get(), "MAPPER", {"COLLECTOR"});
    const NodeContext context = ContextOnBus(&bus_.AddPort(), &now_ns_, "collector");
    NodeOptions node;
    node.session = kSession;
    holder_ = std::make_unique<Holder>(context, node);
    CameraInfo info;
    info.session = kSession;
    info.camera = TestCamera();
    SayCamera(info);
    SayCamera(info);
    Run();
  }

  void SayCamera(const CameraInfo& info) {
    dmslam::Say(mapper_.bus(), info);
    DeliverAll(bus_);
    now_ns_ += 100 * kMs;
  }

  void Run() {
    for (int i = 0; i < 400; ++i) {
      mapper_.Advance();
      holder_->Advance();
      DeliverAll(bus_);
      now_ns_ += 5 * kMs;
    }
  }
  MapDelta AddKeyframe(uint32_t frame) {
    map_.AddKeyframe(MakeKeyframe(frame));
    return map_.TakeDelta(MapEvent::kMapped, KeyframeId::Make(kSession, frame), 1);
  }
  int64_t Publish(Bytes bytes) { return writer_->Publish(channels::kMap, std::move(bytes), now_ns_); }
  int64_t Publish(const MapDelta& delta) { return Publish(wire::Encode(delta)); }

  int64_t now_ns_ = kMs;
  MemoryBus bus_;
  MapEditor map_;
  MapSnapshots snapshots_;
  Endpoint mapper_;
  std::unique_ptr<StreamWriter> writer_;
  std::unique_ptr<Holder> holder_;
};

TEST_F(MapStreamTest, OneForgedCameraBeforeItsOwnComesIsNotBelieved) {
  NodeOptions options;
  options.session = kSession;
  NodeContext context;
  context.bus = &bus_.AddPort();
  context.now_ns = [this] { return now_ns_; };
  context.wall_us = [this] { return now_ns_ / 1000; };
  context.random_id = 8;
  Holder late(context, options);
  CameraInfo forged;
  forged.session = kSession;
  forged.camera = TestCamera();
  forged.camera.width_px = 32;
  SayCamera(forged);
  late.Advance();
  EXPECT_FALSE(late.camera());
  CameraInfo own = forged;
  own.camera = TestCamera();
  SayCamera(own);
  SayCamera(own);
  late.Advance();
  ASSERT_TRUE(late.camera());
  EXPECT_EQ(late.camera()->camera.width_px, TestCamera().width_px);
}

TEST_F(MapStreamTest, AReplicaFollows) {
  const int64_t seq = Publish(AddKeyframe(1));
  Run();
  EXPECT_EQ(holder_->map().keyframes().size(), 1U);
  EXPECT_EQ(writer_->AcknowledgedBy("collector"), seq);
  EXPECT_EQ(holder_->malformed(), 0);
}

TEST_F(MapStreamTest, TheDeepestThatTheQueueWasIsKept) {
  EXPECT_EQ(holder_->health().queue_peak, 0);
  for (const uint32_t frame : {1, 2, 3}) Publish(AddKeyframe(frame));
  mapper_.Advance();
  DeliverAll(bus_);
  EXPECT_EQ(holder_->health().queue_depth, 3);
  EXPECT_EQ(holder_->health().queue_peak, 3);
  Run();
  EXPECT_EQ(holder_->applied(), 3);
  EXPECT_EQ(holder_->health().queue_depth, 0);
  EXPECT_EQ(holder_->health().queue_peak, 3);
  Publish(AddKeyframe(4));
  Run();
  EXPECT_EQ(holder_->health().queue_peak, 3);
}

TEST_F(MapStreamTest, ARecordThatCannotBeReadIsNamedAndTheMapComesAsASnapshot) {
  Publish(AddKeyframe(1));
  Run();
  Bytes unreadable = wire::Encode(AddKeyframe(2));
  unreadable[0] ^= 1;  // a type that nobody knows; its seal is sound
  const int64_t seq = Publish(unreadable);
  mapper_.Advance();
  DeliverAll(bus_);
  holder_->Advance();
  EXPECT_EQ(holder_->malformed(), 1);
  EXPECT_EQ(holder_->applied(), 1) << "not as an empty change";
  EXPECT_LT(writer_->AcknowledgedBy("collector").value_or(0), seq)
      << "what was not applied is not acknowledged";
  Run();
  EXPECT_EQ(holder_->map().keyframes().size(), 2U) << "the snapshot has it";
  Publish(AddKeyframe(3));
  Run();
  EXPECT_EQ(holder_->map().keyframes().size(), 3U);
  EXPECT_EQ(holder_->malformed(), 1);
}

/// An earlier change in the place of the next one, as somebody forges it who repeats what he hears.
TEST_F(MapStreamTest, AnEarlierChangeInThePlaceOfTheNextOneIsAskedForAgain) {
  const MapDelta first = AddKeyframe(1);
  Publish(first);
  Run();
  Bytes forged = wire::Encode(first);
  Seal(writer_->HeaderOf(2), channels::kMap, forged);
  mapper_.bus().Publish({channels::kMap, std::make_shared<const Bytes>(forged), false});
  DeliverAll(bus_);
  holder_->Advance();
  EXPECT_EQ(holder_->applied(), 1);
  const int64_t seq = Publish(AddKeyframe(2));
  ASSERT_EQ(seq, 2);
  Run();
  EXPECT_EQ(holder_->applied(), 2);
  EXPECT_EQ(holder_->map().keyframes().size(), 2U);
  EXPECT_EQ(writer_->AcknowledgedBy("collector"), seq);
  EXPECT_EQ(holder_->malformed(), 0);
}

/// ... and one that its writer means is applied.
TEST_F(MapStreamTest, AnEarlierChangeThatItsWriterSaysAgainIsBelieved) {
  const MapDelta first = AddKeyframe(1);
  Publish(first);
  const int64_t seq = Publish(first);
  Run();
  EXPECT_EQ(holder_->applied(), 2);
  EXPECT_EQ(writer_->AcknowledgedBy("collector"), seq);
}

/// The first beacon of the next term is put aside until it is said again: with one message alone nobody can
/// take a stream over. That is no attack yet, and the log does not call it one.
TEST_F(MapStreamTest, AWriterThatIsStartedAgainIsToldAsOne) {
  Publish(AddKeyframe(1));
  Run();
  MapSnapshots snapshots(&map_);
  mapper_.Remove(writer_.get());
  testing::internal::CaptureStdout();
  writer_ = std::make_unique<StreamWriter>(WriterOfRole(kSession, StreamId::kMap, "mapper", "collector"),
                                           Term{20, 9}, holder_->held(), &snapshots);
  mapper_.AddWriter(writer_.get(), "MAPPER", {"COLLECTOR"});
  Publish(AddKeyframe(2));
  Run();
  const std::string log = testing::internal::GetCapturedStdout();
  EXPECT_EQ(holder_->map().keyframes().size(), 2U);
  EXPECT_EQ(holder_->health().dropped_malformed, 1) << "as ever: its first word was not believed at once";
  EXPECT_NE(log.find("was started again"), std::string::npos) << log;
  EXPECT_EQ(log.find("dropped"), std::string::npos) << log;
  mapper_.Remove(writer_.get());  // before what its snapshots are made of is gone
  writer_.reset();
}

TEST_F(MapStreamTest, AGroupIsAppliedAsOneOrReplacedByASnapshot) {
  MapDelta first = AddKeyframe(1), second = AddKeyframe(2);
  first.group = {5, 0, 2};
  second.group = {5, 1, 2};
  second.version = first.version, second.about = first.about;
  Publish(first);
  Run();
  EXPECT_EQ(holder_->map().keyframes().size(), 0U);
  EXPECT_EQ(writer_->AcknowledgedBy("collector").value_or(0), 0);
  const int64_t seq = Publish(second);
  Run();
  EXPECT_EQ(holder_->applied(), 1);
  EXPECT_EQ(holder_->map().keyframes().size(), 2U);
  EXPECT_EQ(writer_->AcknowledgedBy("collector"), seq);

  MapDelta third = AddKeyframe(3), fourth = AddKeyframe(4);
  third.group = {6, 0, 3};
  fourth.group = {6, 2, 3};  // the one between is missing
  Publish(third);
  Publish(fourth);
  Run();
  EXPECT_EQ(holder_->malformed(), 1);
  EXPECT_EQ(holder_->map().keyframes().size(), 4U) << "the snapshot has them";
}

/// A group is broken in every way that there is: nothing of it is applied, it is counted, and the snapshot
/// that is asked for brings what it should have brought.
class BrokenGroupTest : public MapStreamTest {
 protected:
  struct Parts {
    MapDelta a, b, c;
  };
  /// A change of three keyframes as a group of three records.
  Parts Group(uint32_t frame) {
    for (uint32_t i = 0; i < 3; ++i) map_.AddKeyframe(MakeKeyframe(frame + i));
    const MapDelta change = map_.TakeDelta(MapEvent::kMapped, KeyframeId::Make(kSession, frame), 1);
    std::vector<MapDelta> records = wire::Split(change, 1);
    EXPECT_EQ(records.size(), 3U);
    return {records[0], records[1], records[2]};
  }
  void ExpectRefused(const std::vector<MapDelta>& records) {
    const int applied = holder_->applied();
    for (const MapDelta& record : records) Publish(record);
    mapper_.Advance();
    DeliverAll(bus_);
    holder_->Advance();
    EXPECT_EQ(holder_->malformed(), 1);
    EXPECT_EQ(holder_->applied(), applied) << "nothing of it";
    Run();
    EXPECT_EQ(holder_->map().keyframes().size(), map_.keyframes().size()) << "the snapshot has them";
    const int64_t seq = Publish(AddKeyframe(100));
    Run();
    EXPECT_EQ(holder_->map().keyframes().size(), map_.keyframes().size());
    EXPECT_EQ(writer_->AcknowledgedBy("collector"), seq);
    EXPECT_EQ(holder_->malformed(), 1);
  }
};

TEST_F(BrokenGroupTest, APartIsMissing) {
  const Parts group = Group(1);
  ExpectRefused({group.a, group.c});
}

TEST_F(BrokenGroupTest, APartIsDoubled) {
  const Parts group = Group(1);
  ExpectRefused({group.a, group.b, group.b});
}

TEST_F(BrokenGroupTest, PartsAreOutOfOrder) {
  const Parts group = Group(1);
  ExpectRefused({group.b});
}

TEST_F(BrokenGroupTest, APartIsOfAnotherVersion) {
  Parts group = Group(1);
  ++group.b.version;
  ExpectRefused({group.a, group.b});
}

TEST_F(BrokenGroupTest, AnotherGroupComesBetween) {
  const Parts one = Group(1), other = Group(11);
  ExpectRefused({one.a, other.a});
}

TEST_F(BrokenGroupTest, ARecordThatStandsAloneComesBetween) {
  const Parts group = Group(1);
  ExpectRefused({group.a, AddKeyframe(9)});
}

/// The mapper dies within a group. Its successor continues the replica, which is as it was before the group.
TEST_F(BrokenGroupTest, TheWriterIsSucceededWithinAGroup) {
  const int64_t before = Publish(AddKeyframe(30));
  Run();
  MapEditor successor_map(map_);
  const Parts lost = Group(1);
  Publish(lost.a);
  Publish(lost.b);
  Run();
  EXPECT_EQ(holder_->map().keyframes().size(), 1U);
  EXPECT_EQ(holder_->held(), (Version{10, before})) << "what a successor may continue";

  StreamWriter::Options options;
  options.session = kSession;
  options.stream = StreamId::kMap;
  options.owner = "MAPPER";
  options.name = "successor";
  options.schema_hash = SchemaHash();
  options.roles = {{"collector", true}};
  MapSnapshots snapshots(&successor_map);
  mapper_.Remove(writer_.get());
  writer_ = std::make_unique<StreamWriter>(options, Term{20, 9}, holder_->held(), &snapshots);
  mapper_.AddWriter(writer_.get(), "MAPPER", {"COLLECTOR"});
  successor_map.AddKeyframe(MakeKeyframe(40));
  Publish(successor_map.TakeDelta(MapEvent::kMapped, KeyframeId::Make(kSession, 40), 1));
  Run();
  EXPECT_EQ(holder_->map().keyframes().size(), 2U);
  EXPECT_NE(holder_->map().FindKeyframe(KeyframeId::Make(kSession, 40)), nullptr);
  EXPECT_EQ(holder_->map().FindKeyframe(KeyframeId::Make(kSession, 1)), nullptr);
  EXPECT_EQ(holder_->malformed(), 1) << "the group is named";
  EXPECT_EQ(writer_->statistics().snapshots, 0) << "the replica is good";
  EXPECT_EQ(holder_->held(), (Version{20, 1}));
}

/// Works on a core's thread, and on a disk's.
class Worker : public StreamNode {
 public:
  Worker(NodeContext context, NodeOptions options)
      : StreamNode(std::move(context), std::move(options), "mapper"),
        core(MakeCoreThread(PlaybackMode::kRealtime)),
        disk(MakeUnwatchedThread(PlaybackMode::kRealtime)) {}

  std::unique_ptr<CoreThread> core, disk;

 private:
  void Begin(const CameraInfo&) override {}
  bool WorkOnce() override { return false; }
};

TEST(StreamNodeTest, HangsWithItsCoreAndNotWithADisk) {
  MemoryBus bus;
  NodeContext context;
  context.bus = &bus.AddPort();
  context.now_ns = &EventLoop::now_ns;
  context.wall_us = &EventLoop::wall_us;
  context.watch = [](int, const std::function<void()>&) {};
  Worker node(context, {});
  std::atomic<bool> begun = false, go_on = false;
  const auto job = [&] {
    begun = true;
    begun.notify_one();
    go_on.wait(false);
  };
  node.disk->Post(job);
  begun.wait(false);
  EXPECT_FALSE(node.Hangs(INT64_MAX, kMs));
  begun = false;
  node.core->Post(job);
  begun.wait(false);
  EXPECT_TRUE(node.Hangs(INT64_MAX, kMs));
  go_on = true;
  go_on.notify_all();
  node.core->Finish();
  EXPECT_FALSE(node.Hangs(INT64_MAX, kMs));
}

/// Reads a frontend's stream, as mapper and collector do.
class Follower : public StreamNode {
 public:
  Follower(NodeContext context, NodeOptions options)
      : StreamNode(std::move(context), std::move(options), "mapper") {}
  int taken() const { return taken_; }
  uint32_t session() const { return session_; }
  bool HearsAsForeign(uint32_t session) { return IsForeign(session); }
  int64_t foreign() const { return MakeStatusHead("", {}).health.dropped_foreign; }
  std::string reason(const std::string& own = "") const { return MakeStatusHead(own, {}).reason; }

 private:
  void Begin(const CameraInfo&) override { reader_ = MakeReader(StreamId::kFrontend); }
  bool WorkOnce() override {
    const std::optional<Record> record = reader_->Take();
    if (!record || IsDoubtful(*record, reader_.get())) return false;
    if (const auto start = ReadSessionStart(record->header, *record->bytes)) JoinSession(*start);
    ++taken_;
    reader_->AcceptTaken();
    return true;
  }

  std::unique_ptr<StreamReader> reader_;
  int taken_ = 0;
};

class SessionTest : public testing::Test {
 protected:
  SessionTest() : frontend_(&bus_.AddPort(), [this] { return now_ns_; }) {
    StreamWriter::Options options;
    options.session = kSession;
    options.stream = StreamId::kFrontend;
    options.owner = "FRONTEND";
    options.schema_hash = SchemaHash();
    options.roles = {{"mapper", true}};
    writer_ = std::make_unique<StreamWriter>(options, Term{10, 3}, Version{});
    frontend_.AddWriter(writer_.get(), "FRONTEND", {"MAPPER"});
    NodeContext context;
    context.bus = &bus_.AddPort();
    context.now_ns = [this] { return now_ns_; };
    context.wall_us = [this] { return now_ns_ / 1000; };
    context.random_id = 7;
    NodeOptions node;
    node.session = kSession;
    settings_hash_ = node.settings.Hash();
    follower_ = std::make_unique<Follower>(context, node);
    Pass(500);
  }
  void Pass(int64_t ms) {
    CameraInfo info;
    info.session = kSession;
    info.camera = TestCamera();
    for (int64_t i = 0; i < ms; i += 5, now_ns_ += 5 * kMs) {
      if (i % 100 == 0) Say(channels::kCameraInfo, wire::Encode(info));
      frontend_.Advance();
      DeliverAll(bus_);
      follower_->Advance();
    }
  }
  void Say(const std::string& channel, Bytes bytes) {
    dmslam::SayBytes(frontend_.bus(), channel, std::move(bytes));
  }
  Bytes Session(uint64_t configuration_hash) const {
    SessionStart start;
    start.session = kSession;
    start.camera = TestCamera();
    start.configuration_hash = configuration_hash;
    return wire::Encode(start);
  }

  int64_t now_ns_ = kMs;
  MemoryBus bus_;
  Endpoint frontend_;
  std::unique_ptr<StreamWriter> writer_;
  std::unique_ptr<Follower> follower_;
  uint64_t settings_hash_ = 0;
};

TEST_F(SessionTest, OneOfOtherSettingsInThePlaceOfTheTrueOneEndsNobody) {
  Bytes forged = Session(settings_hash_ + 1);
  Seal(writer_->HeaderOf(1), channels::kSession, forged);
  Say(channels::kSession, forged);
  Pass(50);
  writer_->Publish(channels::kSession, Session(settings_hash_), now_ns_);
  Pass(1000);
  EXPECT_EQ(follower_->exit_code(), std::nullopt) << follower_->problem();
  EXPECT_EQ(follower_->taken(), 1);
  EXPECT_EQ(writer_->AcknowledgedBy("mapper"), 1);
}

/// Of a process that was told of two cameras.
class TwoCamerasTest : public SessionTest {
 protected:
  TwoCamerasTest() {
    NodeOptions node;
    node.session = kSession;
    node.peers = {"frontend", "frontend1"};
    without_peers_ = std::move(follower_);  // the bus goes on to deliver to it
    follower_ = std::make_unique<Follower>(ContextOnBus(&bus_.AddPort(), &now_ns_, "mapper"), node);
    Pass(500);
  }
  void SayCamera(CameraId camera, uint32_t session, int times) {
    CameraInfo info;
    info.session = session;
    info.camera = TestCamera();
    for (; times > 0; --times) {
      Say(ChannelOfCamera(channels::kCameraInfo, camera), wire::Encode(info));
      Pass(100);
    }
  }
  std::unique_ptr<Follower> without_peers_;
};

TEST_F(TwoCamerasTest, OneMoreIsNamedOnceItHasBeenSaidTwice) {
  SayCamera(1, kSession, 3);
  SayCamera(2, kSession + 1, 3);
  SayCamera(2, kSession, 1);
  EXPECT_EQ(follower_->reason(), "") << "said once it may be forged";
  SayCamera(2, kSession, 1);
  EXPECT_EQ(
      follower_->reason(),
      "camera 2 plays in session 4, but this process was told of 2 cameras and hears nothing of it: give "
      "every process --cameras 3");
  EXPECT_EQ(follower_->reason("waiting"), "waiting") << "what keeps it from its work comes first";
  EXPECT_EQ(follower_->foreign(), 0);
}

/// Of a process that was not told its session.
class ChoosingTest : public SessionTest {
 protected:
  ChoosingTest() {
    NodeContext context = ContextOnBus(&bus_.AddPort(), &now_ns_, "mapper");
    context.random_id = 9;
    chooser_ = std::make_unique<Follower>(context, NodeOptions());
    for (const uint32_t session : {kSession, kSession + 1}) {
      StreamWriter::Options options;
      options.session = session;
      options.stream = StreamId::kPlayer;
      options.owner = "PLAYER";
      options.name = "player on host (pid " + std::to_string(10 * session) + ")";
      options.schema_hash = SchemaHash();
      players_.push_back(std::make_unique<StreamWriter>(options, Term{10, session}, Version{}));
    }
  }
  /// So many sessions are played.
  void Play(uint32_t count, int64_t ms) {
    for (uint32_t i = 0; i < count; ++i) frontend_.AddWriter(players_[i].get(), "PLAYER", {});
    for (int64_t i = 0; i < ms; i += 5, now_ns_ += 5 * kMs) {
      for (uint32_t s = 0; s < count && i % 500 == 0; ++s) SayCamera(kSession + s);
      frontend_.Advance();
      DeliverAll(bus_);
      chooser_->Advance();
    }
  }
  void SayCamera(uint32_t session) {
    CameraInfo info;
    info.utime = now_ns_ / 1000;
    info.session = session;
    info.camera = TestCamera();
    Say(channels::kCameraInfo, wire::Encode(info));
  }

  std::unique_ptr<Follower> chooser_;
  std::vector<std::unique_ptr<StreamWriter>> players_;
};

TEST_F(ChoosingTest, TheOnlySessionIsTaken) {
  Play(1, 3000);
  EXPECT_EQ(chooser_->exit_code(), std::nullopt) << chooser_->problem();
  EXPECT_EQ(chooser_->session(), kSession);
}

TEST_F(ChoosingTest, OfTwoNoneIsGuessed) {
  Play(2, 3000);
  EXPECT_EQ(chooser_->exit_code(), kExitMisfit);
  EXPECT_EQ(chooser_->problem(),
            "two sessions are on this bus (4: player on host pid 40; 5: player on host pid 50): choose one "
            "with --session");
  EXPECT_EQ(chooser_->session(), 0U);
}

TEST_F(ChoosingTest, BeforeASessionIsChosenNothingIsForeign) {
  EXPECT_TRUE(chooser_->HearsAsForeign(kSession));
  EXPECT_EQ(chooser_->foreign(), 0);
  Play(1, 3000);
  EXPECT_TRUE(chooser_->HearsAsForeign(kSession + 1));
  EXPECT_EQ(chooser_->foreign(), 1);
}

TEST_F(SessionTest, WhoDoesNotFitTheTrueOneEnds) {
  writer_->Publish(channels::kSession, Session(settings_hash_ + 1), now_ns_);
  Pass(1000);
  EXPECT_EQ(follower_->exit_code(), kExitMisfit);
}

/// Publishes whatever it is told to.
class Publisher : public StreamNode {
 public:
  Publisher(NodeContext context, NodeOptions options)
      : StreamNode(std::move(context), std::move(options), "mapper") {}
  using StreamNode::MakeStatusHead;
  using StreamNode::PublishChange;
  using StreamNode::PublishRecord;
  const StreamWriter* writer() const { return writer_.get(); }
  bool has_more_to_tell = false;

 private:
  void Begin(const CameraInfo&) override { WantWriter({StreamId::kMap, {"collector"}, {}, nullptr}); }
  bool MayHandOver() override { return !has_more_to_tell; }
  bool WorkOnce() override { return false; }
};

/// Nodes that publish, on a bus with somebody else.
class PublisherTest : public testing::Test {
 protected:
  Publisher& Add(int64_t id, bool take_over = false, const std::vector<std::string>& peers = {"mapper"}) {
    NodeContext context;
    context.bus = &bus_.AddPort();
    context.now_ns = [this] { return now_ns_; };
    context.wall_us = [this] { return now_ns_ / 1000; };
    context.random_id = id;
    context.name = "mapper " + std::to_string(id);
    context.fresh_system = !take_over;
    NodeOptions options;
    options.session = kSession;
    options.take_over = take_over;
    options.peers = peers;
    nodes_.push_back(std::make_unique<Publisher>(context, options));
    return *nodes_.back();
  }
  void Pass(double seconds) {
    CameraInfo info;
    info.session = kSession;
    info.camera = TestCamera();
    const int64_t begin = now_ns_;
    for (const int64_t end = now_ns_ + static_cast<int64_t>(seconds * 1e9); now_ns_ < end;
         now_ns_ += 10 * kMs) {
      if ((now_ns_ - begin) % (50 * kMs) == 0)  // as a player that begins
        dmslam::Say(*other_, info);
      DeliverAll(bus_);
      for (const auto& node : nodes_) node->Advance();
    }
  }

  /// The newest one says nothing any more.
  void LoseLast() {
    gone_ = std::move(nodes_.back());
    nodes_.pop_back();
  }

  MemoryBus bus_;
  Bus* other_ = &bus_.AddPort();
  int64_t now_ns_ = kMs;
  std::vector<std::unique_ptr<Publisher>> nodes_;
  std::unique_ptr<Publisher> gone_;
};

TEST_F(PublisherTest, WhoIsAskedToLeaveEndsWellOnceTheOtherGoesOn) {
  Publisher& first = Add(7);
  Pass(1);
  Publisher& second = Add(8, true);
  Pass(10);
  EXPECT_EQ(first.exit_code(), kExitDone) << first.problem();
  ASSERT_NE(second.writer(), nullptr);
  EXPECT_EQ(second.exit_code(), std::nullopt);
}

TEST_F(PublisherTest, WhoIsAskedToLeaveTellsFirstWhatItHasToTell) {
  Publisher& first = Add(7);
  Pass(1);
  first.has_more_to_tell = true;
  Publisher& second = Add(8, true);
  Pass(10);
  EXPECT_EQ(first.exit_code(), std::nullopt);
  EXPECT_EQ(second.writer(), nullptr);
  first.has_more_to_tell = false;
  Pass(10);
  EXPECT_EQ(first.exit_code(), kExitDone) << first.problem();
  EXPECT_NE(second.writer(), nullptr);
}

/// Who asks and is not there afterwards may be somebody who forges: else nobody would write this stream.
TEST_F(PublisherTest, WhereNobodyGoesOnWithAStreamItsWriterIsToBeStartedAgain) {
  Publisher& first = Add(7);
  Pass(1);
  Add(8, true);
  for (int i = 0; i < 500 && !first.writer()->close_requested_by(); ++i) Pass(0.01);
  ASSERT_TRUE(first.writer()->close_requested_by());
  LoseLast();
  Pass(5);
  EXPECT_EQ(first.exit_code(), std::nullopt) << "it waits for who has asked";
  Pass(6);
  EXPECT_EQ(first.exit_code(), kExitSuperseded);
  EXPECT_NE(first.problem().find("mapper 8 asked for the stream"), std::string::npos) << first.problem();
}

TEST_F(PublisherTest, WhoIsAskedToEndAsWellWaitsForNobody) {
  Publisher& first = Add(7);
  Pass(1);
  Add(8, true);
  for (int i = 0; i < 500 && !first.writer()->close_requested_by(); ++i) Pass(0.01);
  LoseLast();
  first.Stop();
  Pass(0.5);
  EXPECT_EQ(first.exit_code(), kExitDone);
}

/// A change of more than a record.
MapDelta LargeChange(uint64_t version) {
  MapDelta change;
  change.event = MapEvent::kGloballyAdjusted;
  change.correction_id = 1;
  change.version = version;
  for (uint64_t i = 0; i < 100'000; ++i)
    change.landmark_positions.push_back({LandmarkId::Make(1, i + 1), {1, 2, 3}});
  return change;
}

/// The collector is expected, and does not come.
TEST_F(PublisherTest, WhatAWriterHadToForgetIsInItsStatus) {
  Publisher& publisher = Add(7, false, {"mapper", "collector"});
  Pass(0.1);
  ASSERT_NE(publisher.writer(), nullptr);
  EXPECT_EQ(publisher.MakeStatusHead("", {}).health.dropped_overflow, 0);
  for (int i = 0; i < 30; ++i) publisher.PublishChange(LargeChange(5));  // 64 MB are kept
  EXPECT_GT(publisher.MakeStatusHead("", {}).health.dropped_overflow, 0);
}

TEST_F(PublisherTest, ARecordAboveTheBoundIsRefusedAndAChangeIsSplit) {
  Publisher& publisher = Add(7);
  Pass(0.1);
  ASSERT_NE(publisher.writer(), nullptr);
  const MapDelta change = LargeChange(5);
  ASSERT_GT(wire::Encode(change).size(), wire::kMaxRecordBytes);
  EXPECT_EQ(publisher.PublishRecord(change), 0) << "nothing is published";
  EXPECT_EQ(publisher.writer()->last_seq(), 0);
  EXPECT_EQ(publisher.PublishChange(change), 4);
  EXPECT_EQ(publisher.writer()->last_seq(), 4);
}

}  // namespace
}  // namespace dmslam
