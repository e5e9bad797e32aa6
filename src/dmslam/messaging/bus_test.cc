#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <stdexcept>

#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/endpoint.h"
#include "dmslam/messaging/event_loop.h"
#include "dmslam/messaging/lcm_bus.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/util/check.h"

namespace {

std::atomic<bool> receiver_stands_still = false;

}  // namespace

/// In the place of the library's: only LCM's receiving thread calls it.
extern "C" ssize_t recvmsg(int fd, msghdr* message, int flags) {
  receiver_stands_still.wait(true);
  return syscall(SYS_recvmsg, fd, message, flags);
}

namespace dmslam {
namespace {

Outgoing Message(const std::string& channel, Bytes bytes) {
  return {channel, std::make_shared<const Bytes>(std::move(bytes)), false};
}

// Each test has a port of its own, so that they can run side by side.
LcmBus::Options Options(int port, const std::string& prefix = "") {
  return {"udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0", prefix, 10000};
}

// Pumps until `done` or 10 s.
template <typename Done>
void PumpUntil(EventLoop* loop, const Done& done) {
  const int64_t limit = EventLoop::now_ns() + 10'000'000'000;
  while (!done() && EventLoop::now_ns() < limit)
    loop->PumpOnce(std::min(limit, EventLoop::now_ns() + 100'000'000));
}

TEST(MemoryBus, DeliversInOrderToAllOthersThatSubscribed) {
  MemoryBus bus;
  std::string log;
  MemoryBus::Port& a = bus.AddPort();
  MemoryBus::Port& b = bus.AddPort();
  MemoryBus::Port& c = bus.AddPort();
  for (auto [port, name] : {std::pair{&a, 'a'}, {&b, 'b'}, {&c, 'c'}}) {
    port->SetHandler(
        [&log, n = name](const std::string& channel, std::span<const uint8_t>) { log += n + channel + " "; });
  }
  a.Subscribe("X");
  b.Subscribe("X");
  c.Subscribe("Y");
  a.Publish(Message("X", {1}));
  b.Publish(Message("Y", {2}));
  b.Publish(Message("X", {3}));
  while (bus.DeliverOne()) {
  }
  EXPECT_EQ(log, "bX cY aX ");
}

TEST(MemoryBus, WhoWantsAllHearsWhateverOthersSay) {
  MemoryBus bus;
  std::string log;
  MemoryBus::Port& recorder = bus.AddPort();
  MemoryBus::Port& speaker = bus.AddPort();
  recorder.SetHandler([&](const std::string& channel, std::span<const uint8_t>) { log += channel + " "; });
  recorder.SubscribeToAll();
  speaker.Publish(Message("X", {1}));
  recorder.Publish(Message("ITS_OWN", {2}));
  speaker.Publish(Message("DMSLAM_MAPPER_HEAD", {3}));
  while (bus.DeliverOne()) {
  }
  EXPECT_EQ(log, "X DMSLAM_MAPPER_HEAD ");
}

TEST(EventLoop, ASignalAsksToStop) {
  EventLoop loop;
  EXPECT_TRUE(loop.PumpOnce());
  kill(getpid(), SIGTERM);
  EXPECT_FALSE(loop.PumpOnce(INT64_MAX));
  EXPECT_EQ(loop.stop_signal(), SIGTERM);
}

TEST(LcmBus, CarriesMessagesAndKeepsPrefixesApart) {
  EventLoop loop;
  LcmBus here(Options(17701, "A_")), there(Options(17701, "A_")), other(Options(17701, "B_"));
  int heard = 0, overheard = 0;
  there.SetHandler([&](const std::string& channel, std::span<const uint8_t> bytes) {
    EXPECT_EQ(channel, "DMSLAM_X");
    EXPECT_EQ(bytes.size(), 50000u);
    ++heard;
  });
  other.SetHandler([&](const std::string&, std::span<const uint8_t>) { ++overheard; });
  there.Subscribe("DMSLAM_X");
  other.Subscribe("DMSLAM_X");
  loop.Watch(there.fd(), [&] { there.Deliver(); });
  for (int i = 0; i < 3; ++i) here.Publish(Message("DMSLAM_X", Bytes(50000, 7)));
  PumpUntil(&loop, [&] { return heard == 3; });
  EXPECT_EQ(heard, 3);
  other.Deliver();
  EXPECT_EQ(overheard, 0);
}

TEST(LcmBus, WhoSubscribesTwiceHearsAMessageOnce) {
  EventLoop loop;
  LcmBus here(Options(17706)), there(Options(17706));
  std::string heard;
  there.SetHandler([&](const std::string& channel, std::span<const uint8_t>) { heard += channel; });
  for (const char* channel : {"X", "Y", "X"}) there.Subscribe(channel);
  loop.Watch(there.fd(), [&] { there.Deliver(); });
  for (const char* channel : {"X", "Y"}) here.Publish(Message(channel, {1}));
  PumpUntil(&loop, [&] { return heard.ends_with("Y"); });
  EXPECT_EQ(heard, "XY");
}

TEST(LcmBus, WhatAHandlerThrowsComesOutOfDeliver) {
  EventLoop loop;
  LcmBus bus(Options(17702));
  bus.SetHandler(
      [](const std::string&, std::span<const uint8_t>) { throw std::runtime_error("from the handler"); });
  bus.Subscribe("X");
  bool caught = false;
  loop.Watch(bus.fd(), [&] {
    try {
      bus.Deliver();
    } catch (const std::runtime_error& error) {
      caught = std::string(error.what()) == "from the handler";
    }
  });
  bus.Publish(Message("X", {1}));
  PumpUntil(&loop, [&] { return caught; });
  EXPECT_TRUE(caught);
  caught = false;
  bus.Publish(Message("X", {1}));  // and the bus still works
  PumpUntil(&loop, [&] { return caught; });
  EXPECT_TRUE(caught);
}

/// Asked four times within what is the longest, as a process does that is watched: after how many times.
int TimesUntilDeaf(EventLoop* loop, LcmBus* bus, int64_t* now_ns) {
  for (int times = 1; times <= 20; ++times) {
    const int64_t until_ns = EventLoop::now_ns() + 20'000'000;
    while (EventLoop::now_ns() < until_ns) loop->PumpOnce(until_ns);
    if (bus->IsDeaf(*now_ns += 1'000'000'000, 4'000'000'000)) return times;
  }
  return 0;
}

TEST(LcmBus, WhereItsThreadStandsStillItIsDeaf) {
  EventLoop loop;
  LcmBus bus(Options(17704));
  bus.Subscribe("X");
  loop.Watch(bus.fd(), [&] { bus.Deliver(); });
  int64_t now_ns = 0;
  EXPECT_EQ(TimesUntilDeaf(&loop, &bus, &now_ns), 0) << "it hears itself where it is alone";
  receiver_stands_still = true;
  EXPECT_GE(TimesUntilDeaf(&loop, &bus, &now_ns), 5);
  receiver_stands_still = false;
  receiver_stands_still.notify_all();
  EXPECT_EQ(TimesUntilDeaf(&loop, &bus, &now_ns), 0) << "it has come to itself";
}

TEST(LcmBus, WhoHearsOthersIsNotDeaf) {
  EventLoop loop;
  LcmBus bus(Options(17705)), other(Options(17705));
  bus.Subscribe("X");
  loop.Watch(bus.fd(), [&] { bus.Deliver(); });
  int heard = 0;
  bus.SetHandler([&](const std::string&, std::span<const uint8_t>) { ++heard; });
  for (int i = 1; i <= 5; ++i) {
    other.Publish(Message("X", {1}));
    PumpUntil(&loop, [&] { return heard == i; });
    EXPECT_FALSE(bus.IsDeaf(i * 1'000'000'000LL, 1));
  }
}

TEST(LcmBus, AWrongUrlIsRefusedWithTheCure) {
  try {
    LcmBus bus({"udp://nowhere", "", 1});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("udpm://GROUP:PORT"), std::string::npos) << error.what();
  }
}

TEST(Endpoint, AStreamOverLcm) {
  EventLoop loop;
  LcmBus writer_bus(Options(17703)), reader_bus(Options(17703));
  StreamWriter::Options writing;
  writing.owner = "TEST";
  writing.roles = {{"reader", true}};
  StreamWriter writer(writing, Term{EventLoop::wall_us(), 1}, Version{});
  StreamReader::Options reading;
  reading.owner = "TEST";
  reading.reader = "READER";
  reading.role = "reader";
  reading.id = 2;
  StreamReader reader(reading);
  Endpoint source(&writer_bus, EventLoop::now_ns), sink(&reader_bus, EventLoop::now_ns);
  source.AddWriter(&writer, "TEST", {"READER"});
  sink.AddReader(&reader, "TEST", {"DMSLAM_TEST_X"});
  loop.Watch(writer_bus.fd(), [&] { writer_bus.Deliver(); });
  loop.Watch(reader_bus.fd(), [&] { reader_bus.Deliver(); });

  replica_t message{};
  message.role.assign(300000, 'x');  // larger than a small receive buffer: lost whole, repaired in parts
  for (int i = 0; i < 20; ++i) {
    message.holder = i;
    writer.Publish("DMSLAM_TEST_X", Encode(message), EventLoop::now_ns());
  }
  std::vector<int64_t> values;
  const int64_t limit = EventLoop::now_ns() + 20'000'000'000;
  while (writer.Backlog("reader") > 0 && EventLoop::now_ns() < limit) {
    source.Advance();
    sink.Advance();
    loop.PumpOnce(std::min(source.deadline_ns(), sink.deadline_ns()));
    while (const auto record = reader.Take()) {
      values.push_back(DecodeReplica(record->channel, *record->bytes).value().holder);
    }
    reader.AcceptTaken();
  }
  std::vector<int64_t> expected(20);
  for (int i = 0; i < 20; ++i) expected[static_cast<size_t>(i)] = i;
  EXPECT_EQ(values, expected);
  EXPECT_EQ(reader.statistics().lost, 0);
}

}  // namespace
}  // namespace dmslam
