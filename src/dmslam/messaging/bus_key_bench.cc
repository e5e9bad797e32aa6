// What a tag costs: by the size of the message, for who sends it and for each who hears it.

#include <benchmark/benchmark.h>

#include "dmslam/messaging/bus_key.h"

namespace dmslam {
namespace {

const Tag kTag{1, 2, 3};

void WithTag(benchmark::State& state) {
  const BusKey key(Bytes(32, 1));
  const Bytes message(static_cast<size_t>(state.range(0)), 7);
  for (auto _ : state) benchmark::DoNotOptimize(key.WithTag("DMSLAM_PLAYER_FRAME", message, kTag));
  state.SetBytesProcessed(state.iterations() * state.range(0));
}
BENCHMARK(WithTag)->Arg(200)->Arg(1380)->Arg(41'000)->Arg(640 * 480)->Arg(1280 * 720);

void Verify(benchmark::State& state) {
  const BusKey key(Bytes(32, 1));
  const Bytes tagged =
      key.WithTag("DMSLAM_PLAYER_FRAME", Bytes(static_cast<size_t>(state.range(0)), 7), kTag);
  for (auto _ : state) benchmark::DoNotOptimize(key.Verify("DMSLAM_PLAYER_FRAME", tagged));
  state.SetBytesProcessed(state.iterations() * state.range(0));
}
BENCHMARK(Verify)->Arg(200)->Arg(1380)->Arg(41'000)->Arg(640 * 480)->Arg(1280 * 720);

}  // namespace
}  // namespace dmslam

BENCHMARK_MAIN();
