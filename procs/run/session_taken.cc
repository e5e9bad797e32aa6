#include "run/session_taken.h"

#include <csignal>
#include <memory>
#include <span>

#include "dmslam/messaging/bus_key.h"
#include "dmslam/messaging/event_loop.h"
#include "dmslam/messaging/keyed_bus.h"
#include "dmslam/messaging/lcm_bus.h"
#include "dmslam/runtime/session_choice.h"
#include "dmslam/util/ids.h"
#include "dmslam/util/not_yet_error.h"

namespace dmslam {
namespace {

constexpr int64_t kListenNs = 500'000'000;  // beacons come ten times a second

std::optional<std::string> Listen(const RunArguments::Bus& bus, int port, uint32_t session) {
  EventLoop loop;
  LcmBus lcm({BusUrl(bus, port), bus.prefix});
  std::unique_ptr<KeyedBus> keyed;
  if (const std::optional<BusKey> key = BusKey::LoadIfWanted(bus.key)) {
    KeyedBus::Options options;
    options.now_ns = &EventLoop::now_ns;
    options.wall_us = &EventLoop::wall_us;
    keyed = std::make_unique<KeyedBus>(&lcm, *key, options);
  }
  Bus& heard = keyed ? static_cast<Bus&>(*keyed) : lcm;
  const int64_t until_ns = EventLoop::now_ns() + kListenNs;
  SessionChoice sessions(until_ns);
  heard.SetHandler([&](const std::string& channel, std::span<const uint8_t> bytes) {
    sessions.HearBeacon(channel, bytes);
  });
  for (const std::string& channel : SessionChoice::Channels(kMaxCameras)) heard.Subscribe(channel);
  loop.Watch(lcm.fd(), [&lcm] { lcm.Deliver(); });
  while (EventLoop::now_ns() < until_ns && loop.PumpOnce(until_ns)) {
  }
  if (loop.stop_signal() != 0) std::raise(loop.stop_signal());  // comes when the loop has let go of it
  const auto writer = sessions.sessions().find(session);
  return writer == sessions.sessions().end() ? std::nullopt : std::optional(writer->second);
}

}  // namespace

std::optional<std::string> WhoWritesSession(const RunArguments::Bus& bus, int port, uint32_t session) {
  try {
    return Listen(bus, port, session);
  } catch (const NotYetError&) {
    return std::nullopt;  // the processes say what is not there yet, and may wait for it
  }
}

}  // namespace dmslam
