#pragma once

#include <memory>

#include "dmslam/messaging/bus.h"
#include "dmslam/messaging/camera_channels.h"
#include "dmslam/wire/codec.h"

namespace dmslam {

/// Says a message once, on its own channel: nobody repeats it. `local`: for this host alone. A player and a
/// frontend say which camera's they are.
template <typename Message>
void PublishLoose(Bus* bus, const Message& message, bool local = false, CameraId camera = 0) {
  const auto publish = [&](const Message& said) {
    bus->Publish({ChannelOfCamera(wire::Info<Message>().channel, camera),
                  std::make_shared<const Bytes>(wire::Encode(said)), local});
  };
  if constexpr (requires { message.camera_id; }) {
    Message said = message;
    said.camera_id = camera;
    publish(said);
  } else {
    publish(message);
  }
}

}  // namespace dmslam
