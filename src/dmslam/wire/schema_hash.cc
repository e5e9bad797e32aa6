#include <type_traits>

#include "dmslam/util/random.h"
#include "dmslam/wire/codec.h"

namespace dmslam::wire {

int64_t SchemaHash() {
  uint64_t hash = 0;
  const auto add = [&](int64_t fingerprint) { hash = Mix64(hash ^ static_cast<uint64_t>(fingerprint)); };
  [&]<typename... Message>(std::type_identity<std::tuple<Message...>>) {
    (add(Info<Message>().fingerprint), ...);
  }(std::type_identity<Messages>());
  return static_cast<int64_t>(hash);
}

}  // namespace dmslam::wire
