// Who can send on the segment and knows the protocol: listens to a running system and forges one kind of
// message again and again, or so many times, with every checksum right. Without a key of its own its messages
// carry the tag of what it heard, or none; with --key they carry tags of that key.
#include <cstdio>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "dmslam/console/command_line.h"
#include "dmslam/messaging/bus_key.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/event_loop.h"
#include "dmslam/messaging/lcm_bus.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

constexpr size_t kMaxKept = 20'000;

std::vector<std::string> AllChannels() {
  std::vector<std::string> names;
  const auto add = [&]<typename... Message>(const std::tuple<Message...>*) {
    (names.emplace_back(wire::Info<Message>().channel), ...);
  };
  add(static_cast<const wire::Messages*>(nullptr));
  for (const std::string owner : {"PLAYER", "FRONTEND", "MAPPER", "LOOPCLOSER", "COLLECTOR"}) {
    for (const std::string& name : {HeadChannel(owner), PartChannel(owner), AckChannel(owner)})
      names.push_back(name);
  }
  names.emplace_back("DMSLAM_PROOF");
  return names;
}

class Forger {
 public:
  Forger(Bus* bus, std::optional<BusKey> key, bool keeps_tag)
      : bus_(bus), key_(std::move(key)), keeps_tag_(keeps_tag) {
    bus_->SetHandler(
        [this](const std::string& channel, std::span<const uint8_t> bytes) { Hear(channel, bytes); });
    for (const std::string& channel : AllChannels()) bus_->Subscribe(channel);
  }

  bool Forge(const std::string& kind) {
    static const std::map<std::string, void (Forger::*)()> kKinds = {{"frame", &Forger::Frames},
                                                                     {"small-frame", &Forger::SmallFrames},
                                                                     {"far-frame", &Forger::FarFrame},
                                                                     {"end", &Forger::End},
                                                                     {"camera", &Forger::AnotherCamera},
                                                                     {"take-over", &Forger::TakeOvers},
                                                                     {"head", &Forger::Heads},
                                                                     {"far-head", &Forger::FarHeads},
                                                                     {"record", &Forger::Records},
                                                                     {"reset", &Forger::Reset},
                                                                     {"ack", &Forger::Acks},
                                                                     {"done", &Forger::Done},
                                                                     {"far-done", &Forger::FarDone},
                                                                     {"sequence-done", &Forger::AllDone},
                                                                     {"session", &Forger::Session},
                                                                     {"replay", &Forger::Replay}};
    const auto found = kKinds.find(kind);
    if (found == kKinds.end()) return false;
    (this->*found->second)();
    return true;
  }
  int64_t sent() const { return sent_; }
  /// The newest frame that was played.
  int64_t frame() const {
    const std::optional<Frame> frame = Last<Frame>();
    return frame ? static_cast<int64_t>(frame->frame_index) : -1;
  }

 private:
  void Hear(const std::string& channel, std::span<const uint8_t> bytes) {
    if (ours_.contains(std::string(bytes.begin(), bytes.end()))) return;
    last_[channel].assign(bytes.begin(), bytes.end());
    if (recorded_.size() < kMaxKept) recorded_.emplace_back(channel, last_[channel]);
  }

  template <typename Message>
  std::optional<Message> Last() const {
    const auto heard = last_.find(wire::Info<Message>().channel);
    return heard == last_.end() ? std::nullopt : wire::Decode<Message>(WithoutTag(heard->second));
  }

  void SendRaw(const std::string& channel, Bytes bytes) {
    if (ours_.size() < kMaxKept) ours_.emplace(bytes.begin(), bytes.end());
    bus_->Publish({channel, std::make_shared<const Bytes>(std::move(bytes)), false});
    ++sent_;
  }
  void Send(const std::string& channel, Bytes bytes) {
    if (key_) return SendRaw(channel, key_->WithTag(channel, bytes, {0, ++counter_, 99}));
    const auto heard = last_.find(channel);
    if (keeps_tag_ && heard != last_.end() && HasTag(heard->second))
      bytes.insert(bytes.end(), heard->second.end() - kTagBytes, heard->second.end());
    SendRaw(channel, std::move(bytes));
  }
  template <typename Message>
  void SendMessage(const Message& message) {
    Send(wire::Info<Message>().channel, wire::Encode(message));
  }
  template <typename Message>
  void SendSealed(const std::string& channel, const Message& message) {
    Send(channel, *SealedMessage(channel, message).bytes);
  }

  void Frames() {
    const std::optional<CameraInfo> info = Last<CameraInfo>();
    if (info) NextFrames(info->camera.width_px, info->camera.height_px);
  }
  void SmallFrames() { NextFrames(32, 32); }
  void NextFrames(int width_px, int height_px) {
    std::optional<Frame> frame = Last<Frame>();
    if (!frame) return;
    frame->encoding = FrameEncoding::kGray8;
    frame->width_px = width_px;
    frame->height_px = height_px;
    frame->data.assign(static_cast<size_t>(frame->width_px) * static_cast<size_t>(frame->height_px), 100);
    for (int ahead = 1; ahead < 3; ++ahead) {
      ++frame->frame_index;
      frame->stamp_ns += 33'000'000;
      SendMessage(*frame);
    }
  }
  void FarFrame() {
    std::optional<Frame> frame = Last<Frame>();
    if (!frame) return;
    frame->frame_index = kMaxFrames - 10 + static_cast<uint32_t>(sent_);
    frame->stamp_ns += 3'600'000'000'000;
    SendMessage(*frame);
  }
  void End() {
    const std::optional<Frame> frame = Last<Frame>();
    if (!frame) return;
    EndOfSequence end;
    end.session = frame->session;
    end.frames_published = end.frames_listed = frame->frame_index + 1;
    end.last_frame_index = static_cast<int32_t>(frame->frame_index);
    end.last_stamp_ns = frame->stamp_ns;
    SendMessage(end);
  }
  void AnotherCamera() {
    std::optional<CameraInfo> info = Last<CameraInfo>();
    if (!info) return;
    info->sequence = "forged";
    info->num_frames = 3;
    SendMessage(*info);
  }
  void Done() {
    const std::optional<Frame> frame = Last<Frame>();
    if (!frame) return;
    FrameDone done;
    done.session = frame->session;
    for (uint32_t ahead = 0; ahead < 3; ++ahead) {
      done.frame_index = frame->frame_index + ahead;
      done.stamp_ns = frame->stamp_ns;
      SendMessage(done);
    }
  }
  void FarDone() {
    const std::optional<Frame> frame = Last<Frame>();
    if (frame) SendMessage(FrameDone{frame->session, frame->frame_index + 1000, frame->stamp_ns});
  }
  void AllDone() {
    const std::optional<Frame> frame = Last<Frame>();
    if (!frame) return;
    SequenceDone done;
    done.session = frame->session;
    SendMessage(done);
  }
  void ForEachHead(const std::function<void(const std::string& owner, const head_t&)>& action) {
    for (const std::string owner : {"PLAYER", "FRONTEND", "MAPPER", "LOOPCLOSER"}) {
      const auto heard = last_.find(HeadChannel(owner));
      if (heard == last_.end()) continue;
      if (const auto head = DecodeHead(heard->first, WithoutTag(heard->second))) action(owner, *head);
    }
  }
  void TakeOvers() {
    ForEachHead([this](const std::string& owner, const head_t& head) {
      take_over_t forged{};
      forged.utime = head.utime;
      forged.header = head.header;
      forged.successor = 99;
      forged.name = "forger";
      SendSealed(TakeOverChannel(owner), forged);
    });
  }
  void Heads() {
    ForgeHeads([](head_t& head) { head.header.epoch += 1000; });
  }
  /// Of the last term that there can be, each said a little later than the one before: no copies.
  void FarHeads() {
    ForgeHeads([this](head_t& head) {
      head.header.epoch = kMaxEpoch - 1;
      head.utime += sent_;
    });
  }
  void ForgeHeads(const std::function<void(head_t&)>& change) {
    ForEachHead([&](const std::string& owner, head_t head) {
      change(head);
      head.header.writer = 99;
      head.name = "forger";
      SendSealed(HeadChannel(owner), head);
    });
  }
  void SendRecord(const std::string& channel, RecordHeader header, Bytes bytes) {
    ++header.seq;
    Seal(header, channel, bytes);
    Send(channel, std::move(bytes));
  }
  /// The next record of each stream, with an earlier one's content.
  void Records() {
    for (const std::string channel : {channels::kMap, channels::kFramePose, channels::kKeyframe}) {
      const auto heard = last_.find(channel);
      if (heard == last_.end()) continue;
      const auto bytes = WithoutTag(heard->second);
      if (const auto header = ParseHeader(bytes))
        SendRecord(channel, *header, Bytes(bytes.begin(), bytes.end()));
    }
  }
  void Reset() {
    const auto heard = last_.find(channels::kFramePose);
    if (heard == last_.end()) return;
    const auto header = ParseHeader(WithoutTag(heard->second));
    if (!header) return;
    MapReset reset;
    reset.map_id = 1;
    reset.fate = MapReset::Fate::kDrop;
    SendRecord(channels::kMapReset, *header, wire::Encode(reset));
  }
  /// What nobody's settings fit: as the first record of a stream of now, and as the next one of the
  /// frontend's.
  void Session() {
    const auto heard = last_.find(channels::kSession);
    const auto newest = last_.find(channels::kFramePose);
    if (heard == last_.end() || newest == last_.end()) return;
    const auto bytes = WithoutTag(heard->second);
    auto session = wire::Decode<SessionStart>(bytes);
    const auto header = ParseHeader(WithoutTag(newest->second));
    if (!session || !header) return;
    ++session->configuration_hash;
    RecordHeader first = *header;
    first.seq = 0;
    SendRecord(channels::kSession, first, wire::Encode(*session));
    first.epoch += 1'000'000;
    SendRecord(channels::kSession, first, wire::Encode(*session));
    SendRecord(channels::kSession, *header, wire::Encode(*session));
  }
  void Acks() {
    for (const std::string reader : {"FRONTEND", "MAPPER", "LOOPCLOSER", "COLLECTOR"}) {
      const auto heard = last_.find(AckChannel(reader));
      if (heard == last_.end()) continue;
      std::optional<ack_t> ack = DecodeAck(heard->first, WithoutTag(heard->second));
      if (!ack) continue;
      ack->header.seq = ack->received = ack->received + 2;
      SendSealed(heard->first, *ack);
    }
  }
  void Replay() {
    for (int i = 0; i < 20 && replayed_ < recorded_.size(); ++i, ++replayed_)
      SendRaw(recorded_[replayed_].first, recorded_[replayed_].second);
    if (replayed_ == recorded_.size()) replayed_ = 0;
  }

  Bus* bus_;
  std::optional<BusKey> key_;
  bool keeps_tag_;
  std::map<std::string, Bytes> last_;
  std::vector<std::pair<std::string, Bytes>> recorded_;
  std::set<std::string> ours_;
  size_t replayed_ = 0;
  uint64_t counter_ = 0;
  int64_t sent_ = 0;
};

}  // namespace
}  // namespace dmslam

int main(int argc, char** argv) {
  dmslam::CommandLine app("Forges messages of a running system.", "forger");
  std::string url, key;
  std::vector<std::string> kinds;
  bool keeps_tag = false;
  int64_t times = INT64_MAX, from_frame = 0;
  app.AddOption("--lcm-url", url).Required();
  app.AddOption("--key", key, "of another system");
  app.AddFlag("--keep-tag", keeps_tag, "put the tag of what was heard behind what is forged");
  app.AddOption("--kind", kinds,
                "frame, small-frame, far-frame, end, camera, take-over, head, far-head, record, reset, ack, "
                "done, far-done, "
                "sequence-done, session, replay")
      .Required();
  app.AddOption("--times", times, "end after so many forgeries of each kind; default: a signal ends it");
  app.AddOption("--from-frame", from_frame, "begin when this frame has been played");
  if (const auto code = app.Parse(argc, argv)) return *code;
  try {
    dmslam::EventLoop loop;
    dmslam::LcmBus bus({url, ""});
    std::optional<dmslam::BusKey> own;
    if (!key.empty()) own = dmslam::BusKey::Load(key);
    dmslam::Forger forger(&bus, own, keeps_tag);
    loop.Watch(bus.fd(), [&bus] { bus.Deliver(); });
    for (int64_t forged = 0; loop.stop_signal() == 0 && forged < times;) {
      const int64_t next_ns = loop.now_ns() + 20'000'000;
      while (loop.now_ns() < next_ns && loop.PumpOnce(next_ns)) {
      }
      if (forger.frame() < from_frame) continue;
      const int64_t sent = forger.sent();
      for (const std::string& kind : kinds) {
        if (!forger.Forge(kind)) throw dmslam::InputError("no such kind: " + kind);
      }
      forged += forger.sent() > sent;
    }
    std::printf("%lld forged messages\n", static_cast<long long>(forger.sent()));
  } catch (const dmslam::InputError& error) {
    std::fprintf(stderr, "forger: %s\n", error.what());
    return 1;
  }
  return 0;
}
