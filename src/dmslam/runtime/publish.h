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
  Message said = message;
  if constexpr (requires { said.camera_id; }) said.camera_id = camera;
  bus->Publish({ChannelOfCamera(wire::Info<Message>().channel, camera),
                std::make_shared<const Bytes>(wire::Encode(said)), local});
}

}  // namespace dmslam
