#include "content_forger.h"

#include <array>
#include <memory>
#include <utility>

namespace dmslam::simulation {
namespace {

constexpr int64_t kFrameNs = 66'666'667;
constexpr int64_t kFarNs = 3'600'000'000'000;
constexpr int64_t kFarTerm = 1'000'000;

Outgoing Sent(const std::string& channel, Bytes bytes) {
  return {channel, std::make_shared<const Bytes>(std::move(bytes)), false};
}

template <typename Message>
Outgoing Sent(const Message& message) {
  return Sent(wire::Info<Message>().channel, wire::Encode(message));
}

Outgoing SentRecord(const std::string& channel, RecordHeader header, Bytes bytes) {
  ++header.seq;
  Seal(header, channel, bytes);
  return Sent(channel, std::move(bytes));
}

Frame Grey(Frame frame, const Camera& camera) {
  frame.encoding = FrameEncoding::kGray8;
  frame.width_px = camera.width_px;
  frame.height_px = camera.height_px;
  frame.data.assign(static_cast<size_t>(frame.width_px) * static_cast<size_t>(frame.height_px), 100);
  return frame;
}

/// The frame so many numbers and so much later.
Frame Later(Frame frame, uint32_t frames, int64_t later_ns) {
  frame.frame_index += frames;
  frame.stamp_ns += later_ns;
  return frame;
}

EndOfSequence EndBehind(const Frame& frame) {
  EndOfSequence end;
  end.session = frame.session;
  end.frames_published = end.frames_listed = frame.frame_index + 1;
  end.last_frame_index = static_cast<int32_t>(frame.frame_index);
  end.last_stamp_ns = frame.stamp_ns;
  return end;
}

}  // namespace

std::string ToText(Content content) {
  constexpr std::array<const char*, kNumContents> kTexts = {
      "session",   "camera",     "answer further than the player", "answer to the end", "end of the sequence",
      "far frame", "next frame", "answer to the newest frame",     "next record",       "map reset"};
  return kTexts[static_cast<size_t>(content)];
}

bool MayCost(Content content) {
  return content == Content::kNextFrame || content == Content::kDone || content == Content::kNextRecord ||
         content == Content::kReset;
}

void ContentForger::Hear(const Outgoing& message) { last_[message.channel] = message.bytes; }

std::optional<Outgoing> ContentForger::Make(Content content, Random* random) const {
  static const std::array<std::string, 3> kOfStreams = {channels::kMap, channels::kFramePose,
                                                        channels::kKeyframe};
  switch (content) {
    case Content::kSession:
      return Session(random->Below(2) == 0);
    case Content::kCamera:
      return OtherCamera();
    case Content::kNextRecord:
      return NextRecord(kOfStreams[random->Below(kOfStreams.size())]);
    case Content::kReset:
      return Reset();
    default:
      return OfFrame(content);
  }
}

const Bytes* ContentForger::LastOf(const std::string& channel) const {
  const auto heard = last_.find(channel);
  return heard == last_.end() ? nullptr : heard->second.get();
}

std::optional<RecordHeader> ContentForger::NewestHeaderOf(const std::string& channel) const {
  const Bytes* bytes = LastOf(channel);
  return bytes == nullptr ? std::nullopt : ParseHeader(*bytes);
}

std::optional<Outgoing> ContentForger::Session(bool of_later_term) const {
  std::optional<SessionStart> session = Last<SessionStart>();
  std::optional<RecordHeader> header = NewestHeaderOf(channels::kFramePose);
  if (!session || !header) return std::nullopt;
  ++session->configuration_hash;
  header->seq = 0;
  if (of_later_term) header->epoch += kFarTerm;
  return SentRecord(channels::kSession, *header, wire::Encode(*session));
}

std::optional<Outgoing> ContentForger::NextRecord(const std::string& channel) const {
  const std::optional<RecordHeader> header = NewestHeaderOf(channel);
  if (!header) return std::nullopt;
  return SentRecord(channel, *header, *LastOf(channel));
}

std::optional<Outgoing> ContentForger::Reset() const {
  const std::optional<RecordHeader> header = NewestHeaderOf(channels::kFramePose);
  if (!header) return std::nullopt;
  MapReset reset;
  reset.map_id = 1;
  reset.fate = MapReset::Fate::kDrop;
  return SentRecord(channels::kMapReset, *header, wire::Encode(reset));
}

std::optional<Outgoing> ContentForger::OtherCamera() const {
  std::optional<CameraInfo> info = Last<CameraInfo>();
  if (!info) return std::nullopt;
  info->sequence = "forged";
  info->num_frames = 3;
  return Sent(*info);
}

std::optional<Outgoing> ContentForger::OfFrame(Content content) const {
  const std::optional<Frame> frame = Last<Frame>();
  const std::optional<CameraInfo> info = Last<CameraInfo>();
  if (!frame || !info) return std::nullopt;
  switch (content) {
    case Content::kFurther:
      return Sent(FrameDone{frame->session, frame->frame_index + 1000, frame->stamp_ns});
    case Content::kDone:
      return Sent(FrameDone{frame->session, frame->frame_index, frame->stamp_ns});
    case Content::kSequenceDone: {
      SequenceDone done;
      done.session = frame->session;
      return Sent(done);
    }
    case Content::kEnd:
      return Sent(EndBehind(*frame));
    case Content::kFarFrame:
      return Sent(Later(*frame, kMaxFrames / 2, kFarNs));
    default:
      return Sent(Grey(Later(*frame, 1, kFrameNs), info->camera));
  }
}

}  // namespace dmslam::simulation
