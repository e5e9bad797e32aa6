#include "message_docs.h"

#include <array>
#include <map>
#include <set>
#include <sstream>
#include <vector>

#include "dmslam/messaging/keyed_bus.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/messaging/types.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/codec.h"
#include "dmslam/wire/schema.h"
#include "dmslam/wire/streams.h"

namespace dmslam {
namespace {

using wire::Constant;
using wire::Field;
using wire::Schema;
using wire::StructType;

/// What a message definition does not say.
struct ChannelRow {
  std::string channel;
  std::string type;
  std::string owner;
  std::string readers;
  std::string rate;
};

template <typename Message>
ChannelRow Row(const char* owner, const char* readers, const char* rate) {
  const wire::MessageInfo info = wire::Info<Message>();
  return {info.channel, info.type, owner, readers, rate};
}

std::string ForPeople(const std::string& role) { return role == roles::kLoopCloser ? "loop closer" : role; }

std::string ForPeople(const std::vector<std::string>& roles) {
  std::string text;
  for (const std::string& role : roles) text += (text.empty() ? "" : ", ") + ForPeople(role);
  return text;
}

/// Of a record. `others`: who hears it besides the readers of its stream.
template <typename Message>
ChannelRow RecordRow(StreamId stream, const char* rate, const std::string& others = "") {
  const wire::MessageInfo info = wire::Info<Message>();
  const StreamPlan& plan = PlanOf(stream);
  const std::string readers = ForPeople(plan.readers) + "; " + ForPeople(plan.watchers);
  return {info.channel, info.type, ForPeople(plan.writer), readers + others, rate};
}

std::vector<ChannelRow> PlayerRows() {
  return {
      Row<CameraInfo>("player; while it is silent, any writer of a stream repeats it", "everybody", "2 Hz"),
      Row<Frame>("player", "frontend, viewer", "camera's rate; repeated in lock-step"),
      Row<EndOfSequence>("player", "frontend, collector, viewer", "5 Hz, until heard"),
      Row<GroundTruthPose>("player", "frontend (for `error_m` only), collector, viewer",
                           "camera's rate, where known"),
      Row<PlayerStatus>("player", "everybody", "1 Hz"),
  };
}

std::vector<ChannelRow> FrontendRows() {
  constexpr auto kStream = StreamId::kFrontend;
  return {
      RecordRow<SessionStart>(kStream, "once"),
      {channels::kSessionAgain, wire::Info<SessionStart>().type, "frontend", "loop closer, mapper", "1 Hz"},
      RecordRow<InitialMap>(kStream, "once per map"),
      RecordRow<KeyframeProposal>(kStream, "per keyframe", "; a frontend that takes over"),
      RecordRow<FramePose>(kStream, "per frame; once more where refined at the end"),
      RecordRow<FrameEvidence>(kStream, "with keyframes, and between"),
      RecordRow<MapReset>(kStream, "rare"),
      RecordRow<AdjustRequest>(kStream, "at the end"),
      RecordRow<TurnRequest>(kStream, "per frame, of several cameras in lock-step"),
      Row<FrameDone>("frontend", "player", "per frame"),
      Row<SequenceDone>("frontend", "player", "at the end, once for each end_of_sequence_t"),
      Row<Odometry>("frontend", "who controls the motion", "per frame"),
      Row<PoseView>("frontend", "eyes and plots, viewer", "per frame"),
      Row<FeatureView>("frontend", "viewer, pictures", "per frame"),
      Row<FrameTrace>("frontend", "collector", "per frame"),
      Row<FrontendStatus>("frontend", "everybody", "1 Hz"),
  };
}

std::vector<ChannelRow> MapRows() {
  return {
      RecordRow<MapDelta>(StreamId::kMap, "several per keyframe"),
      Row<MapperStatus>("mapper", "everybody", "1 Hz"),
      RecordRow<LoopAnswer>(StreamId::kLoopCloser, "per keyframe"),
      Row<LoopcloserStatus>("loop closer", "everybody", "1 Hz"),
  };
}

std::vector<ChannelRow> ProtocolRows() {
  const std::string owner = "<OWNER>", reader = "<READER>";
  return {
      {HeadChannel(owner), "head_t", "each writer of a stream", "its readers", "10 Hz"},
      {PartChannel(owner), "part_t", "each writer of a stream", "its readers",
       "repairs; every record on a LAN"},
      {AckChannel(reader), "ack_t", "each reader of a stream", "its writers; another collector",
       "1 Hz to 33 Hz"},
      {TakeOverChannel(owner), "take_over_t", "a successor", "the present writer", "at a take-over"},
      {HandOverChannel(owner), "hand_over_t", "a starting writer", "holders of replicas", "at a start"},
      {ReplicaChannel("<HOLDER>"), "replica_t", "holders of replicas", "a starting writer", "at a start"},
      {kProofChannel, "proof_t", "each process, where the bus has a key", "each process", "at a start"},
  };
}

const StructType& TypeOf(const std::string& name) {
  const StructType* type = Schema::OfProject().Find(name);
  if (type == nullptr) throw InvariantError("message docs: " + name + " has no definition");
  return *type;
}

/// Bytes that do not depend on content, and bytes per counted element.
struct Size {
  int64_t fixed = 0;
  std::vector<std::pair<std::string, int64_t>> per_count;  ///< in the order of the counts
};

void AddSize(const StructType& type, const std::string& prefix, Size& size);

/// Of a counted array of structs the fixed part counts as often as there are elements.
void AddStructSize(const StructType& type, const Field& field, const std::string& prefix, Size& size) {
  Size inner;
  AddSize(TypeOf(field.type), prefix + field.name + ".", inner);
  int counted_by = -1;
  for (const Field::Dimension& dimension : field.dimensions) counted_by = dimension.counted_by;
  if (counted_by < 0) {
    size.fixed += inner.fixed;
  } else {
    size.per_count.emplace_back(prefix + type.fields[static_cast<size_t>(counted_by)].name, inner.fixed);
  }
  size.per_count.insert(size.per_count.end(), inner.per_count.begin(), inner.per_count.end());
}

void AddSize(const StructType& type, const std::string& prefix, Size& size) {
  std::map<int, int64_t> per_count;
  for (const Field& field : type.fields) {
    if (field.kind == Field::Kind::kStruct) {
      AddStructSize(type, field, prefix, size);
      continue;
    }
    int64_t bytes = field.kind == Field::Kind::kString ? 5 : field.size_bytes;  // length and closing zero
    int counted_by = -1;
    for (const Field::Dimension& dimension : field.dimensions) {
      if (dimension.counted_by < 0) {
        bytes *= dimension.constant;
      } else {
        counted_by = dimension.counted_by;
      }
    }
    (counted_by < 0 ? size.fixed : per_count[counted_by]) += bytes;
  }
  for (const auto& [count, bytes] : per_count) {
    size.per_count.emplace_back(prefix + type.fields[static_cast<size_t>(count)].name, bytes);
  }
}

std::string SizeText(const StructType& type) {
  Size size{.fixed = 8, .per_count = {}};  // fingerprint
  AddSize(type, "", size);
  std::string text = std::to_string(size.fixed) + " bytes";
  bool has_text = false;
  for (const Field& field : type.fields) has_text |= field.kind == Field::Kind::kString;
  if (has_text) text += " and text";
  for (const auto& [count, bytes] : size.per_count) {
    text += ", + " + (bytes == 1 ? std::string() : std::to_string(bytes) + " * ") + "`" + count + "`";
  }
  return text;
}

std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '|' || c == '<') escaped += '\\';
    escaped += c;
  }
  return escaped;
}

void WriteFields(const StructType& type, std::ostream& out) {
  out << "| field | type | meaning |\n|---|---|---|\n";
  for (const Field& field : type.fields) {
    std::string name = field.name;
    for (const Field::Dimension& dimension : field.dimensions) {
      name += '[';
      name += dimension.counted_by < 0 ? std::to_string(dimension.constant)
                                       : type.fields[static_cast<size_t>(dimension.counted_by)].name;
      name += ']';
    }
    out << "| `" << name << "` | " << field.type << " | " << Escaped(field.comment) << " |\n";
  }
  out << '\n';
  if (type.constants.empty()) return;
  out << "| constant | value | meaning |\n|---|---|---|\n";
  for (const Constant& constant : type.constants) {
    out << "| `" << constant.name << "` | " << constant.value << " | " << Escaped(constant.comment) << " |\n";
  }
  out << '\n';
}

void WriteChannels(const std::string& title, const std::vector<ChannelRow>& rows, std::ostream& out) {
  out << "### " << title << "\n\n| channel | type | record | from | to | rate |\n|---|---|---|---|---|---|\n";
  for (const ChannelRow& row : rows) {
    const StructType& type = TypeOf(row.type);
    const bool record = type.comment.starts_with("Record.");
    out << "| `" << row.channel << "` | [" << row.type << "](#" << row.type << ") | " << (record ? "yes" : "")
        << " | " << row.owner << " | " << row.readers << " | " << row.rate << " |\n";
  }
  out << '\n';
}

constexpr const char* kIntroduction =
    R"(# Messages

Made by `dmslam-message-docs` from `lcmtypes/*.lcm` and the table in `tools/message_docs`; a test compares.

- One LCM package, `dmslam`. Each file defines one type; `lcm-gen` makes C++, Java, Python, C, C# or Lua of it.
- `utime` comes first: capture time in microseconds for what belongs to a frame, wall time for what is sent by the clock.
  Exact time travels as `stamp_ns`.
- *Records* belong to a stream that loses nothing. Their second field is `header`; a writer's protocol fills it in (see
  `src/dmslam/messaging/README.md`), and a program that only watches can ignore it. A writer waits for the readers that stand
  before the semicolon.
- Poses are named by what they do: `cam_world` takes points of the world into the camera (x right, y down, z forward).
  Lengths are map units. Quaternions are unit, in the order x, y, z, w.
- Keyframe ids are `session << 32 | camera_id << 28 | frame index`; landmark ids `ordinal of the mapper's epoch << 48 | number`. Ids and what else
  counts from 1 is 0 where there is none; stamps and indices are -1. What is measured only sometimes is an array that is empty.
- One meaning, one message: a request to adjust the maps (`adjust_request_t`) is not a reset (`map_reset_t`), the end of a
  sequence is answered by `sequence_done_t`. What the mapper says travels in one type, `map_record_t`, since an answer and the
  change that it concludes must not come apart: `event` says which answer it is, and nothing else has to be looked at.
- Several cameras on one map: each has a player and a frontend of its own. Those of camera 0 speak on the channels below; those of
  camera 1 on `DMSLAM_PLAYER1_...` and `DMSLAM_FRONTEND1_...`, and so on to 15, in streams whose number is higher by 1000 for each.
  Maps that camera 1 begins are numbered from 1000001. A map record says of one camera how far it is (`frontend_seq`).
- Reserved, and not written yet: depths and sigmas of keypoints; positions of landmarks in
  their reference keyframe (`landmark_frame`; the world's coordinates are what the mapper computes with, and a change of frame
  there and back changes their last bits).
- No record is longer than 1 MiB. A change that would be (`map_record_t`, `checked_t`) is a group of records, one behind the other in
  their stream, with the same header of their own (event, version, progress ...), which are applied as one or not at all. Where one
  is missing, doubled or of another change, nothing of the group is applied; a reader of the map then asks for a snapshot. A group
  whose writer is succeeded before it is whole never happened: the successor goes on from before it.
- A correction tells of keyframes: landmarks follow their reference keyframe (`move_...`), but for those whose position it tells.
- `checksum` is CRC-32 as zlib, Python's `zlib.crc32` and Java's `CRC32` compute it. A message without it is dropped.
- LCM has no unsigned integers: what is called unsigned keeps its bits.
- Counts stand before the arrays that they count. Whoever receives checks the length, the counts and the values before
  use: LCM's generated decoders trust them. `wire::Decode` does all of that.
- A prefix (`--prefix`) may stand before every channel; it separates systems, and is not part of a checksum.
- Sizes include LCM's fingerprint of eight bytes, and of each text only its length and end.

)";

void CollectParts(const StructType& type, std::set<std::string>& parts) {
  for (const Field& field : type.fields) {
    if (field.kind == Field::Kind::kStruct && parts.insert(field.type).second)
      CollectParts(TypeOf(field.type), parts);
  }
}

void WriteType(const StructType& type, std::ostream& out) {
  out << "### " << type.name << "\n\n" << type.comment << "\n\n";
  out << "Size: " << SizeText(type) << ".\n\n";
  WriteFields(type, out);
}

}  // namespace

std::string MessageDocs() {
  const std::array<std::pair<std::string, std::vector<ChannelRow>>, 4> groups = {{
      {"Player", PlayerRows()},
      {"Frontend", FrontendRows()},
      {"Mapper and loop closer", MapRows()},
      {"Protocol of the streams", ProtocolRows()},
  }};
  std::ostringstream out;
  out << kIntroduction << "## Channels\n\n";
  for (const auto& [title, rows] : groups) WriteChannels(title, rows, out);

  out << "## Types\n\n";
  std::set<std::string> written, parts;
  for (const auto& [title, rows] : groups) {
    for (const ChannelRow& row : rows) {
      if (!written.insert(row.type).second) continue;
      WriteType(TypeOf(row.type), out);
      CollectParts(TypeOf(row.type), parts);
    }
  }
  out << "## Parts of other types\n\n";
  for (const std::string& part : parts) {
    out << "### " << part << "\n\n" << TypeOf(part).comment << "\n\n";
    WriteFields(TypeOf(part), out);
  }
  for (const auto& [name, type] : Schema::OfProject().types()) {
    const bool told = written.contains(name) || parts.contains(name);
    if (!told) throw InvariantError("message docs: no channel is known for " + name);
  }
  std::string text = out.str();
  text.pop_back();  // one line feed at the end
  return text;
}

}  // namespace dmslam
