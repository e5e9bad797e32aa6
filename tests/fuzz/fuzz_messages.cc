// All message types: the first byte of the input says which.
#include "round_trip.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const size_t chosen = data[0] % std::tuple_size_v<dmslam::wire::Messages>;
  size_t index = 0;
  dmslam::wire::testing::ForEachMessage([&]<typename Message>() {
    if (index++ == chosen) dmslam::fuzz::RoundTrip<Message>({data + 1, size - 1});
  });
  return 0;
}

namespace dmslam::fuzz {

std::vector<std::vector<uint8_t>> Seeds() {
  std::vector<std::vector<uint8_t>> seeds;
  uint8_t index = 0;
  wire::testing::ForEachMessage([&]<typename Message>() {
    for (uint64_t i = 0; i < 8; ++i) {
      seeds.push_back(MessageSeed<Message>(i));
      seeds.back().insert(seeds.back().begin(), index);
    }
    ++index;
  });
  return seeds;
}

}  // namespace dmslam::fuzz
