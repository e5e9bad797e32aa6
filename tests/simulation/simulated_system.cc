#include "simulated_system.h"

#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <utility>

#include "collector/make_collector.h"
#include "dmslam/recording/checkpoint.h"
#include "dmslam/recording/journal.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/util/check.h"
#include "dmslam/util/not_yet_error.h"
#include "frontend/make_frontend.h"
#include "loopcloser/make_loopcloser.h"
#include "mapper/make_mapper.h"
#include "player/player_node.h"
#include "run/resume.h"
#include "simulated_disk.h"

namespace dmslam::simulation {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kSecond = 1000 * kMs;
constexpr int64_t kBeginNs = kSecond;
constexpr int64_t kWallUs = 1'700'000'000'000'000;  // at the beginning
constexpr int64_t kLongestNs = 1200 * kSecond;
constexpr int64_t kLookAgainNs = kSecond / 500;
constexpr int64_t kBackNs = 8 * kSecond;  // who begins is surely back in the run
constexpr int64_t kFarewellNs = 5 * kSecond;
constexpr int64_t kStepNs = 20'000;  // what happens within it happens at once
constexpr uint32_t kFirstSession = 1;
constexpr int64_t kBootNs = 20 * kSecond;  // from a host's start until its processes begin

/// The clocks of a host: none agrees with another one's.
struct Host {
  int64_t up_since_ns = 0;  ///< of its monotonic clock
  int64_t wall_us = 0;      ///< how far its wall clock is off
};

/// A process, or the place where one was and will be again.
struct Process {
  std::string role;
  int host = 0;
  int lives = 0;  ///< how many have begun
  std::unique_ptr<Node> node;
  SimulatedNetwork::Port* port = nullptr;
  PlayerNode* player = nullptr;  ///< the same, of the player
  std::optional<int64_t> begins_ns;
  int64_t due_ns = 0;         ///< when it looks again, at the latest
  int64_t busy_until_ns = 0;  ///< before that it does not look
  std::optional<int64_t> paused_until_ns;
  std::optional<Fault> dies;  ///< in the middle of its work
  bool takes_over = false;    ///< from one that is there
  int last_code = 0;
  bool done = false;
};

/// While it lives this program can write into no file.
class FullDisk {
 public:
  FullDisk() : former_handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &former_);
    const rlimit none{0, former_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &none);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &former_);
    std::signal(SIGXFSZ, former_handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  void (*former_handler_)(int);
  rlimit former_{};
};

class SimulatedSystem {
 public:
  SimulatedSystem(const Workload& workload, const Schedule& schedule, std::string folder)
      : workload_(workload),
        schedule_(schedule),
        folder_(std::move(folder)),
        settings_(workload.settings),
        random_(DeriveSeed(schedule.seed, 0, "run")),
        network_(schedule.network, &random_) {
    settings_.Set("collector.checkpoint_s", std::to_string(schedule.checkpoint_s));
    for (int i = 0; i < schedule.num_hosts; ++i) {
      hosts_.push_back({static_cast<int64_t>(random_.Below(100'000)) * kSecond,
                        i == 0 ? 0 : (random_.Below(7200) - int64_t{3600}) * 1'000'000});
    }
    for (const std::string& role : Roles()) {
      Process process;
      process.role = role;
      process.host = schedule.host_of.at(role);
      process.begins_ns = kBeginNs + LittleLater();
      const auto later = schedule.begins_ns.find(role);
      if (later != schedule.begins_ns.end()) process.begins_ns = kBeginNs + later->second;
      processes_.push_back(std::move(process));
    }
  }

  Outcome Run() {
    while (outcome_.failure.empty() && !AllDone()) {
      now_ns_ = std::max(now_ns_ + kStepNs, NextNs());
      network_.set_now(now_ns_);
      if (now_ns_ > kLongestNs) Fail("does not end:" + WhoWaits());
      Farewell();
      CauseFaults();
      GoOn();
      const std::set<const SimulatedNetwork::Port*> heard = network_.Deliver(now_ns_);
      for (Process& process : processes_) {
        if (process.begins_ns && *process.begins_ns <= now_ns_) Begin(&process);
        if (heard.contains(process.port)) process.due_ns = now_ns_;
        if (MayWork(process) && process.due_ns <= now_ns_) TakeTurn(&process);
        if (process.dies && process.port != nullptr && process.port->has_died()) Die(&process);
      }
    }
    outcome_.virtual_s = static_cast<double>(now_ns_ - kBeginNs) * 1e-9;
    outcome_.network = network_.statistics();
    ReadResults(folder_, &outcome_);
    return std::move(outcome_);
  }

 private:
  // ---- Time

  static bool MayWork(const Process& process) { return process.node && !process.paused_until_ns; }
  bool AllDone() const {
    return std::ranges::all_of(processes_, [](const Process& process) { return process.done; });
  }

  int64_t NextNs() const {
    int64_t next = network_.next_ns();
    for (const Process& process : processes_) {
      if (process.begins_ns) next = std::min(next, *process.begins_ns);
      if (process.paused_until_ns) next = std::min(next, *process.paused_until_ns);
      if (MayWork(process)) next = std::min(next, std::max(process.due_ns, process.busy_until_ns));
    }
    if (farewell_ns_) next = std::min(next, *farewell_ns_ + (*farewell_ns_ > now_ns_ ? 0 : kFarewellNs));
    if (cut_until_ns_) next = std::min(next, *cut_until_ns_);
    if (next_fault_ < schedule_.faults.size() && frames_played_ >= schedule_.faults[next_fault_].at_frame)
      next = std::min(next, std::max(FaultNs(), now_ns_ + kLookAgainNs));
    return next;
  }

  void TakeTurn(Process* process) {
    if (process->busy_until_ns > now_ns_) return;
    ++outcome_.turns;
    std::optional<int> code;
    std::string problem;
    std::optional<FullDisk> full_disk;
    if (process->role == "collector" && now_ns_ < disk_full_until_ns_) full_disk.emplace();
    try {
      process->node->Advance();
      code = process->node->exit_code();
      problem = process->node->problem();
    } catch (const NotYetError& error) {
      code = kExitNotYet, problem = error.what();
    } catch (const InputError& error) {
      code = kExitInput, problem = error.what();
    } catch (const std::exception& error) {
      code = kExitInternal, problem = error.what();
    }
    full_disk.reset();
    if (code) return OnEnd(process, *code, problem);
    const int64_t deadline = process->node->deadline_ns();
    process->due_ns = deadline == INT64_MAX ? INT64_MAX : deadline - hosts_[process->host].up_since_ns;
    process->busy_until_ns =
        now_ns_ + static_cast<int64_t>(random_.Uniform() * static_cast<double>(schedule_.slowest_turn_ns));
    if (process->player != nullptr)
      frames_played_ = std::max(frames_played_, static_cast<uint32_t>(process->player->published()));
  }

  // ---- Processes

  /// What the processes last said of themselves.
  std::string WhoWaits() const {
    return WaitOf<PlayerStatus>() + WaitOf<FrontendStatus>() + WaitOf<MapperStatus>() +
           WaitOf<LoopcloserStatus>();
  }
  template <typename Status>
  std::string WaitOf() const {
    const std::string& channel = wire::Info<Status>().channel;
    const Outgoing* newest = network_.Newest(channel);
    const auto status = newest == nullptr ? std::nullopt : wire::Decode<Status>(*newest->bytes);
    if (!status) return "";
    const ProcessHealth& health = status->head.health;
    std::string text = "\n  " + channel + ": queue " + std::to_string(health.queue_depth) +
                       ", lacked by readers " + std::to_string(health.unacknowledged);
    if (!health.waiting_for.empty()) text += ", waits for " + health.waiting_for;
    if (!status->head.reason.empty()) text += " (" + status->head.reason + ")";
    return text;
  }

  /// The collector ends last; whoever is there a while later is told to end.
  void Farewell() {
    if (!farewell_ns_ || *farewell_ns_ > now_ns_) return;
    for (Process& process : processes_) {
      process.begins_ns.reset();
      if (!process.node) {
        process.done = true;
      } else if (!process.node->exit_code()) {
        process.node->Stop();
        process.due_ns = now_ns_;
      }
    }
    if (*farewell_ns_ + kFarewellNs < now_ns_) Fail("does not end when it is told to:" + WhoWaits());
  }

  void Tell(const std::string& who, const std::string& what) {
    char when[32];
    std::snprintf(when, sizeof(when), "%9.3f s ", static_cast<double>(now_ns_ - kBeginNs) * 1e-9);
    outcome_.story += when + ("frame " + std::to_string(frames_played_) + ": ") + who + " " + what + "\n";
  }
  void Fail(const std::string& why) {
    if (outcome_.failure.empty()) outcome_.failure = why;
  }

  NodeContext ContextFor(const Process& process) {
    NodeContext context;
    const Host* host = &hosts_[process.host];
    context.bus = process.port;
    context.now_ns = [this, host] { return now_ns_ + host->up_since_ns; };
    context.wall_us = [this, host] { return kWallUs + now_ns_ / 1000 + host->wall_us; };
    context.random_id = static_cast<int64_t>(random_.Next() >> 2) + 1;
    context.name = process.role + " on host " + std::to_string(process.host) + " (life " +
                   std::to_string(process.lives) + ")";
    context.pid = ++pids_;
    const bool is_first = process.lives == 1 && !process.takes_over;
    context.resumed = resume_.has_value() && is_first;
    context.fresh_system = (schedule_.fresh_system && is_first) || context.resumed;
    return context;
  }

  NodeOptions OptionsFor(const Process& process) const {
    NodeOptions options;
    options.take_over = process.takes_over;
    options.session = session_;
    options.peers = {"frontend", "mapper", "loopcloser", "collector"};
    options.link = schedule_.link;
    options.settings = settings_;
    return options;
  }

  /// Processes that begin together do so one after the other.
  int64_t LittleLater() {
    return static_cast<int64_t>(random_.Uniform() * static_cast<double>(schedule_.latest_start_ns));
  }

  void Begin(Process* process) {
    process->begins_ns.reset();
    process->port = network_.AddPort(process->host);
    ++process->lives;
    process->node = MakeNode(process);
    process->due_ns = now_ns_;
    process->busy_until_ns = 0;
    begun_ns_ = now_ns_;
    begun_frame_ = frames_played_;
    collector_has_begun_ = collector_has_begun_ || process->role == "collector";
    Tell(process->role, "begins on host " + std::to_string(process->host));
  }

  std::unique_ptr<Node> MakeNode(Process* process) {
    NodeContext context = ContextFor(*process);
    const NodeOptions options = OptionsFor(*process);
    if (process->role == "mapper") return MakeMapper(context, options, {"", "", CheckpointPath(folder_)});
    if (process->role == "loopcloser") return MakeLoopcloser(context, options, workload_.vocabulary);
    if (process->role == "frontend") return MakeFrontend(context, options, {workload_.vocabulary, "", 0, ""});
    if (process->role == "collector") {
      CollectorOptions collector;
      collector.out_dir = folder_;
      collector.ground_truth = {"-"};
      collector.for_people = false;
      return MakeCollector(context, options, collector);
    }
    PlayerOptions player;
    player.sequence = "simulated";
    player.camera = workload_.camera;
    player.session = session_;
    player.take_over = options.take_over;
    if (resume_) player.behind = resume_->play_behind;
    if (resume_ && process->lives == 1) player.lead_s = resume_->lead_s;
    player.mode = schedule_.realtime ? PlaybackMode::kRealtime : PlaybackMode::kLockstep;
    auto node =
        std::make_unique<PlayerNode>(context, player, std::make_unique<StoredFrames>(&workload_.frames));
    process->player = node.get();
    return node;
  }

  /// What was on its way from it still arrives.
  void Remove(Process* process) {
    process->node.reset();
    process->player = nullptr;
    network_.Close(process->port);
    process->port = nullptr;
    process->paused_until_ns.reset();
  }

  void OnEnd(Process* process, int code, const std::string& problem) {
    Tell(process->role, "ends with " + std::to_string(code) + (problem.empty() ? "" : ": " + problem));
    Remove(process);
    const bool yields = code == kExitPresent && process->last_code == kExitSuperseded;
    process->last_code = code;
    if (process->role == "collector" && code == kExitDone && !moving_) farewell_ns_ = now_ns_ + kFarewellNs;
    if (WorthRestarting(code)) {
      ++outcome_.restarts;
      process->begins_ns = now_ns_ + kSecond / 2;
    } else {
      process->done = true;
      if (code != kExitDone && !yields)
        Fail(process->role + " has ended with " + std::to_string(code) + ": " + problem);
    }
  }

  // ---- Faults

  int64_t FaultNs() const {
    return std::max(frame_ns_.value_or(now_ns_), kBeginNs) + schedule_.faults[next_fault_].after_ns;
  }

  /// Who dies next does so when the one before is there again: where several holders of something die at
  /// once, it is lost.
  bool MayHappen(const Fault& fault) const {
    if (schedule_.at_once) return true;
    if (fault.kind != Fault::Kind::kKill && fault.kind != Fault::Kind::kMove) return true;
    const auto is_away = [](const Process& process) { return process.begins_ns || process.paused_until_ns; };
    if (std::ranges::any_of(processes_, is_away) || now_ns_ < caught_up_ns_) return false;
    return now_ns_ >= begun_ns_ + kBackNs || frames_played_ >= begun_frame_ + 3;
  }

  void CauseFaults() {
    while (next_fault_ < schedule_.faults.size() &&
           frames_played_ >= schedule_.faults[next_fault_].at_frame) {
      if (!frame_ns_) frame_ns_ = now_ns_;
      if (FaultNs() > now_ns_ || !MayHappen(schedule_.faults[next_fault_])) return;
      Cause(schedule_.faults[next_fault_++]);
      frame_ns_.reset();
    }
  }

  void Cause(const Fault& fault) {
    ++outcome_.faults;
    switch (fault.kind) {
      case Fault::Kind::kPartition:
        network_.Cut({fault.host});
        cut_until_ns_ = now_ns_ + fault.lasts_ns;
        return Tell("the network", ToText(fault));
      case Fault::Kind::kClockStep:
        hosts_[fault.host].wall_us += fault.step_us;
        return Tell("somebody", ToText(fault));
      case Fault::Kind::kForgery:
        network_.Forge();
        return Tell("somebody", ToText(fault));
      case Fault::Kind::kKillAll:
      case Fault::Kind::kPowerCut:
        if (!farewell_ns_) KillAll(fault);
        return;
      case Fault::Kind::kContent:
        if (!network_.Forge(fault.content)) return;
        outcome_.forged.push_back({fault.content, frames_played_});
        return Tell("somebody", ToText(fault));
      case Fault::Kind::kEcho:
        network_.Echo();
        return Tell("somebody", ToText(fault));
      case Fault::Kind::kFullDisk:
        disk_full_until_ns_ = now_ns_ + fault.lasts_ns;
        return Tell("the disk", ToText(fault));
      case Fault::Kind::kPause:
      case Fault::Kind::kKill:
      case Fault::Kind::kMove:
        if (Process* process = Find(fault.process)) Meet(fault, process);
    }
  }

  void Meet(const Fault& fault, Process* process) {
    Tell(process->role, ToText(fault));
    if (fault.kind == Fault::Kind::kPause) {
      network_.Pause(process->port);
      process->paused_until_ns = now_ns_ + fault.lasts_ns;
    } else if (fault.kind == Fault::Kind::kKill) {
      process->dies = fault;
      if (fault.records == 0) return Die(process);
      process->port->DieAfter(fault.records);
    } else {
      Process successor;
      successor.role = process->role;
      successor.host = fault.host;
      successor.begins_ns = now_ns_;
      successor.takes_over = true;
      if (process->role == "collector") {  // it writes no stream: it is ended, and begins elsewhere
        moving_ = true;
        process->node->Stop();
        OnEnd(process, process->node->exit_code().value_or(kExitInternal), "");
        moving_ = false;
      }
      processes_.push_back(std::move(successor));
    }
  }

  void Die(Process* process) {
    const Fault fault = *std::exchange(process->dies, std::nullopt);
    if (fault.records > 0) Tell(process->role, "is dead");
    Remove(process);
    process->host = fault.host;
    process->begins_ns = now_ns_ + fault.lasts_ns;
  }

  /// Whoever resumes it finds what is on the disk then, or begins the run anew.
  void KillAll(const Fault& fault) {
    Tell("everybody", ToText(fault));
    for (Process& process : processes_) {
      if (process.node) Remove(&process);
    }
    processes_.clear();
    if (fault.kind == Fault::Kind::kPowerCut) {
      LoseUnsynced(JournalPath(), &random_);
      for (Host& host : hosts_) host.up_since_ns = kBootNs - now_ns_ - fault.lasts_ns;
    }
    Outcome::Resumed& found = NoteDeathOfAll();
    try {
      resume_ = FindResumePoint(folder_, {session_, "", {}, 0, 0});
      found.last_frame = resume_->last_frame;
      found.newest_keyframe = resume_->newest_keyframe;
      found.complete = FindCheckpoint(CheckpointPath(folder_), session_).map->map.progress().ended;
      Tell("somebody", "resumes the run behind frame " + std::to_string(resume_->play_behind.value_or(0)));
    } catch (const InputError& error) {
      found.anew = true;
      Tell("somebody", std::string("begins anew: ") + error.what());
      BeginAnew();
    }
    for (const std::string& role : Roles()) {
      Process process;
      process.role = role;
      process.host = schedule_.host_of.at(role);
      process.begins_ns = now_ns_ + fault.lasts_ns + LittleLater();
      processes_.push_back(std::move(process));
    }
  }

  /// Where none had come back that counts, it is the same death: nobody can tell them apart, and what was
  /// written before stays so.
  Outcome::Resumed& NoteDeathOfAll() {
    Outcome::Resumed found = LookAtDisk();
    const bool is_same = !collector_has_begun_ && !outcome_.resumed.empty() && !outcome_.resumed.back().anew;
    if (is_same) {
      found.written.merge(outcome_.resumed.back().written);
      found.proposed.merge(outcome_.resumed.back().proposed);
      outcome_.resumed.pop_back();
    }
    collector_has_begun_ = false;
    outcome_.resumed.push_back(std::move(found));
    return outcome_.resumed.back();
  }

  /// Another run, in an empty folder.
  void BeginAnew() {
    ++session_;
    resume_.reset();
    frames_played_ = 0;
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }

  std::string JournalPath() const { return folder_ + "/collector.journal"; }

  Outcome::Resumed LookAtDisk() const {
    Outcome::Resumed found;
    found.at_frame = frames_played_;
    const auto take = [&](std::span<const uint8_t> record) {
      const auto pose = wire::Decode<FramePose>(record);
      if (pose && pose->HasPose()) found.written.insert(pose->stamp_ns);
    };
    const auto read = [&](const std::string& text) {
      std::istringstream note(text);
      std::string kind;
      uint64_t keyframe = 0;
      if (note >> kind >> keyframe && kind == "keyframe")
        found.proposed.insert(KeyframeId{keyframe}.frame_index());
    };
    Journal::Read(JournalPath(), session_, take, read);
    return found;
  }

  /// The newest of its role that is there.
  Process* Find(const std::string& role) {
    const auto found = std::ranges::find_if(
        processes_.rbegin(), processes_.rend(),
        [&](const Process& process) { return process.role == role && process.node != nullptr; });
    return found == processes_.rend() ? nullptr : &*found;
  }

  void GoOn() {
    if (cut_until_ns_ && *cut_until_ns_ <= now_ns_) {
      network_.Cut({});
      cut_until_ns_.reset();
      Tell("the network", "is whole again");
    }
    for (Process& process : processes_) {
      if (!process.paused_until_ns || *process.paused_until_ns > now_ns_) continue;
      process.paused_until_ns.reset();
      network_.Resume(process.port);
      process.due_ns = now_ns_;
      caught_up_ns_ = now_ns_ + kSecond;
      Tell(process.role, "goes on");
    }
  }

  const Workload& workload_;
  const Schedule& schedule_;
  const std::string folder_;
  Settings settings_;
  Random random_;
  SimulatedNetwork network_;
  std::vector<Host> hosts_;
  std::deque<Process> processes_;
  uint32_t session_ = kFirstSession;
  std::optional<ResumePoint> resume_;  ///< from where the run went on when all had died
  int64_t now_ns_ = kBeginNs;
  size_t next_fault_ = 0;
  std::optional<int64_t> frame_ns_;  ///< when the next fault's frame was played
  uint32_t frames_played_ = 0;
  int64_t begun_ns_ = kBeginNs;       ///< when the newest process began ...
  int64_t caught_up_ns_ = 0;          ///< who stood still has heard by then what it missed
  uint32_t begun_frame_ = 0;          ///< ... and how far it was then
  bool collector_has_begun_ = false;  ///< since all died
  std::optional<int64_t> cut_until_ns_;
  int64_t disk_full_until_ns_ = 0;
  std::optional<int64_t> farewell_ns_;  ///< who is there then is told to end
  int32_t pids_ = 0;                    ///< given so far
  bool moving_ = false;                 ///< who ends now begins elsewhere
  Outcome outcome_;
};

std::string ReadText(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace

void ReadResults(const std::string& folder, Outcome* outcome) {
  outcome->trajectory = ReadText(fs::path(folder) / "trajectory.txt");
  outcome->online = ReadText(fs::path(folder) / "trajectory_online.txt");
  outcome->keyframes = ReadText(fs::path(folder) / "keyframes.txt");
  outcome->map = ReadText(fs::path(folder) / "map.ply");
  outcome->summary = ReadText(fs::path(folder) / "summary.json");
}

Outcome RunSchedule(const Workload& workload, const Schedule& schedule, const std::string& folder) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  return SimulatedSystem(workload, schedule, folder).Run();
}

}  // namespace dmslam::simulation
