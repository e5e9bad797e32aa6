// One message type, DMSLAM_FUZZ_MESSAGE.
#include "round_trip.h"

using Message = dmslam::DMSLAM_FUZZ_MESSAGE;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  dmslam::fuzz::RoundTrip<Message>({data, size});
  return 0;
}

namespace dmslam::fuzz {

std::vector<std::vector<uint8_t>> Seeds() {
  std::vector<std::vector<uint8_t>> seeds;
  for (uint64_t i = 0; i < 16; ++i) seeds.push_back(MessageSeed<Message>(i));
  return seeds;
}

}  // namespace dmslam::fuzz
