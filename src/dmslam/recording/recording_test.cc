#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/map/snapshot.h"
#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/recording/log_index.h"
#include "dmslam/recording/log_version.h"
#include "dmslam/recording/map_file.h"
#include "dmslam/recording/recorded_frames.h"
#include "dmslam/util/check.h"
#include "dmslam/util/random.h"
#include "dmslam/util/testing/small_disk.h"
#include "dmslam/util/version.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

constexpr uint32_t kSession = 7;

FeatureSet RandomFeatures(Random& random, size_t count) {
  FeatureSet set;
  for (size_t i = 0; i < count; ++i) {
    set.keypoints.push_back({static_cast<uint16_t>(random.Below(640 * 16)),
                             static_cast<uint16_t>(random.Below(480 * 16)),
                             static_cast<uint8_t>(random.Below(8)), static_cast<uint8_t>(random.Below(256))});
    Descriptor descriptor;
    for (uint64_t& word : descriptor.words) word = random.Next();
    set.descriptors.push_back(descriptor);
  }
  return set;
}

/// A mapper that makes one keyframe with landmarks per step, moves and removes others, and hands out a delta
/// each.
class TinyMapper {
 public:
  TinyMapper() : map_(TestCamera(), Pyramid()) {}

  MapDelta Step() {
    const KeyframeId id = KeyframeId::Make(kSession, ++frame_);
    Keyframe keyframe;
    keyframe.id = id;
    keyframe.map_id = 1;
    keyframe.stamp_ns = frame_ * 1'000'000'000LL;
    if (frame_ > 1) keyframe.parent = KeyframeId::Make(kSession, 1);
    keyframe.T_cam_world.translation = {random_.Gaussian(), random_.Gaussian(), random_.Gaussian()};
    keyframe.features = MakeFrameFeatures(RandomFeatures(random_, 20), TestCamera(), Pyramid());
    const auto num_features = static_cast<uint16_t>(keyframe.features->size());
    map_.AddKeyframe(std::move(keyframe));
    for (uint16_t i = 0; i < num_features; ++i) AddLandmark(id, i);
    map_.SetPosition(map_.At(LandmarkId::Make(1, 1 + random_.Below(10))), Eigen::Vector3d::Random());
    map_.SetPose(map_.At(KeyframeId::Make(kSession, 1)),
                 Rigid3d(Eigen::Quaterniond::UnitRandom(), Eigen::Vector3d::Random()));
    if (frame_ == 5) map_.RemoveKeyframe(map_.At(KeyframeId::Make(kSession, 3)));
    if (frame_ == 6) map_.Fuse(map_.At(LandmarkId::Make(1, 15)), map_.At(LandmarkId::Make(1, 16)), {});
    return map_.TakeDelta(MapEvent::kMapped, id, 1);
  }
  const Map& map() const { return map_; }

 private:
  void AddLandmark(KeyframeId id, uint16_t feature) {
    Landmark landmark;
    landmark.id = LandmarkId::Make(1, ++landmarks_);
    landmark.map_id = 1;
    landmark.p_world = Eigen::Vector3d::Random();
    landmark.reference = landmark.first_keyframe = id;
    map_.AddLandmark(landmark);
    map_.SetObservation(map_.At(id), feature, map_.At(landmark.id));
    if (frame_ > 1)
      map_.SetObservation(map_.At(KeyframeId::Make(kSession, 1)), feature, map_.At(landmark.id));
    map_.UpdateDescriptor(map_.At(landmark.id));
  }

  Random random_{3};
  MapEditor map_;
  uint32_t frame_ = 0;
  uint64_t landmarks_ = 0;
};

std::vector<Bytes> Content(const Map& map) {
  std::vector<Bytes> content;
  for (const MapDelta& delta : CutSnapshot(map, {}, SIZE_MAX)) content.push_back(wire::Encode(delta));
  return content;
}

class Recording : public testing::Test {
 protected:
  void SetUp() override {
    path_ =
        std::filesystem::temp_directory_path() / ("recording_test_" + std::to_string(getpid()) + ".lcmlog");
  }
  void TearDown() override {
    std::filesystem::remove(path_);
    std::filesystem::remove(path_ + ".map");
    std::filesystem::remove(path_ + ".map2");
  }

  static RecordHeader Header(StreamId stream, int64_t seq, Term term = {100, 5}, Version parent = {}) {
    RecordHeader header{};
    header.session = kSession;
    header.stream = static_cast<int32_t>(stream);
    header.flags = parent.empty() ? RecordHeader::FLAG_FRESH : 0;
    header.epoch = term.epoch;
    header.writer = term.writer;
    header.seq = seq;
    header.parent_epoch = parent.epoch;
    header.parent_seq = parent.seq;
    return header;
  }
  template <typename Message>
  static std::pair<std::string, Bytes> Sealed(const Message& message, const RecordHeader& header) {
    std::pair<std::string, Bytes> sealed{wire::Info<Message>().channel, wire::Encode(message)};
    Seal(header, sealed.first, sealed.second);
    return sealed;
  }
  template <typename Message>
  void WriteRecord(EventLogWriter& log, int64_t utime_us, const Message& message,
                   const RecordHeader& header) {
    const auto [channel, bytes] = Sealed(message, header);
    log.Write(utime_us, prefix_ + channel, bytes);
  }
  /// A map of some keyframes, saved; its bytes.
  std::string Saved(int keyframes) const {
    TinyMapper mapper;
    for (int i = 0; i < keyframes; ++i) mapper.Step();
    SessionStart start;
    start.session = kSession;
    start.camera = TestCamera();
    SaveMap(path_ + ".map", mapper.map(), start);
    const std::vector<uint8_t> bytes = ReadFileBytes(path_ + ".map");
    return {bytes.begin(), bytes.end()};
  }
  void WriteSession(EventLogWriter& log) {
    SessionStart start;
    start.session = kSession;
    start.camera = TestCamera();
    start.sequence = "test";
    WriteRecord(log, 1, start, Header(StreamId::kFrontend, 1));
  }
  /// A record in parts, the last one first.
  static void WriteParts(EventLogWriter& log, int64_t utime_us, const MapDelta& delta,
                         const RecordHeader& header) {
    const auto [channel, bytes] = Sealed(delta, header);
    Bytes payload(channel.begin(), channel.end());
    payload.push_back(0);
    payload.insert(payload.end(), bytes.begin(), bytes.end());
    constexpr size_t kPart = 1000;
    for (size_t i = (payload.size() + kPart - 1) / kPart; i-- > 0;) {
      part_t part{};
      part.stream_key = StreamKey(kSession, StreamId::kMap, {header.epoch, header.writer}, 0);
      part.seq = header.seq;
      part.total_bytes = static_cast<int32_t>(payload.size());
      part.offset = static_cast<int32_t>(i * kPart);
      part.data.assign(payload.begin() + part.offset,
                       payload.begin() + static_cast<ptrdiff_t>(std::min(payload.size(), (i + 1) * kPart)));
      part.num_bytes = static_cast<int32_t>(part.data.size());
      log.Write(utime_us, PartChannel("MAPPER"), EncodePart(part));
    }
  }

  std::string path_, prefix_;
};

TEST_F(Recording, TheMapIsThatOfTheMapperAtAnyTime) {
  prefix_ = "robot2/";
  TinyMapper mapper;
  EventLogWriter log(path_);
  WriteSession(log);
  std::vector<std::vector<Bytes>> then;
  for (int64_t seq = 1; seq <= 8; ++seq) {
    WriteRecord(log, 1000 * seq, mapper.Step(), Header(StreamId::kMap, seq));
    then.push_back(Content(mapper.map()));
  }
  log.Close();
  const LogIndex index(path_);
  EXPECT_EQ(index.DescribeDamage(), "");
  for (int64_t seq = 1; seq <= 8; ++seq) {
    const RebuiltMap rebuilt = RebuildMap(index, index.Session(), 1000 * seq + 500);
    EXPECT_EQ(Content(rebuilt.map), then[static_cast<size_t>(seq - 1)]) << seq;
    EXPECT_EQ(rebuilt.records, seq);
    EXPECT_EQ(rebuilt.missing, 0);
  }
  EXPECT_THROW(RebuildMap(index, index.Session(), 10), InputError);
  EXPECT_THROW(index.Session(8), InputError);
}

TEST_F(Recording, RecordsMayComeInPartsTwiceAndInAnyOrder) {
  TinyMapper mapper;
  std::vector<MapDelta> deltas;
  for (int i = 0; i < 6; ++i) deltas.push_back(mapper.Step());
  EventLogWriter log(path_);
  for (const size_t i : {1u, 0u, 3u, 1u, 5u})
    WriteRecord(log, 1, deltas[i], Header(StreamId::kMap, static_cast<int64_t>(i) + 1));
  WriteParts(log, 2, deltas[4], Header(StreamId::kMap, 5));
  WriteParts(log, 3, deltas[2], Header(StreamId::kMap, 3));
  WriteParts(log, 3, deltas[2], Header(StreamId::kMap, 3));
  WriteSession(log);
  log.Close();
  const LogIndex index(path_);
  const RebuiltMap rebuilt = RebuildMap(index, index.Session());
  EXPECT_EQ(rebuilt.records, 6);
  EXPECT_EQ(rebuilt.missing, 0);
  EXPECT_EQ(Content(rebuilt.map), Content(mapper.map()));
}

TEST_F(Recording, ATermCountsUpToWhereTheNextOneTookItOver) {
  TinyMapper first;
  std::vector<MapDelta> deltas;
  for (int i = 0; i < 8; ++i) deltas.push_back(first.Step());
  const Term one{100, 5}, two{200, 3};
  EventLogWriter log(path_);
  WriteSession(log);
  for (int64_t seq = 1; seq <= 5; ++seq)
    WriteRecord(log, seq, deltas[static_cast<size_t>(seq - 1)], Header(StreamId::kMap, seq, one));
  // The second continues (100, 4): the fifth record of the first one is void.
  TinyMapper other;
  for (int i = 0; i < 4; ++i) other.Step();
  MapEditor expected(other.map());
  expected.SetPosition(expected.At(LandmarkId::Make(1, 1)), {9, 9, 9});
  WriteRecord(log, 10, expected.TakeDelta(MapEvent::kAdjusted, KeyframeId::Make(1, 0), 1),
              Header(StreamId::kMap, 1, two, {100, 4}));
  log.Close();
  const LogIndex index(path_);
  const RebuiltMap rebuilt = RebuildMap(index, index.Session());
  EXPECT_EQ(rebuilt.records, 5);
  EXPECT_EQ(rebuilt.map.keyframes().size(), expected.keyframes().size());
  EXPECT_EQ(rebuilt.map.FindLandmark(LandmarkId::Make(1, 1))->p_world, Eigen::Vector3d(9, 9, 9));
  EXPECT_EQ(RebuildMap(index, index.Session(), 5).records, 5);
  std::vector<MapEvent> changes;
  size_t of_the_first = 0;
  ChangeReader reader;
  reader.change = [&](const MapDelta& delta) { changes.push_back(delta.event); };
  reader.new_writer = [&] { of_the_first = changes.size(); };
  EXPECT_EQ(ForEachChange(index, index.Session(), INT64_MAX, reader).records, 5);
  EXPECT_EQ(changes.size(), 5u);
  EXPECT_EQ(changes.back(), MapEvent::kAdjusted);
  EXPECT_EQ(of_the_first, 4u) << "the second writer is told before what it wrote";
}

TEST_F(Recording, ASnapshotMakesUpForWhatIsMissing) {
  TinyMapper mapper;
  EventLogWriter log(path_);
  WriteSession(log);
  for (int64_t seq = 1; seq <= 8; ++seq) {
    const MapDelta delta = mapper.Step();
    if (seq != 2) WriteRecord(log, seq, delta, Header(StreamId::kMap, seq));
    if (seq != 5) continue;
    const std::vector<MapDelta> pieces = CutSnapshot(mapper.map(), {}, 3000);
    ASSERT_GT(pieces.size(), 2u);
    for (size_t i = 0; i < pieces.size(); ++i) {
      RecordHeader header = Header(StreamId::kMap, static_cast<int64_t>(i) + 1);
      header.flags = RecordHeader::FLAG_SNAPSHOT;
      if (i + 1 == pieces.size()) header.flags |= RecordHeader::FLAG_SNAPSHOT_LAST;
      header.parent_epoch = 1;
      header.parent_seq = seq;
      WriteRecord(log, seq, pieces[i], header);
    }
  }
  log.Close();
  const LogIndex index(path_);
  const RebuiltMap rebuilt = RebuildMap(index, index.Session());
  EXPECT_EQ(rebuilt.missing, 0);
  EXPECT_EQ(Content(rebuilt.map), Content(mapper.map()));
  EXPECT_EQ(RebuildMap(index, index.Session(), 4).missing, 1) << "before the snapshot";
}

TEST_F(Recording, ADamagedLogGivesWhatIsLeft) {
  TinyMapper mapper;
  EventLogWriter log(path_);
  WriteSession(log);
  for (int64_t seq = 1; seq <= 8; ++seq) WriteRecord(log, seq, mapper.Step(), Header(StreamId::kMap, seq));
  log.Close();
  const auto size = std::filesystem::file_size(path_);
  {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(size / 2));
    file << "xx";
  }
  std::filesystem::resize_file(path_, size - 100);
  const LogIndex index(path_);
  const RebuiltMap rebuilt = RebuildMap(index, index.Session());
  EXPECT_EQ(rebuilt.missing, 1);  // one by its checksum; of the one that was cut off nobody knows
  EXPECT_EQ(rebuilt.records, 6);
  EXPECT_EQ(rebuilt.map.keyframes().size(), 6u);  // the third one was to go with the record that is damaged
  EXPECT_NE(index.DescribeDamage().find("its end"), std::string::npos);
  EXPECT_NE(index.DescribeDamage().find("1 messages hold wrong bytes"), std::string::npos);
}

TEST_F(Recording, ASavedMapIsTheMap) {
  TinyMapper mapper;
  for (int i = 0; i < 7; ++i) mapper.Step();
  SessionStart start;
  start.session = kSession;
  start.camera = TestCamera();
  start.sequence = "test";
  SaveMap(path_ + ".map", mapper.map(), start);
  const RebuiltMap loaded = LoadMap(path_ + ".map");
  EXPECT_EQ(Content(loaded.map), Content(mapper.map()));
  EXPECT_EQ(loaded.session.sequence, "test");
  SaveMap(path_ + ".map2", loaded.map, loaded.session);
  EXPECT_EQ(ReadFileBytes(path_ + ".map"), ReadFileBytes(path_ + ".map2"));
  EXPECT_EQ(NewestSession(loaded.map), kSession);
  EXPECT_EQ(NewestOrdinal(loaded.map), 1);
  EXPECT_EQ(LargestMap(loaded.map), 1u);
  EXPECT_FALSE(LargestMap(Map(TestCamera(), Pyramid())).has_value());
  CheckFits("map", loaded.session, TestCamera(), Pyramid());
  Camera other = TestCamera();
  other.fx_px = 501;
  EXPECT_THROW(CheckFits("map", loaded.session, other, Pyramid()), InputError);
  Pyramid coarse;
  coarse.levels = 4;
  EXPECT_THROW(CheckFits("map", loaded.session, TestCamera(), coarse), InputError);
  EXPECT_THROW(SaveMap(path_ + ".map", Map(TestCamera(), Pyramid()), start), InputError);
}

TEST_F(Recording, ASavedMapTellsTheRunsOfWhichItIsMade) {
  TinyMapper mapper;
  mapper.Step();
  SessionStart own, former;
  own.session = kSession;
  former.session = 3;
  own.camera = former.camera = TestCamera();
  own.seed = 11, own.configuration_hash = 0xabc;
  former.seed = 12, former.configuration_hash = 0xdef;
  SaveMap(path_ + ".map", mapper.map(), own);
  const RebuiltMap alone = LoadMap(path_ + ".map");
  ASSERT_EQ(alone.runs.size(), 1u);
  EXPECT_EQ(alone.runs.at(kSession).seed, 11u);

  SessionStart later = own;
  later.session = 9;
  SaveMap(path_ + ".map", mapper.map(), later, {{3, former}, {kSession, own}});
  const RebuiltMap both = LoadMap(path_ + ".map");
  ASSERT_EQ(both.runs.size(), 2u);
  EXPECT_EQ(both.runs.at(3).seed, 12u);
  EXPECT_EQ(both.runs.at(3).configuration_hash, 0xdefu);
  EXPECT_EQ(both.runs.at(kSession).seed, 11u);
  EXPECT_EQ(both.session.session, 9u);
  SaveMap(path_ + ".map2", both.map, both.session, both.runs);
  EXPECT_EQ(ReadFileBytes(path_ + ".map"), ReadFileBytes(path_ + ".map2"));

  std::vector<uint8_t> bytes = ReadFileBytes(path_ + ".map2");
  const std::string channel = kLogRunChannel;
  const auto told = std::search(bytes.begin(), bytes.end(), channel.begin(), channel.end());
  ASSERT_NE(told, bytes.end());
  told[200] ^= 1U;
  std::ofstream(path_ + ".map2", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  EXPECT_THROW(LoadMap(path_ + ".map2"), InputError) << "damaged";

  SaveMap(path_ + ".map", mapper.map(), later, {});
  EXPECT_TRUE(LoadMap(path_ + ".map").runs.empty()) << "nobody says that it is of session 9";
}

/// Why the map is not loaded; empty where it is.
std::string WhyNotLoaded(const std::string& path) {
  try {
    LoadMap(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST_F(Recording, AMapBesideAnotherVocabularyIsNamed) {
  SessionStart made;
  EXPECT_EQ(WhyOtherVocabulary("a.map", made, 0xabc), "");
  made.vocabulary_checksum = 0xabc;
  EXPECT_EQ(WhyOtherVocabulary("a.map", made, std::nullopt), "");
  EXPECT_EQ(WhyOtherVocabulary("a.map", made, 0xabc), "");
  EXPECT_EQ(WhyOtherVocabulary("a.map", made, 0xdef),
            "a.map: was made with another vocabulary (checksum 0000000000000abc) than the one in use "
            "(0000000000000def); give its own with --vocabulary");
}

TEST_F(Recording, SeveralSavedMapsInOneFileAreNamedAndEachCanBeTakenOut) {
  TinyMapper mapper;
  mapper.Step();
  SessionStart start;
  start.camera = TestCamera();
  std::string both;
  for (const uint32_t session : {5, 11}) {
    start.session = session;
    SaveMap(path_ + ".map", mapper.map(), start);
    std::ifstream file(path_ + ".map", std::ios::binary);
    both.append(std::istreambuf_iterator<char>(file), {});
  }
  const std::string path = path_ + ".map2";
  std::ofstream(path, std::ios::binary) << both;
  EXPECT_EQ(WhyNotLoaded(path), path +
                                    ": is several saved maps in one file (of the sessions 5, 11); give each "
                                    "by itself: dmslam-map --map " +
                                    path + " --log-session SESSION --save FILE takes one out");
  const LogIndex log(path);
  for (const uint32_t session : {5, 11}) {
    const RebuiltMap map = RebuildMap(log, log.Session(session));
    EXPECT_EQ(map.session.session, session);
    EXPECT_EQ(Content(map.map), Content(mapper.map()));
  }
}

TEST_F(Recording, HalfASavedMapIsRefusedByName) {
  TinyMapper mapper;
  for (int i = 0; i < 60; ++i) mapper.Step();
  SessionStart start;
  start.session = kSession;
  start.camera = TestCamera();
  const std::string map = path_ + ".map", part = path_ + ".map2";
  SaveMap(map, mapper.map(), start);
  EXPECT_EQ(WhyNotLoaded(map), "");
  const std::vector<uint8_t> whole_bytes = ReadFileBytes(map);
  const std::string whole(whole_bytes.begin(), whole_bytes.end());
  const auto write = [&](const std::string& bytes) { std::ofstream(part, std::ios::binary) << bytes; };
  // Wherever it was cut off, the last byte included.
  for (size_t size = whole.size() / 16; size < whole.size(); size += whole.size() / 16) {
    write(whole.substr(0, size));
    EXPECT_NE(WhyNotLoaded(part), "") << size << " of " << whole.size() << " bytes";
  }
  write(whole.substr(0, whole.size() - 1));
  EXPECT_NE(WhyNotLoaded(part).find("is not whole: 1 of the "), std::string::npos) << WhyNotLoaded(part);
  // A block in the middle that was lost.
  std::string damaged = whole;
  std::fill_n(damaged.begin() + static_cast<std::ptrdiff_t>(whole.size() / 2), 4096, '\0');
  write(damaged);
  EXPECT_NE(WhyNotLoaded(part).find("is not whole"), std::string::npos) << WhyNotLoaded(part);
}

/// Where the events of a log begin, and its end.
std::vector<size_t> EventOffsets(const std::string& path) {
  std::vector<size_t> offsets;
  EventLogReader log(path);
  while (const auto event = log.Next()) offsets.push_back(static_cast<size_t>(event->offset));
  offsets.push_back(static_cast<size_t>(log.size()));
  return offsets;
}

TEST_F(Recording, ADamagedHeadIsRefusedHoweverMuchOfTheSavedMapIsThere) {
  const std::string whole = Saved(60), part = path_ + ".map2";
  const std::vector<size_t> events = EventOffsets(path_ + ".map");
  ASSERT_GT(events.size(), 5u);
  const auto why = [&](std::string bytes, size_t at) {
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    std::ofstream(part, std::ios::binary) << bytes;
    return WhyNotLoaded(part);
  };
  // Its number and time are what lcm-logger says of it; behind those each byte of the first message counts.
  for (size_t at = 20; at < events[1]; ++at) {
    EXPECT_NE(why(whole, at).find(part + ": is damaged: its first message, which says how many records"),
              std::string::npos)
        << at << ": " << why(whole, at);
    EXPECT_NE(why(whole.substr(0, events[events.size() / 2]), at), "") << at << ", and half of it is gone";
  }
  // So it does of session_t, the camera and all.
  for (size_t at = events[1] + 20; at < events[2]; at += 3) {
    EXPECT_NE(why(whole, at).find(part + ": is damaged: session_t, which says with which camera"),
              std::string::npos)
        << at << ": " << why(whole, at);
  }
  std::ofstream(part, std::ios::binary) << whole.substr(events[1]);
  EXPECT_NE(WhyNotLoaded(part).find("is damaged: its first message"), std::string::npos) << "it is gone";
}

/// The messages of the log `from`, with `edit` done to each.
void CopyLog(const std::string& from, const std::string& to, const std::function<void(LogEvent*)>& edit) {
  EventLogReader reader(from);
  EventLogWriter writer(to);
  while (auto event = reader.Next()) {
    edit(&*event);
    writer.Write(event->utime_us, event->channel, event->bytes);
  }
  writer.Close();
}

TEST_F(Recording, ASavedMapOfAnotherVersionIsRefusedByNameEvenIfItsRecordsCanBeRead) {
  Saved(3);
  const std::string from = path_ + ".map", to = path_ + ".map2";
  const auto edit_head = [](const std::function<void(head_t*)>& edit) {
    return [edit](LogEvent* event) {
      auto head = DecodeHead(event->channel, event->bytes);
      if (!head) return;
      edit(&*head);
      event->bytes = *SealedMessage(event->channel, *head).bytes;
    };
  };
  CopyLog(from, to, edit_head([](head_t*) {}));
  EXPECT_EQ(WhyNotLoaded(to), "");
  const std::string ours = std::to_string(kProtocolVersion), newer = std::to_string(kProtocolVersion + 1);
  const std::string refusal =
      to + ": was written with protocol " + newer + ", this program speaks " + ours + ": ";
  CopyLog(from, to, edit_head([](head_t* head) { head->protocol_version = kProtocolVersion + 1; }));
  EXPECT_EQ(WhyNotLoaded(to).find(refusal), 0u) << WhyNotLoaded(to);
  CopyLog(from, to, edit_head([](head_t* head) { head->schema_hash ^= 1; }));
  EXPECT_NE(WhyNotLoaded(to).find(": was written with message types "), std::string::npos)
      << WhyNotLoaded(to);
  CopyLog(from, to, [](LogEvent* event) {
    auto start = wire::Decode<SessionStart>(event->bytes);
    if (!start) return;
    start->protocol_version = kProtocolVersion + 1;
    const RecordHeader header = *ParseHeader(event->bytes);
    event->bytes = wire::Encode(*start);
    Seal(header, event->channel, event->bytes);
  });
  EXPECT_EQ(WhyNotLoaded(to).find(refusal), 0u) << WhyNotLoaded(to);
}

TEST_F(Recording, ARecordOfASavedMapThatCannotBeIsNamedWithItsKeyframe) {
  Saved(3);
  const std::string from = path_ + ".map", to = path_ + ".map2";
  CopyLog(from, to, [](LogEvent* event) {
    auto delta = wire::Decode<MapDelta>(event->bytes);
    if (!delta || delta->keyframes.empty()) return;
    const RecordHeader header = *ParseHeader(event->bytes);
    delta->keyframes.back().scale = 1.25;
    event->bytes = wire::Encode(*delta);
    const Bytes scale = {0x3f, 0xf4, 0, 0, 0, 0, 0, 0}, none = {0x7f, 0xf8, 0, 0, 0, 0, 0, 0};
    const auto at = std::search(event->bytes.begin(), event->bytes.end(), scale.begin(), scale.end());
    ASSERT_NE(at, event->bytes.end());
    std::copy(none.begin(), none.end(), at);
    Seal(header, event->channel, event->bytes);
  });
  const std::string why = WhyNotLoaded(to);
  EXPECT_EQ(
      why.find(to + ": is damaged: 1 records of the saved map cannot be decoded (map_record_t: scale of a "
                    "keyframe out of range (frame "),
      0u)
      << why;
  EXPECT_NE(why.find(" of session 7))"), std::string::npos) << why;
}

TEST_F(Recording, AFolderThatIsNotThereIsNamed) {
  const std::string folder = path_ + "_nowhere";
  const auto why = [](const std::function<void()>& write) -> std::string {
    try {
      write();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  TinyMapper mapper;
  mapper.Step();
  SessionStart start;
  start.session = kSession;
  start.camera = TestCamera();
  EXPECT_EQ(why([&] { SaveMap(folder + "/a.map", mapper.map(), start); }),
            folder + ": no such folder, so a.map cannot be written there; make it, or choose another folder");
  EXPECT_EQ(
      why([&] { EventLogWriter log(folder + "/run.lcmlog"); }),
      folder + ": no such folder, so run.lcmlog cannot be written there; make it, or choose another folder");
}

TEST_F(Recording, AFullDiskLeavesTheFormerMapAndNoHalfOne) {
  Saved(3);
  const std::string path = path_ + ".map";
  TinyMapper mapper;
  for (int i = 0; i < 50; ++i) mapper.Step();
  SessionStart start;
  start.session = kSession;
  start.camera = TestCamera();
  std::string why;
  {
    const SmallDisk disk(10'000);
    try {
      SaveMap(path, mapper.map(), start);
    } catch (const InputError& error) {
      why = error.what();
    }
  }
  EXPECT_NE(why.find("cannot be written; is the disk full?"), std::string::npos) << why;
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  EXPECT_EQ(LoadMap(path).map.keyframes().size(), 3u) << "the former one is there";
}

TEST_F(Recording, ALogThatNamesNoCameraSaysTheCure) {
  TinyMapper mapper;
  EventLogWriter log(path_);
  WriteRecord(log, 1, mapper.Step(), Header(StreamId::kMap, 1));
  log.Close();
  EXPECT_NE(WhyNotLoaded(path_).find("does not say which camera the map was made with; record the frontend"),
            std::string::npos)
      << WhyNotLoaded(path_);
}

TEST_F(Recording, WhatDoesNotFitAMapIsNamed) {
  Saved(3);
  const RebuiltMap loaded = LoadMap(path_ + ".map");
  EXPECT_EQ(MadeWith(path_ + ".map").camera, TestCamera());
  const auto why = [](const std::function<void()>& check) -> std::string {
    try {
      check();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  Camera other = TestCamera();
  other.fx_px = 510.25;
  EXPECT_EQ(
      why([&] { CheckFits("a.map", loaded.session, other, Pyramid()); }),
      "a.map: was made with fx 500, the camera that plays has fx 510.25: give the camera file of that map");
  EXPECT_EQ(why([&] { CheckSessionIsNew("a.map", loaded.map, kSession + 1); }), "");
  EXPECT_EQ(why([&] { CheckSessionIsNew("a.map", loaded.map, kSession); }),
            "a.map: holds keyframes of session 7; give all processes a higher one with --session");
  SessionStart made;
  made.vocabulary_checksum = 0xabc;
  CheckVocabulary("a.map", made, 0xabc);
  EXPECT_THROW(CheckVocabulary("a.map", made, 0xdef), MisfitError);
}

/// What a camera's player publishes of itself, and of a frame of 2 x 1 pixels.
void WriteCameraInfo(EventLogWriter& log, const std::string& sequence, CameraId camera = 0) {
  CameraInfo info;
  info.session = kSession;
  info.camera_id = camera;
  info.camera = TestCamera();
  info.sequence = sequence;
  log.Write(1, ChannelOfCamera(channels::kCameraInfo, camera), wire::Encode(info));
}
void WriteFrame(EventLogWriter& log, uint32_t index, CameraId camera = 0) {
  Frame frame;
  frame.session = kSession;
  frame.camera_id = camera;
  frame.frame_index = index;
  frame.stamp_ns = 1000 * index;
  frame.encoding = FrameEncoding::kGray8;
  frame.width_px = 2;
  frame.height_px = 1;
  frame.data = {static_cast<uint8_t>(index), static_cast<uint8_t>(7 + camera)};
  log.Write(index, ChannelOfCamera(channels::kFrame, camera), wire::Encode(frame));
}

TEST_F(Recording, FramesKeepTheirIndicesAndBytes) {
  EventLogWriter log(path_);
  WriteCameraInfo(log, "test");
  for (const uint32_t index : {5u, 6u, 6u, 9u}) WriteFrame(log, index);
  log.Write(10, channels::kGroundTruthPose, wire::Encode(GroundTruthPose{kSession, 6, 6000, Rigid3d()}));
  log.Close();
  RecordedFrames frames(std::make_shared<const LogIndex>(path_), 0);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames.FrameIndex(1), 6u);
  EXPECT_EQ(frames.StampNs(2), 9000);
  const EncodedImage image = frames.Read(2);
  EXPECT_EQ(image.encoding, ImageEncoding::kGray8);
  EXPECT_EQ(image.bytes, (std::vector<uint8_t>{9, 7}));
  EXPECT_EQ(frames.GroundTruth().size(), 1u);
  EXPECT_EQ(frames.camera_info().sequence, "test");
  EXPECT_EQ(RecordedFrames(std::make_shared<const LogIndex>(path_), 0, 1).size(), 3u) << "the only ones";
}

TEST_F(Recording, EachOfSeveralCamerasHasItsFrames) {
  EventLogWriter log(path_);
  WriteCameraInfo(log, "first");
  WriteCameraInfo(log, "second", 1);
  for (const uint32_t index : {0u, 1u, 2u}) WriteFrame(log, index);
  for (const uint32_t index : {0u, 1u}) WriteFrame(log, index, 1);
  log.Close();
  const auto index = std::make_shared<const LogIndex>(path_);
  EXPECT_EQ(RecordedFrames(index, 0).size(), 3u);
  RecordedFrames second(index, 0, 1);
  ASSERT_EQ(second.size(), 2u);
  EXPECT_EQ(second.camera_info().sequence, "second");
  EXPECT_EQ(second.Read(1).bytes, (std::vector<uint8_t>{1, 8}));
  try {
    const RecordedFrames third(index, 0, 2);
    FAIL() << "a camera that is not in it";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("no frames of camera 2 but of 0, 1"), std::string::npos);
  }
}

TEST_F(Recording, TheRecordsOfEachCamerasFrontendAreAStreamOfTheirOwn) {
  EventLogWriter log(path_);
  WriteSession(log);
  for (const CameraId camera : {0u, 2u}) {
    FramePose pose;
    pose.frame_index = 4;
    pose.camera_id = camera;
    const std::string channel = ChannelOfCamera(channels::kFramePose, camera);
    Bytes bytes = wire::Encode(pose);
    Seal(Header(StreamOfCamera(StreamId::kFrontend, camera), 2), channel, bytes);
    log.Write(2, channel, bytes);
  }
  log.Close();
  const LogIndex index(path_);
  EXPECT_EQ(index.bad_messages(), 0);
  const RecordedSession& session = index.Session();
  EXPECT_EQ(session.CamerasWithFrontend(), (std::vector<CameraId>{0, 2}));
  const RecordedStream& stream = session.Stream(StreamOfCamera(StreamId::kFrontend, 2));
  ASSERT_EQ(stream.size(), 1u);
  const RecordedMessage& record = stream.begin()->second.records.at(2);
  EXPECT_EQ(wire::Decode<FramePose>(index.Read(record))->camera_id, 2u);
}

TEST_F(Recording, OtherLogsAreRefused) {
  EventLogWriter log(path_);
  log.Write(1, "SOMETHING", Bytes(5));
  log.Close();
  EXPECT_THROW(LogIndex{path_}, InputError);
}

/// What LogIndex says of a log that it refuses.
std::string Refusal(const std::string& path) {
  try {
    const LogIndex index(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "not refused";
}

TEST_F(Recording, ALogOfTheFormerVersionIsNamedAndNotCalledDamaged) {
  Bytes record = {0x60, 0x59, 0x4f, 0x88, 0xdd, 0x67, 0xaf, 0x37};  // map_record_t of version 0.1
  record.resize(200);
  Bytes camera = {0xb0, 0xcb, 0x92, 0xb2, 0x85, 0x4c, 0x49, 0x0f};
  camera.resize(100);
  EventLogWriter log(path_);
  log.Write(1, channels::kCameraInfo, camera);
  log.Write(2, channels::kMap, record);
  log.Close();
  EXPECT_EQ(Refusal(path_), path_ + ": recorded by version 0.1; this is version " + kVersion +
                                ", which cannot read it; use version 0.1, or record it again");
  // Beside messages of now they are counted apart from what is damaged.
  TinyMapper mapper;
  EventLogWriter both(path_);
  WriteSession(both);
  both.Write(2, channels::kMap, record);
  WriteRecord(both, 3, mapper.Step(), Header(StreamId::kMap, 1));
  both.Close();
  const LogIndex index(path_);
  EXPECT_EQ(index.DescribeDamage(), path_ + ": 1 messages are of version 0.1 and were left out");
  EXPECT_EQ(RebuildMap(index, index.Session()).records, 1);
}

TEST_F(Recording, TheBeaconNamesAVersionThatIsNotKnownYet) {
  head_t head{};
  head.header = Header(StreamId::kMap, 0);
  head.first_seq = 1;
  head.protocol_version = kProtocolVersion + 1;
  const Outgoing beacon = SealedMessage(HeadChannel("MAPPER"), head);
  Bytes record = wire::Encode(TinyMapper().Step());
  record[0] ^= 1;  // a type that this version does not know
  Seal(Header(StreamId::kMap, 1), channels::kMap, record);
  EventLogWriter log(path_);
  log.Write(1, "robot2/" + beacon.channel, *beacon.bytes);
  log.Write(2, "robot2/" + std::string(channels::kMap), record);
  log.Close();
  EXPECT_NE(
      Refusal(path_).find("recorded by a version with protocol " + std::to_string(kProtocolVersion + 1)),
      std::string::npos)
      << Refusal(path_);
}

TEST_F(Recording, ASavedMapBeginsWithABeacon) {
  TinyMapper mapper;
  mapper.Step();
  SessionStart start;
  start.session = kSession;
  start.camera = TestCamera();
  start.software = "0.0.1";
  SaveMap(path_, mapper.map(), start);
  EventLogReader log(path_);
  const std::optional<LogEvent> first = log.Next();
  ASSERT_TRUE(first.has_value());
  const std::optional<head_t> head = DecodeHead(first->channel, first->bytes);
  ASSERT_TRUE(head.has_value());
  EXPECT_EQ(head->protocol_version, kProtocolVersion);
  EXPECT_EQ(LoadMap(path_).session.software, kVersion) << "who saves it has written it";
}

TEST_F(Recording, AGroupOfRecordsIsAppliedAsOneOrNotAtAll) {
  TinyMapper mapper;
  MapDelta whole = mapper.Step();
  MapDelta keyframes = whole, landmarks = whole;
  keyframes.group = {9, 0, 2};
  keyframes.landmarks.clear(), keyframes.observations.clear();
  landmarks.group = {9, 1, 2};
  landmarks.keyframes.clear();
  for (const bool is_whole : {true, false}) {
    EventLogWriter log(path_);
    WriteSession(log);
    WriteRecord(log, 1, keyframes, Header(StreamId::kMap, 1));
    if (is_whole) WriteRecord(log, 2, landmarks, Header(StreamId::kMap, 2));
    log.Close();
    const LogIndex index(path_);
    const RebuiltMap rebuilt = RebuildMap(index, index.Session());
    EXPECT_EQ(rebuilt.missing, is_whole ? 0 : 1);
    EXPECT_EQ(rebuilt.map.keyframes().size(), is_whole ? 1U : 0U);
    if (is_whole) {
      EXPECT_EQ(Content(rebuilt.map), Content(mapper.map()));
    }
  }
}

}  // namespace
}  // namespace dmslam
