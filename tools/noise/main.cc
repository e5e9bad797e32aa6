#include <cstdio>

#include "dmslam/console/command_line.h"
#include "dmslam/messaging/event_loop.h"
#include "dmslam/messaging/lcm_bus.h"
#include "dmslam/util/check.h"
#include "noise.h"

namespace {

constexpr int64_t kTickNs = 5'000'000;
constexpr int64_t kListenNs = 1'000'000'000;

struct NoiseOptions {
  std::string url;
  std::string prefix;
  int64_t count = 1'000'000;
  int64_t rate = 20'000;
  uint64_t seed = 1;
};

/// Listens a moment, so that there are sound messages to change; then makes noise at the rate asked for.
int64_t MakeNoise(const NoiseOptions& options) {
  dmslam::EventLoop loop;
  dmslam::LcmBus bus({options.url, options.prefix});
  dmslam::NoiseMaker maker(options.seed);
  bus.SetHandler(
      [&](const std::string& channel, std::span<const uint8_t> bytes) { maker.Hear(channel, bytes); });
  for (const std::string& channel : dmslam::AllChannels()) bus.Subscribe(channel);
  loop.Watch(bus.fd(), [&] { bus.Deliver(); });
  const int64_t begin_ns = loop.now_ns() + kListenNs;
  int64_t made = 0;
  for (int64_t tick_ns = begin_ns; made < options.count; tick_ns += kTickNs) {
    while (loop.now_ns() < tick_ns) {
      if (!loop.PumpOnce(tick_ns)) return made;
    }
    const int64_t due =
        std::min(options.count, (tick_ns - begin_ns + kTickNs) * options.rate / 1'000'000'000);
    for (; made < due; ++made) bus.Publish(maker.Make());
  }
  std::printf("%lld hostile messages, %lld of them changed from sound ones\n", static_cast<long long>(made),
              static_cast<long long>(maker.changed()));
  return made;
}

}  // namespace

int main(int argc, char** argv) {
  dmslam::CommandLine app(
      "Sends noise and damaged messages on every channel of a running system: nothing may come of it.",
      "dmslam-noise");
  NoiseOptions options;
  app.AddOption("--lcm-url", options.url, "LCM bus of the system").Required();
  app.AddOption("--prefix", options.prefix, "of its channels");
  app.AddOption("--count", options.count, "messages").ShowDefault();
  app.AddOption("--rate", options.rate, "messages per second").InRange(1, 1'000'000).ShowDefault();
  app.AddOption("--seed", options.seed, "of the noise").ShowDefault();
  return app.Run(argc, argv, [&] { MakeNoise(options); });
}
