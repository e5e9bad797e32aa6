#include "dmslam/messaging/simulation.h"

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <optional>
#include <queue>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/election.h"
#include "dmslam/messaging/forger.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/messaging/stream_reader.h"
#include "dmslam/messaging/stream_writer.h"
#include "dmslam/messaging/succession.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kSecond = 1000 * kMs;
constexpr int64_t kTick = 2 * kMs;
constexpr int64_t kSession = 3;
constexpr size_t kMaxRecords = 150;
constexpr size_t kMaxBytes = 600'000;
constexpr size_t kReaderBytes = 400'000;
constexpr int64_t kWallUs = 1'700'000'000'000'000;  // at the beginning
const char kChannel[] = "DMSLAM_OWNER_RECORD";

// The replicated state: every record appends one entry.
using History = std::vector<int64_t>;

// A record says where its entries belong; replica_t serves as a message with a header, two numbers and a
// text.
Bytes EncodeEntries(size_t place, std::span<const int64_t> entries, size_t padding) {
  replica_t message{};
  message.asker = static_cast<int64_t>(place);
  message.holder = static_cast<int64_t>(entries.size());
  for (const int64_t entry : entries) message.role += std::to_string(entry) + " ";
  message.role.append(padding, 'x');
  return Encode(message);
}

// Appends what a record brings; false if it does not belong at the end.
bool ApplyEntries(const Record& record, History* history) {
  const std::optional<replica_t> message = DecodeReplica(record.channel, *record.bytes);
  if (!message || message->asker != static_cast<int64_t>(history->size())) return false;
  const char* text = message->role.c_str();
  for (int64_t i = 0; i < message->holder; ++i) {
    char* end = nullptr;
    history->push_back(std::strtoll(text, &end, 10));
    text = end;
  }
  return true;
}

// A history in pieces. It only grows, so the part up to the cut needs no copy.
class HistorySnapshot : public SnapshotSource {
 public:
  explicit HistorySnapshot(const History* history) : history_(history) {}
  void BeginSnapshot(int64_t) override {
    next_ = 0;
    end_ = history_->size();
  }
  Piece NextPiece() override {
    const size_t count = std::min<size_t>(40, end_ - next_);
    Piece piece{kChannel, EncodeEntries(next_, std::span(*history_).subspan(next_, count), 900), false};
    next_ += count;
    piece.last = next_ == end_;
    return piece;
  }

 private:
  const History* history_;
  size_t next_ = 0, end_ = 0;
};

// How the network treats messages, and what goes wrong: all drawn from the seed.
struct Conditions {
  explicit Conditions(Random* random) {
    link = random->Below(2) == 0 ? Link::kHost : Link::kLan;
    loss = random->Below(4) == 0 ? 0.0 : random->Uniform(0.0, 0.5);
    duplication = random->Below(2) == 0 ? 0.0 : random->Uniform(0.0, 0.3);
    delay_ns = random->Below(60) * kMs;
    num_readers = 2 + static_cast<int>(random->Below(3));
    records_per_second = 10.0 + random->Below(60);
    num_faults = static_cast<int>(random->Below(4));
    overlapping = random->Below(5) == 0;
    wrong_clocks = random->Below(2) == 0;
    forgeries = random->Below(2) == 0;
  }
  std::string ToText() const {
    return std::string(link == Link::kHost ? "host" : "lan") + ", loss " + std::to_string(loss) +
           ", duplication " + std::to_string(duplication) + ", delay " + std::to_string(delay_ns / kMs) +
           " ms, " + std::to_string(num_readers) + " readers, " + std::to_string(num_faults) + " faults" +
           (overlapping ? ", overlapping" : "") + (wrong_clocks ? ", wrong clocks" : "") +
           (forgeries ? ", forgeries" : "");
  }
  Link link;
  double loss, duplication, records_per_second;
  int64_t delay_ns;
  int num_readers, num_faults;
  bool overlapping;
  bool wrong_clocks;  // hosts are up to two hours apart
  bool forgeries;     // single messages that are changed and sealed again
};

// Messages on their way between nodes; a node that has a side hears only that side.
class Network {
 public:
  Network(const Conditions& conditions, Random* random) : conditions_(conditions), random_(random) {}

  void Send(int from, const std::vector<int>& to, const Outgoing& message, int64_t now_ns) {
    if (message.local) return;
    ++datagrams;
    if (conditions_.forgeries) forger_.Hear(message);
    const size_t fragments = 1 + message.bytes->size() / 1472;
    for (const int node : to) {
      if (node == from || SideOf(from) != SideOf(node)) continue;
      const int copies = healed ? 1 : 1 + (random_->Uniform() < conditions_.duplication);
      for (int copy = 0; copy < copies; ++copy) {
        bool lost = false;
        for (size_t i = 0; i < fragments && !healed; ++i) lost |= random_->Uniform() < conditions_.loss;
        const int64_t delay =
            healed ? kMs
                   : 100'000 +
                         static_cast<int64_t>(random_->Uniform() * static_cast<double>(conditions_.delay_ns));
        if (!lost) events_.push({now_ns + delay, order_++, node, message});
      }
    }
  }
  /// Somebody else's message, heard by all.
  bool Forge(const std::vector<int>& to, int64_t now_ns) {
    const std::optional<Outgoing> forged = forger_.Make(random_);
    if (!forged) return false;
    for (const int node : to) events_.push({now_ns + kMs, order_++, node, *forged});
    return true;
  }
  struct Event {
    int64_t at_ns;
    int64_t order;
    int node;
    Outgoing message;
    bool operator<(const Event& other) const {
      return std::tie(at_ns, order) > std::tie(other.at_ns, other.order);
    }
  };
  std::optional<Event> Next(int64_t now_ns) {
    if (events_.empty() || events_.top().at_ns > now_ns) return std::nullopt;
    Event event = events_.top();
    events_.pop();
    return event;
  }
  std::set<int> far_side;  // nodes that are cut off from the others
  bool healed = false;
  int64_t datagrams = 0;

 private:
  bool SideOf(int node) const { return far_side.contains(node); }
  const Conditions& conditions_;
  Random* random_;
  Forger forger_;
  std::priority_queue<Event> events_;
  int64_t order_ = 0;
};

// A process: several state machines and the messages between them and the network.
class Process {
 public:
  virtual ~Process() = default;
  virtual std::vector<StateMachine*> Machines() = 0;
  /// What its owner does at each tick.
  virtual void Work(int64_t now_ns) = 0;
};

std::string ReaderName(int index) { return "READER" + std::to_string(index); }

// A process that holds a replica.
class ReaderProcess : public Process {
 public:
  ReaderProcess(int index, bool lossless, Random* random, std::string* failure)
      : index_(index),
        lossless_(lossless),
        failure_(failure),
        id_(RandomId(random)),
        reader_(Reading()),
        source_(&history),
        server_(
            Serving(), [this] { return reader_.held(); }, &source_) {}

  static int64_t RandomId(Random* random) { return 1 + static_cast<int64_t>(random->Next() >> 2); }
  static std::string RoleOf(int index) { return "role" + std::to_string(index); }

  std::vector<StateMachine*> Machines() override {
    std::vector<StateMachine*> machines = {&reader_};
    if (lossless_) machines.push_back(&server_);
    return machines;
  }

  void Work(int64_t now_ns) override {
    while (std::optional<Record> record = reader_.Take()) {
      if (record->begins_anew()) history.clear();
      if (!ApplyEntries(*record, &history) && failure_->empty()) {
        *failure_ = "reader " + std::to_string(index_) + " got a record out of order at " +
                    std::to_string(history.size());
      }
      delivered += !record->in_snapshot();
    }
    reader_.AcceptTaken();
    if (reader_.statistics().kept_bytes > 2 * kReaderBytes + 60'000) *failure_ = "a reader kept too much";
    if (reader_.statistics().lost > 0) *failure_ = "a reader gave records up";
    GiveInWhenRefused(now_ns);
  }

  const StreamReader& reader() const { return reader_; }
  History history;
  int64_t delivered = 0;

 private:
  StreamReader::Options Reading() const {
    StreamReader::Options options;
    options.session = kSession;
    options.owner = "OWNER";
    options.reader = ReaderName(index_);
    options.role = lossless_ ? RoleOf(index_) : "viewer";
    options.name = ReaderName(index_);
    options.id = id_;
    options.limits = {500, kReaderBytes, 60'000};
    return options;
  }

  // What an operator would do with a replica that no writer knows as much as.
  void GiveInWhenRefused(int64_t now_ns) {
    if (reader_.state() != StreamReader::State::kRefusedBehind) {
      refused_since_ns_ = now_ns;
    } else if (now_ns - refused_since_ns_ > 4 * kSecond) {
      reader_.Forget();
    }
  }

  ReplicaServer::Options Serving() const {
    return {{kSession, StreamId::kTest, "OWNER", ReaderName(index_), RoleOf(index_), id_},
            ReaderName(index_),
            0,
            Link::kHost};
  }

  int index_;
  bool lossless_;
  std::string* failure_;
  int64_t id_;
  StreamReader reader_;
  HistorySnapshot source_;
  ReplicaServer server_;
  int64_t refused_since_ns_ = 0;
};

// A process that wants to write: listens, looks for the newest replica, takes it, writes.
class OwnerProcess : public Process {
 public:
  enum class Phase { kElecting, kFetching, kWriting, kEnded };

  OwnerProcess(const Conditions& conditions, int num_lossless, bool take_over, int64_t* next_entry,
               Random* random, int64_t now_ns)
      : conditions_(conditions),
        num_lossless_(num_lossless),
        next_entry_(next_entry),
        random_(random),
        id_(ReaderProcess::RandomId(random)),
        clock_offset_us_(conditions.wrong_clocks ? (random->Below(14400) - int64_t{7200}) * 1'000'000 : 0),
        election_(Electing(take_over), now_ns) {}

  std::vector<StateMachine*> Machines() override {
    if (writer_) return {&*writer_};
    if (fetch_) return {&election_, &*fetch_};
    return {&election_};
  }

  void Work(int64_t now_ns) override {
    if (phase_ < Phase::kWriting && election_.state() == WriterElection::State::kRefused)
      phase_ = Phase::kEnded;
    if (phase_ == Phase::kElecting) Elect(now_ns);
    if (phase_ == Phase::kFetching) Fetch(now_ns);
    if (phase_ == Phase::kWriting) Write(now_ns);
  }

  Phase phase() const { return phase_; }
  bool writing() const { return phase_ == Phase::kWriting; }
  const StreamWriter* writer() const { return writer_ ? &*writer_ : nullptr; }
  bool from_replica() const { return from_replica_; }

  History history;
  std::set<int64_t> confirmed;  // entries that another process is known to hold
  std::string failure;
  int64_t published = 0;
  bool quiet = false;  // publishes no more

 private:
  WriterElection::Options Electing(bool take_over) const {
    WriterElection::Options options;
    options.session = kSession;
    options.owner = "OWNER";
    options.name = "owner";
    options.writer = id_;
    options.take_over = take_over;
    return options;
  }

  void Elect(int64_t now_ns) {
    if (election_.state() != WriterElection::State::kWon) return;
    ReplicaFetch::Options options;
    options.session = kSession;
    options.stream = StreamId::kTest;
    options.owner = "OWNER";
    options.id = id_;
    for (int i = 0; i < num_lossless_; ++i)
      options.holders.push_back({ReaderProcess::RoleOf(i), ReaderName(i)});
    options.limits = {500, kReaderBytes, 60'000};
    fetch_.emplace(options, now_ns);
    phase_ = Phase::kFetching;
  }

  void Fetch(int64_t now_ns) {
    while (std::optional<Record> record = fetch_->Take()) {
      if (record->begins_anew()) history.clear();
      if (!ApplyEntries(*record, &history)) failure = "a replica was handed over out of order";
    }
    from_replica_ = fetch_->state() == ReplicaFetch::State::kDone;
    if (fetch_->state() == ReplicaFetch::State::kNone) history.clear();
    if (from_replica_ || fetch_->state() == ReplicaFetch::State::kNone)
      BeginWriting(fetch_->version(), now_ns);
  }

  void BeginWriting(const Version& parent, int64_t now_ns) {
    StreamWriter::Options options;
    options.session = kSession;
    options.owner = "OWNER";
    options.name = "owner " + std::to_string(id_);
    for (int i = 0; i < num_lossless_; ++i) options.roles.push_back({ReaderProcess::RoleOf(i), false});
    options.link = conditions_.link;
    options.pack = (id_ & 2) != 0;
    options.max_records = kMaxRecords;
    options.max_bytes = kMaxBytes;
    options.spare_records = 20;
    options.spare_bytes = 50'000;
    base_ = history.size();
    source_.emplace(&history);
    const int64_t wall_us = kWallUs + clock_offset_us_ + now_ns / 1000;
    writer_.emplace(options, election_.Win(wall_us, parent.epoch), parent, &*source_);
    next_record_ns_ = now_ns;
    phase_ = Phase::kWriting;
  }

  void Write(int64_t now_ns) {
    while (!quiet && !closing_ && now_ns >= next_record_ns_) {
      next_record_ns_ +=
          static_cast<int64_t>(random_->Uniform(0.0, 2.0) * 1e9 / conditions_.records_per_second);
      const int64_t entry = ++*next_entry_;
      const size_t padding = random_->Below(8) == 0 ? random_->Below(30000) : random_->Below(1500);
      Bytes record = EncodeEntries(history.size(), std::span(&entry, 1), padding);
      history.push_back(entry);
      writer_->Publish(kChannel, std::move(record), now_ns);
      ++published;
    }
    for (; writer_->AcknowledgedByAny(confirmed_seq_ + 1) && confirmed_seq_ < writer_->last_seq();
         ++confirmed_seq_) {
      confirmed.insert(history[base_ + static_cast<size_t>(confirmed_seq_)]);
    }
    const WriterStatistics statistics = writer_->statistics();
    if (statistics.kept_records > kMaxRecords || statistics.kept_bytes > kMaxBytes)
      failure = "a writer kept too much";
    if (writer_->close_requested_by() && !closing_) {
      closing_ = true;
      writer_->Close(now_ns);
    }
    if (writer_->superseded_by() || writer_->closed()) phase_ = Phase::kEnded;
  }

  const Conditions& conditions_;
  int num_lossless_;
  int64_t* next_entry_;
  Random* random_;
  int64_t id_;
  int64_t clock_offset_us_;  // of its host's wall clock
  Phase phase_ = Phase::kElecting;
  WriterElection election_;
  std::optional<ReplicaFetch> fetch_;
  std::optional<HistorySnapshot> source_;
  std::optional<StreamWriter> writer_;
  size_t base_ = 0;  // length of the history this term began with
  int64_t next_record_ns_ = 0, confirmed_seq_ = 0;
  bool closing_ = false, from_replica_ = false;
};

// Everything together, one tick after the other.
class World {
 public:
  explicit World(uint64_t seed) : random_(seed), conditions_(&random_), network_(conditions_, &random_) {
    const int lossless = std::min(2, conditions_.num_readers);
    for (int i = 0; i < conditions_.num_readers; ++i) {
      num_lossless_ = lossless;
      nodes_.push_back(2 + i);
      StartReader(i);
    }
    report_.conditions = conditions_.ToText();
    faults_left_ = conditions_.num_faults;
    next_fault_ns_ = 3 * kSecond + random_.Below(3000) * kMs;
    end_ns_ = next_fault_ns_ + 2 * kSecond;
  }

  SimulationReport Run() {
    while (report_.failure.empty() && !Finished()) {
      Deliver();
      for (size_t i = 0; i < 2; ++i) Tick(owners_[i].get(), static_cast<int>(i));
      for (size_t i = 0; i < readers_.size(); ++i) Tick(readers_[i].get(), 2 + static_cast<int>(i));
      Supervise();
      CauseFaults();
      Forge();
      now_ns_ += kTick;
    }
    if (report_.failure.empty()) CheckConfirmed();
    for (size_t i = 0; i < 2; ++i) EndOwner(i);
    for (size_t i = 0; i < readers_.size(); ++i) KillReader(i);
    report_.datagrams = network_.datagrams;
    report_.confirmed = static_cast<int64_t>(confirmed_.size());
    return report_;
  }

 private:
  void StartReader(int index) {
    auto process = std::make_unique<ReaderProcess>(index, index < num_lossless_, &random_, &report_.failure);
    const auto slot = static_cast<size_t>(index);
    if (slot == readers_.size()) readers_.emplace_back();
    readers_[slot] = std::move(process);
    if (slot == restart_reader_ns_.size()) restart_reader_ns_.push_back(0);
  }
  void StartOwner(size_t slot, bool take_over) {
    EndOwner(slot);
    owners_[slot] = std::make_unique<OwnerProcess>(conditions_, num_lossless_, take_over, &next_entry_,
                                                   &random_, now_ns_);
  }
  void EndOwner(size_t slot) {
    if (!owners_[slot]) return;
    const OwnerProcess& owner = *owners_[slot];
    report_.published += owner.published;
    report_.hand_overs += owner.from_replica();
    confirmed_.insert(owner.confirmed.begin(), owner.confirmed.end());
    if (owner.writer() != nullptr) {
      report_.parts_repaired += owner.writer()->statistics().parts_repaired;
      report_.snapshots += owner.writer()->statistics().snapshots;
    }
    owners_[slot].reset();
  }
  void KillReader(size_t slot) {
    if (!readers_[slot]) return;
    report_.delivered += readers_[slot]->delivered;
    readers_[slot].reset();
  }
  Process* ProcessAt(int node) {
    if (node < 2) return owners_[static_cast<size_t>(node)].get();
    return readers_[static_cast<size_t>(node - 2)].get();
  }

  void Deliver() {
    while (const std::optional<Network::Event> event = network_.Next(now_ns_)) {
      Process* process = ProcessAt(event->node);
      if (process == nullptr) continue;
      for (StateMachine* machine : process->Machines()) {
        machine->Receive(event->message.channel, *event->message.bytes, now_ns_);
      }
    }
  }

  void Tick(Process* process, int node) {
    if (process == nullptr) return;
    process->Work(now_ns_);
    for (StateMachine* machine : process->Machines()) {
      if (now_ns_ >= machine->deadline_ns()) machine->Advance(now_ns_);
      for (const Outgoing& message : machine->TakeOutgoing()) network_.Send(node, nodes_, message, now_ns_);
    }
  }

  void Supervise() {
    for (size_t i = 0; i < 2; ++i) {
      if (!owners_[i]) continue;
      owners_[i]->quiet = network_.healed;
      if (!owners_[i]->failure.empty()) report_.failure = owners_[i]->failure;
      if (owners_[i]->phase() == OwnerProcess::Phase::kEnded) EndOwner(i);
    }
    if (owners_[0] || owners_[1]) restart_owner_ns_ = now_ns_ + 300 * kMs;
    if (now_ns_ >= restart_owner_ns_) StartOwner(random_.Below(2), false);
    for (size_t i = 0; i < readers_.size(); ++i) {
      if (!readers_[i] && now_ns_ >= restart_reader_ns_[i]) StartReader(static_cast<int>(i));
    }
    if (now_ns_ >= split_until_ns_) network_.far_side.clear();
  }

  // One writer, and all readers close behind it.
  const OwnerProcess* Writer() const {
    const OwnerProcess* writer = nullptr;
    for (const auto& owner : owners_) {
      if (!owner) continue;
      if (writer != nullptr || !owner->writing()) return nullptr;
      writer = owner.get();
    }
    return writer;
  }
  bool Healthy(size_t tolerance) const {
    const OwnerProcess* writer = Writer();
    if (writer == nullptr || !network_.far_side.empty()) return false;
    return std::all_of(readers_.begin(), readers_.end(), [&](const auto& reader) {
      return reader && reader->reader().term() == writer->writer()->term() &&
             reader->reader().state() == StreamReader::State::kFollowing &&
             reader->history.size() + tolerance >= writer->history.size();
    });
  }

  void CauseFaults() {
    if (faults_left_ == 0 || now_ns_ < next_fault_ns_) return;
    // Between faults the system recovers, or gets half a minute to do so.
    if (!conditions_.overlapping && !Healthy(40) && now_ns_ < next_fault_ns_ + 30 * kSecond) return;
    if (!conditions_.overlapping && !Healthy(40)) {
      faults_left_ = 0;
      return;
    }
    --faults_left_;
    ++report_.faults;
    CauseFault(random_.Below(conditions_.overlapping ? 6 : 5));
    next_fault_ns_ = now_ns_ + 500 * kMs + random_.Below(3000) * kMs;
    end_ns_ = next_fault_ns_ + 2 * kSecond;
  }

  void Forge() {
    if (!conditions_.forgeries || network_.healed || now_ns_ < next_forgery_ns_) return;
    next_forgery_ns_ = now_ns_ + 700 * kMs + random_.Below(2000) * kMs;
    report_.forgeries += network_.Forge(nodes_, now_ns_);
  }

  void CauseFault(uint32_t kind) {
    const size_t present = owners_[0] ? 0 : 1;
    const size_t vacant = 1 - present;
    const size_t reader = random_.Below(static_cast<uint32_t>(readers_.size()));
    switch (kind) {
      case 0:
        EndOwner(present);
        break;
      case 1:
        KillReader(reader);
        restart_reader_ns_[reader] = now_ns_ + random_.Below(7000) * kMs;
        break;
      case 2:
      case 3:
        if (!owners_[vacant]) StartOwner(vacant, kind == 2);
        break;
      default:
        for (const int node : nodes_) {
          if (random_.Below(2) == 0) network_.far_side.insert(node);
        }
        split_until_ns_ = now_ns_ + 300 * kMs + random_.Below(4000) * kMs;
        if (kind == 5 && !owners_[vacant]) {
          network_.far_side.erase(static_cast<int>(present));
          network_.far_side.insert(static_cast<int>(vacant));
          split_until_ns_ = now_ns_ + 9 * kSecond;
          StartOwner(vacant, false);
        }
    }
  }

  std::string Describe() const {
    std::string text;
    for (const auto& owner : owners_) {
      if (!owner) continue;
      text += "owner in phase " + std::to_string(static_cast<int>(owner->phase())) + " with " +
              std::to_string(owner->history.size()) + " entries; ";
    }
    for (const auto& reader : readers_) {
      if (!reader) continue;
      text += "reader in state " + std::to_string(static_cast<int>(reader->reader().state())) + " with " +
              std::to_string(reader->history.size()) + " " + reader->reader().problem() + "; ";
    }
    return text;
  }

  bool Finished() {
    if (!network_.healed && faults_left_ == 0 && now_ns_ >= end_ns_ &&
        (Healthy(40) || now_ns_ >= end_ns_ + 30 * kSecond)) {
      network_.healed = true;
      network_.far_side.clear();
      healed_ns_ = now_ns_;
    }
    if (!network_.healed || now_ns_ < healed_ns_ + kSecond) return false;
    if (Healthy(0)) {
      final_ = Writer()->history;
      for (const auto& reader : readers_) {
        if (reader->history != final_) report_.failure = "a replica differs from the writer's state";
      }
      return true;
    }
    if (now_ns_ > healed_ns_ + 60 * kSecond)
      report_.failure = "no agreement a minute after the network healed: " + Describe();
    return false;
  }

  void CheckConfirmed() {
    for (const auto& owner : owners_) {
      if (owner) confirmed_.insert(owner->confirmed.begin(), owner->confirmed.end());
    }
    const std::set<int64_t> present(final_.begin(), final_.end());
    if (present.size() != final_.size()) report_.failure = "a record was applied twice";
    if (conditions_.overlapping) return;
    for (const int64_t entry : confirmed_) {
      if (present.contains(entry)) continue;
      report_.failure = "record " + std::to_string(entry) + " was confirmed and is lost";
      return;
    }
  }

  Random random_;
  Conditions conditions_;
  Network network_;
  std::vector<int> nodes_ = {0, 1};
  int num_lossless_ = 0;
  std::unique_ptr<OwnerProcess> owners_[2];
  std::vector<std::unique_ptr<ReaderProcess>> readers_;
  std::vector<int64_t> restart_reader_ns_;
  int64_t now_ns_ = kSecond;
  int64_t restart_owner_ns_ = 0, split_until_ns_ = 0, next_fault_ns_ = 0, end_ns_ = 0, healed_ns_ = 0,
          next_forgery_ns_ = 0;
  int64_t next_entry_ = 0;
  int faults_left_ = 0;
  std::set<int64_t> confirmed_;
  History final_;
  SimulationReport report_;
};

}  // namespace

SimulationReport SimulateSchedule(uint64_t seed) { return World(DeriveSeed(seed, 0, "protocol")).Run(); }

}  // namespace dmslam
