#include "dmslam/messaging/keyed_bus.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <set>

#include "dmslam/messaging/codec.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr char kX[] = "DMSLAM_X";

/// What everybody hears, and somebody who listens and can send.
class Air {
 public:
  class Port : public Bus {
   public:
    explicit Port(Air* air) : air_(air) { air_->ports_.insert(this); }
    ~Port() override { air_->ports_.erase(this); }
    Port(const Port&) = delete;
    Port& operator=(const Port&) = delete;
    void Subscribe(const std::string& channel) override { channels_.insert(channel); }
    void SetHandler(Handler handler) override { handler_ = std::move(handler); }
    void Publish(const Outgoing& message) override {
      air_->recorded.push_back(message);
      if (air_->lossy && air_->lossy(message)) return;
      air_->queue_.push_back({this, message});
    }

   private:
    friend class Air;
    Air* air_;
    std::set<std::string> channels_;
    Handler handler_;
  };

  void Settle() {
    while (!queue_.empty()) {
      const auto [sender, message] = queue_.front();
      queue_.pop_front();
      for (Port* port : std::set<Port*>(ports_)) {
        if (port == sender && !echoes_to_sender) continue;
        if (port->handler_ && port->channels_.contains(message.channel))
          port->handler_(message.channel, *message.bytes);
      }
    }
  }
  /// Of the attacker's.
  void Send(const std::string& channel, Bytes bytes) {
    queue_.push_back({nullptr, {channel, std::make_shared<const Bytes>(std::move(bytes)), false}});
    Settle();
  }
  void SendAgain(const std::vector<Outgoing>& messages) {
    for (const Outgoing& message : messages) Send(message.channel, *message.bytes);
  }

  std::vector<Outgoing> recorded;
  std::function<bool(const Outgoing&)> lossy;
  bool echoes_to_sender = false;  ///< as LCM does over UDP
  int64_t now_ns = 0;

 private:
  std::set<Port*> ports_;
  std::deque<std::pair<Port*, Outgoing>> queue_;
};

BusKey KeyOf(uint8_t fill) { return BusKey(Bytes(32, fill)); }

struct Process {
  Air::Port port;
  std::vector<std::string> warnings;
  KeyedBus bus;
  std::vector<Bytes> heard;

  Process(Air* air, const BusKey& key, uint32_t session = 5)
      : port(air),
        bus(&port, key,
            {session, [air] { return air->now_ns; }, [] { return int64_t{1}; },
             [this](const std::string& text) { warnings.push_back(text); }}) {
    bus.Subscribe(kX);
    bus.SetHandler([this](const std::string& channel, std::span<const uint8_t> bytes) {
      EXPECT_EQ(channel, kX);
      heard.emplace_back(bytes.begin(), bytes.end());
    });
    air->Settle();
  }
  void Say(uint8_t word) { bus.Publish({kX, std::make_shared<const Bytes>(Bytes{word}), false}); }
  const KeyedBus::Statistics& counts() const { return bus.statistics(); }
};

class KeyedBusTest : public testing::Test {
 protected:
  std::unique_ptr<Process> Start(uint8_t key = 1, uint32_t session = 5) {
    return std::make_unique<Process>(&air_, KeyOf(key), session);
  }
  void Say(Process& process, uint8_t word) {
    process.Say(word);
    air_.Settle();
  }
  /// What was said on the channel so far, as it was sent.
  std::vector<Outgoing> Recorded(const std::string& channel) const {
    std::vector<Outgoing> found;
    for (const Outgoing& message : air_.recorded) {
      if (message.channel == channel) found.push_back(message);
    }
    return found;
  }

  Air air_;
};

TEST_F(KeyedBusTest, ThoseWithTheKeyHearOneAnother) {
  const auto a = Start(), b = Start(), c = Start();
  Say(*a, 1);
  Say(*b, 2);
  b->bus.Publish({kX, std::make_shared<const Bytes>(), false});
  air_.Settle();
  EXPECT_EQ(a->heard, (std::vector<Bytes>{{2}, {}}));
  EXPECT_EQ(b->heard, (std::vector<Bytes>{{1}}));
  EXPECT_EQ(c->heard, (std::vector<Bytes>{{1}, {2}, {}}));
  for (const Process* process : {a.get(), b.get(), c.get()}) {
    EXPECT_EQ(process->counts().refused(), 0);
    EXPECT_EQ(process->counts().early, 0);
    EXPECT_TRUE(process->warnings.empty());
  }
  EXPECT_LE(Recorded(kProofChannel).size(), 16u) << "few words are needed";
  EXPECT_EQ(a->bus.overhead_bytes(), kTagBytes);
}

TEST_F(KeyedBusTest, TagsAreCountedAsTheyAreMadeAndVerified) {
  const auto a = Start(), b = Start();
  const KeyedBus::Statistics before = a->counts(), heard_before = b->counts();
  b->bus.Publish({kX, std::make_shared<const Bytes>(Bytes{1, 2, 3}), false});
  Say(*a, 1);
  EXPECT_EQ(a->counts().made - before.made, 1);
  EXPECT_EQ(a->counts().verified - before.verified, 1);
  EXPECT_EQ(a->counts().bytes - before.bytes, 1);
  EXPECT_EQ(b->counts().verified - heard_before.verified, 1);
  EXPECT_EQ(b->counts().bytes - heard_before.bytes, 3);
}

TEST_F(KeyedBusTest, WhoHasNoKeyIsNotHeard) {
  const auto a = Start(), b = Start();
  for (int i = 0; i < 3; ++i) air_.Send(kX, {1, 2, 3});
  air_.Send(kX, {});
  EXPECT_TRUE(b->heard.empty());
  EXPECT_EQ(b->counts().unverified, 4);
  ASSERT_EQ(b->warnings.size(), 1u) << "once";
  EXPECT_NE(b->warnings[0].find("its sender has no key; give the same --key"), std::string::npos);
}

TEST_F(KeyedBusTest, WhoHasAnotherKeyIsNotHeard) {
  const auto a = Start(), stranger = Start(2);
  Say(*stranger, 1);
  Say(*a, 2);
  EXPECT_TRUE(a->heard.empty());
  EXPECT_TRUE(stranger->heard.empty());
  EXPECT_EQ(a->counts().unverified, 2) << "its question too";
  ASSERT_FALSE(a->warnings.empty());
  EXPECT_NE(a->warnings[0].find("another key"), std::string::npos);
}

TEST_F(KeyedBusTest, WhatIsChangedCutOrMovedIsRefused) {
  const auto a = Start(), b = Start();
  b->bus.Subscribe("DMSLAM_Y");
  air_.lossy = [](const Outgoing& message) { return message.channel == kX; };
  Say(*a, 77);
  const Bytes sound = *Recorded(kX).at(0).bytes;
  for (size_t i = 0; i < sound.size(); ++i) {
    Bytes changed = sound;
    changed[i] ^= 1;
    air_.Send(kX, changed);
    air_.Send(kX, Bytes(sound.begin(), sound.begin() + static_cast<ptrdiff_t>(i)));
    if (i > 0) air_.Send(kX, Bytes(sound.begin() + static_cast<ptrdiff_t>(i), sound.end()));
  }
  air_.Send("DMSLAM_Y", sound);
  EXPECT_TRUE(b->heard.empty());
  EXPECT_EQ(b->counts().unverified, static_cast<int64_t>(3 * sound.size()));
  air_.Send(kX, sound);  // late, but as it was sent
  EXPECT_EQ(b->heard, (std::vector<Bytes>{{77}}));
}

TEST_F(KeyedBusTest, AnotherSessionIsNotHeard) {
  const auto a = Start(1, 5), b = Start(1, 6), open = Start(1, 0);
  Say(*a, 1);
  Say(*open, 2);
  EXPECT_EQ(b->heard, (std::vector<Bytes>{{2}}));
  EXPECT_GE(b->counts().foreign, 1);
  EXPECT_EQ(open->heard, (std::vector<Bytes>{{1}})) << "it learns its session later";
}

TEST_F(KeyedBusTest, WhatIsRepeatedIsHeardOnce) {
  const auto a = Start(), b = Start();
  Say(*a, 1);
  Say(*a, 2);
  for (int i = 0; i < 10; ++i) air_.SendAgain(Recorded(kX));
  EXPECT_EQ(b->heard, (std::vector<Bytes>{{1}, {2}}));
  EXPECT_EQ(b->counts().repeated, 20);
  EXPECT_EQ(b->warnings.size(), 1u);
}

TEST_F(KeyedBusTest, TheOrderMayChangeOnTheWay) {
  const auto a = Start(), b = Start();
  air_.lossy = [](const Outgoing& message) { return message.channel == kX; };
  for (uint8_t word = 0; word < 200; ++word) Say(*a, word);
  std::vector<Outgoing> late = Recorded(kX);
  std::reverse(late.begin(), late.end());
  air_.SendAgain(late);
  air_.SendAgain(late);
  ASSERT_EQ(b->heard.size(), 200u);
  EXPECT_EQ(b->heard.front(), Bytes{199});
  EXPECT_EQ(b->heard.back(), Bytes{0});
  EXPECT_EQ(b->counts().repeated, 200);
}

TEST_F(KeyedBusTest, ASenderThatStartsAnewIsHeardAndItsFormerWordsAreNot) {
  auto a = Start();
  const auto b = Start();
  Say(*a, 1);
  Say(*a, 2);
  a.reset();
  const std::vector<Outgoing> former = air_.recorded;
  a = Start();
  Say(*a, 3);
  air_.SendAgain(former);
  air_.now_ns += 5000 * kMs;
  air_.SendAgain(former);
  Say(*a, 4);
  EXPECT_EQ(b->heard, (std::vector<Bytes>{{1}, {2}, {3}, {4}}));
}

TEST_F(KeyedBusTest, AReceiverThatStartsAnewHearsNoEchoOfWhoIsStillThere) {
  const auto a = Start();
  auto b = Start();
  Say(*a, 1);
  b.reset();
  const std::vector<Outgoing> former = air_.recorded;
  b = Start();
  air_.SendAgain(former);
  EXPECT_TRUE(b->heard.empty());
  Say(*a, 2);
  air_.SendAgain(former);
  EXPECT_EQ(b->heard, (std::vector<Bytes>{{2}}));
}

TEST_F(KeyedBusTest, AReceiverThatStartsAnewHearsNoEchoEvenBeforeTheFirstAnswer) {
  auto a = Start();
  auto b = Start();
  Say(*a, 1);
  b.reset();
  const std::vector<Outgoing> former = air_.recorded;
  air_.lossy = [](const Outgoing&) { return true; };  // nobody hears the question
  b = Start();
  air_.SendAgain(former);
  EXPECT_TRUE(b->heard.empty());
  air_.lossy = nullptr;
  Say(*a, 2);
  EXPECT_TRUE(b->heard.empty()) << "it was asked a moment ago";
  air_.now_ns += 20 * kMs;
  Say(*a, 3);  // left out: makes b ask again
  Say(*a, 4);
  air_.SendAgain(former);
  EXPECT_EQ(b->heard, (std::vector<Bytes>{{4}}));
}

TEST_F(KeyedBusTest, TheDeadAreNotHeardByWhoNeverKnewThem) {
  auto a = Start();
  auto b = Start();
  Say(*a, 1);
  const std::vector<Outgoing> former = air_.recorded;
  a.reset();
  b.reset();
  const auto late = Start();
  air_.SendAgain(former);
  EXPECT_EQ(late->counts().refused(), 0) << "they might still answer";
  EXPECT_EQ(late->counts().early, 1);
  for (int i = 0; i < 20; ++i, air_.now_ns += 100 * kMs) air_.SendAgain(former);
  EXPECT_EQ(late->counts().refused(), 0);
  air_.SendAgain(former);
  EXPECT_TRUE(late->heard.empty());
  EXPECT_EQ(late->counts().echoes, static_cast<int64_t>(former.size()));
  ASSERT_EQ(late->warnings.size(), 1u);
  EXPECT_NE(late->warnings[0].find("echo"), std::string::npos);
}

TEST_F(KeyedBusTest, WhoLoadsAFileBeforeItListensIsNoEcho) {
  const auto a = Start();
  air_.lossy = [](const Outgoing& message) { return message.channel == kProofChannel; };
  const auto b = Start();
  Say(*b, 1);
  air_.now_ns += 5000 * kMs;
  Say(*b, 2);
  air_.lossy = nullptr;
  air_.now_ns += 20 * kMs;
  Say(*b, 3);
  Say(*b, 4);
  EXPECT_EQ(a->heard, (std::vector<Bytes>{{4}}));
  EXPECT_EQ(a->counts().refused(), 0);
  EXPECT_EQ(a->counts().early, 3);
}

TEST_F(KeyedBusTest, EchoesOfTheDeadMakeNobodyTalkative) {
  auto a = Start();
  const auto b = Start();
  Say(*a, 1);
  const std::vector<Outgoing> former = air_.recorded;
  a.reset();
  const auto late = Start();
  air_.recorded.clear();
  for (int i = 0; i < 1000; ++i, air_.now_ns += kMs) air_.SendAgain(former);
  EXPECT_LT(air_.recorded.size(), 2000u) << "1000 questions of the dead are answered at most once each";
  EXPECT_TRUE(late->heard.empty());
}

TEST_F(KeyedBusTest, AQuestionThatIsLostIsAskedAgain) {
  const auto a = Start();
  int lost = 0;
  air_.lossy = [&lost](const Outgoing& message) { return message.channel == kProofChannel && ++lost <= 3; };
  const auto b = Start();
  for (uint8_t word = 0; word < 20; ++word) {
    air_.now_ns += 100 * kMs;
    Say(*a, word);
    Say(*b, word);
  }
  EXPECT_GE(a->heard.size(), 15u);
  EXPECT_GE(b->heard.size(), 15u);
  EXPECT_EQ(a->heard.back(), Bytes{19});
  EXPECT_EQ(b->heard.back(), Bytes{19});
  EXPECT_EQ(a->counts().refused() + b->counts().refused(), 0);
}

TEST_F(KeyedBusTest, ManyStartsWithoutEnd) {
  const auto b = Start();
  auto a = Start();
  Say(*a, 1);
  a.reset();
  const std::vector<Outgoing> former = air_.recorded;  // with the answer by which it was let in
  for (uint8_t i = 0; i < 254; ++i) {
    air_.now_ns += 10 * kMs;
    Say(*Start(), i);
  }
  ASSERT_EQ(b->heard.size(), 255u) << "all were heard";
  Say(*Start(), 7);  // now the first one is forgotten
  ASSERT_EQ(b->heard.size(), 256u);
  air_.SendAgain(former);
  EXPECT_EQ(b->heard.size(), 256u) << "and is not let in again by an echo";
}

TEST_F(KeyedBusTest, WhatIsEchoedToItsSenderIsHeardAsWithoutAKey) {
  air_.echoes_to_sender = true;
  const auto a = Start(), b = Start();
  Say(*a, 1);
  EXPECT_EQ(a->heard, (std::vector<Bytes>{{1}}));
  EXPECT_EQ(b->heard, (std::vector<Bytes>{{1}}));
  EXPECT_EQ(a->counts().refused(), 0);
}

TEST_F(KeyedBusTest, AProofThatIsNoneChangesNothing) {
  const auto a = Start();
  Air::Port port(&air_);
  uint64_t counter = 0;
  const auto say = [&](Bytes body) {
    air_.Send(kProofChannel, KeyOf(1).WithTag(kProofChannel, body, {5, ++counter, 99}));
  };
  proof_t proof{};
  proof.kind = proof_t::KIND_ANSWERS;
  proof.challenge[0] = 4711;
  say(Encode(proof));
  proof.kind = 3;
  say(Encode(proof));
  say({});
  say(Bytes(8, 1));
  Bytes longer = Encode(proof);
  longer.push_back(0);
  say(longer);
  air_.Send(kX, KeyOf(1).WithTag(kX, Bytes{1}, {5, ++counter, 99}));
  EXPECT_TRUE(a->heard.empty());
  EXPECT_EQ(a->counts().early, 1);
}

TEST(CounterWindow, TakesEachOnceWithinItsLength) {
  CounterWindow window(10);
  EXPECT_FALSE(window.Take(0));
  EXPECT_FALSE(window.Take(10));
  EXPECT_TRUE(window.Take(12));
  EXPECT_TRUE(window.Take(11));
  EXPECT_FALSE(window.Take(11));
  EXPECT_FALSE(window.Take(12));
  const uint64_t far = 12 + CounterWindow::kLength;
  EXPECT_TRUE(window.Take(far));
  EXPECT_FALSE(window.Take(12));
  EXPECT_TRUE(window.Take(13));
  EXPECT_FALSE(window.Take(13));
  EXPECT_TRUE(window.Take(far + 3 * CounterWindow::kLength));
  EXPECT_FALSE(window.Take(far));
  EXPECT_TRUE(window.Take(far + 2 * CounterWindow::kLength + 1));
  EXPECT_TRUE(window.Take(UINT64_MAX));
  EXPECT_FALSE(window.Take(UINT64_MAX));
  EXPECT_FALSE(window.Take(1));
}

// Against a set, under shuffled and repeated counters.
TEST(CounterWindow, IsASetOfWhatIsNotTooOld) {
  CounterWindow window(0);
  std::set<uint64_t> seen;
  uint64_t newest = 0, state = 1;
  for (int i = 0; i < 200'000; ++i) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    const uint64_t ahead = newest + 3000;
    const uint64_t counter = 1 + (ahead > 9000 ? ahead - 9000 : 0) + (state >> 33) % 9001;
    const bool fresh = counter + CounterWindow::kLength > newest && seen.insert(counter).second;
    ASSERT_EQ(window.Take(counter), fresh) << counter << " after " << newest;
    newest = std::max(newest, counter);
  }
}

}  // namespace
}  // namespace dmslam
