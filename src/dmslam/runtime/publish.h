#pragma once

#include <memory>

#include "dmslam/messaging/bus.h"
#include "dmslam/wire/codec.h"

namespace dmslam {

/// Says a message once, on its own channel: nobody repeats it. `local`: for this host alone.
template <typename Message>
void PublishLoose(Bus* bus, const Message& message, bool local = false) {
  bus->Publish({wire::Info<Message>().channel, std::make_shared<const Bytes>(wire::Encode(message)), local});
}

}  // namespace dmslam
