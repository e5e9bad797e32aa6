#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "dmslam/messaging/bus.h"
#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/stream_reader.h"
#include "dmslam/messaging/stream_writer.h"
#include "dmslam/runtime/node.h"
#include "dmslam/runtime/stream_node.h"
#include "dmslam/wire/codec.h"

namespace dmslam {

/// For a node on a bus in memory, whose time stands still unless the test moves it.
inline NodeContext ContextOnBus(Bus* bus, const int64_t* now_ns, std::string name) {
  NodeContext context;
  context.bus = bus;
  context.now_ns = [now_ns] { return *now_ns; };
  context.wall_us = [now_ns] { return *now_ns / 1000; };
  context.random_id = 7;
  context.name = std::move(name);
  return context;
}

/// For the stream of a process that the test plays; `reader`: the role that reads it without loss.
inline StreamWriter::Options WriterOfRole(uint32_t session, StreamId stream, const std::string& role,
                                          const std::string& reader) {
  StreamWriter::Options options;
  options.session = session;
  options.stream = stream;
  options.owner = OwnerName(role);
  options.name = role;
  options.schema_hash = SchemaHash();
  options.roles = {{reader, true}};
  return options;
}

/// For a process that the test plays, and that reads the stream of `writer`.
inline StreamReader::Options ReaderOfRole(uint32_t session, StreamId stream, const std::string& writer,
                                          const std::string& role) {
  StreamReader::Options options;
  options.session = session;
  options.stream = stream;
  options.owner = OwnerName(writer);
  options.reader = OwnerName(role);
  options.role = options.name = role;
  options.id = 3;
  options.schema_hash = SchemaHash();
  return options;
}

/// Somebody says something outside the streams.
inline void SayBytes(Bus& bus, const std::string& channel, Bytes bytes) {
  bus.Publish({channel, std::make_shared<const Bytes>(std::move(bytes)), false});
}
template <typename Message>
void Say(Bus& bus, const Message& message) {
  SayBytes(bus, wire::Info<Message>().channel, wire::Encode(message));
}

/// Until nothing is on its way.
inline void DeliverAll(MemoryBus& bus) {
  while (bus.DeliverOne()) {
  }
}

}  // namespace dmslam
