#include "dmslam/runtime/process_main.h"

#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <random>
#include <string>
#include <system_error>
#include <vector>

#include "dmslam/console/log.h"
#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/event_loop.h"
#include "dmslam/messaging/lcm_bus.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/runtime/process_info.h"
#include "dmslam/runtime/service_notice.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "dmslam/util/not_yet_error.h"

namespace dmslam {
namespace {

int64_t RandomId() {
  std::random_device device;
  const uint64_t bits = (static_cast<uint64_t>(device()) << 32) | device();
  return static_cast<int64_t>((bits >> 1) | 1);
}

/// Whoever watches the process hears nothing then, and ends it.
bool IsSeenToHang(const Node* node, LcmBus* bus, int64_t now_ns, int64_t longest_ns) {
  const bool hangs = node != nullptr && node->Hangs(now_ns, longest_ns);
  const bool deaf = bus->IsDeaf(now_ns, longest_ns);
  if (hangs) LogError("hangs: a job has given no sign for more than {} s", longest_ns / 1'000'000'000);
  if (deaf) LogError("hangs: LCM hears not even this process for more than {} s", longest_ns / 1'000'000'000);
  return hangs || deaf;
}

}  // namespace

ProcessMain::ProcessMain(const std::string& role, const std::string& description)
    : app_(description, "dmslam-" + role), role_(role) {
  app_.SetVersion(BuildVersion());
  app_.AddOption("--lcm-url", lcm_url_, "LCM bus; separate systems by port").ShowDefault();
  app_.AddOption("--prefix", prefix_, "put before every channel: separates systems that share a port");
  app_.AddOption("--key", key_,
                 "file with the key of the bus (mode 0600): only those who have it are heard; default: what "
                 "DMSLAM_KEY_FILE names");
  app_.AddOption("--link", link_, "host: records travel whole; lan: in parts of at most 1380 bytes")
      .OneOf({"host", "lan"})
      .ShowDefault();
  app_.AddOption(
      "--session", options_.session,
      role == roles::kPlayer
          ? "session id; 0: that of the bus, where there is one; else the player of camera 0 draws "
            "one at random"
          : "session id; 0: that of the bus, where there is one");
  // Those who take part in a run wait for one another; tools and viewers wait for nobody.
  const std::vector<std::string> pipeline = {roles::kFrontend, roles::kMapper, roles::kLoopCloser,
                                             roles::kCollector};
  if (role == roles::kPlayer || std::ranges::find(pipeline, role) != pipeline.end())
    options_.peers = pipeline;
  app_.AddOption("--peers", options_.peers, "processes that take part: they are waited for")
      .Delimiter(',')
      .ShowDefault();
  app_.AddOption(
          "--cameras", cameras_,
          "how many cameras take part, each with a player and a frontend of its own: those of camera 1 "
          "are the peers player1 and frontend1")
      .InRange(1, static_cast<int>(kMaxCameras))
      .ShowDefault();
  if (role == roles::kPlayer || role == roles::kFrontend) {
    app_.AddOption("--camera-id", options_.camera_id, "whose it is, from 0, where several cameras take part")
        .InRange(0, static_cast<int>(kMaxCameras) - 1);
  }
  app_.AddOption("--config", config_, "settings (YAML)");
  app_.AddOption("--set", overrides_, "one setting: key=value; may be repeated");
  app_.AddFlag(
      "--accept-recorded", options_.accept_recorded,
      "take camera and frames of a recorded session, as lcm-logplayer plays them, for this session's");
  app_.AddFlag("--take-over", options_.take_over,
               "ask a present writer of the same stream to close, and follow it");
  app_.AddFlag("--fresh", options_.fresh, "a mapper begins with an empty map, whatever the others hold");
  app_.AddFlag("--fresh-system", fresh_system_, "nobody else can be writing: begin without listening first");
  app_.AddFlag("--resumed", resumed_,
               "with --fresh-system: go on with what a run whose processes all died has left on disk");
  app_.AddFlag("--quiet", quiet_, "log warnings only");
}

int ProcessMain::Run(int argc, char** argv, const Factory& factory) {
  if (const std::optional<int> code = app_.Parse(argc, argv)) return *code == 0 ? kExitDone : kExitUsage;
  SetUpLog(role_, quiet_);
  if (options_.camera_id >= cameras_) {
    LogError("--camera-id {}: there are --cameras {}, numbered from 0; give --cameras {}", options_.camera_id,
             cameras_, options_.camera_id + 1);
    return kExitUsage;
  }
  std::signal(SIGPIPE, SIG_IGN);  // a log that nobody reads any more ends no process
  try {
    return RunNode(factory);
  } catch (const NotYetError& error) {
    LogError("{}", error.what());
    return kExitNotYet;
  } catch (const MisfitError& error) {
    LogError("{}", error.what());
    return kExitMisfit;
  } catch (const InputError& error) {
    LogError("{}", error.what());
    return kExitInput;
  } catch (const std::exception& error) {
    LogCritical("stopped by an internal error: {}", error.what());
    return kExitInternal;
  }
}

/// Where the first frontend is waited for, so are the others. A viewer waits for nobody, but hears them all.
void ProcessMain::AddCameras() {
  if (role_ != roles::kViewer && !options_.HasPeer(roles::kFrontend)) return;
  for (CameraId camera = 1; camera < cameras_; ++camera)
    options_.peers.push_back(OfCamera(roles::kFrontend, camera));
}

std::unique_ptr<KeyedBus> ProcessMain::MakeKeyedBus(Bus* bus) const {
  if (!options_.key) return nullptr;
  KeyedBus::Options options;
  options.session = options_.session;
  options.now_ns = &EventLoop::now_ns;
  options.wall_us = &EventLoop::wall_us;
  options.warn = [this](const std::string& text) { LogWarning("{}: {}", role_, text); };
  return std::make_unique<KeyedBus>(bus, *options_.key, options);
}

void ProcessMain::LogCostOfKey(const KeyedBus::Statistics& statistics) const {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto ms = [](const timeval& time) {
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_usec);
  };
  LogInfo("{}: key: {} tags made, {} verified, {} bytes published, {:.2f} ms of {:.0f} ms of CPU time", role_,
          statistics.made, statistics.verified, statistics.bytes,
          1e-6 * static_cast<double>(statistics.tags_ns), ms(used.ru_utime) + ms(used.ru_stime));
}

int ProcessMain::RunNode(const Factory& factory) {
  options_.settings = LoadSettings(config_, overrides_);
  options_.link = link_ == "lan" ? Link::kLan : Link::kHost;
  options_.key = BusKey::LoadIfWanted(key_);
  AddCameras();
  if (offline_) {
    if (const std::optional<int> code = offline_(options_)) return *code;
  }
  EventLoop loop;
  LcmBus bus({lcm_url_, prefix_});
  if (!bus.receive_buffer_note().empty()) LogInfo("{}", bus.receive_buffer_note());
  const std::unique_ptr<KeyedBus> keyed = MakeKeyedBus(&bus);
  NodeContext context;
  context.bus = &bus;
  if (keyed) {
    context.bus = keyed.get();
    context.refused = [&keyed] { return keyed->statistics().refused(); };
  }
  context.now_ns = &EventLoop::now_ns;
  context.wall_us = &EventLoop::wall_us;
  ServiceNotice notice;
  std::unique_ptr<Node> node;
  const auto say_alive = [&notice, &node, &bus] {
    const int64_t now_ns = EventLoop::now_ns();
    notice.Alive(now_ns,
                 [&] { return !IsSeenToHang(node.get(), &bus, now_ns, notice.longest_silence_ns()); });
  };
  context.pump = [&loop, &say_alive] {
    loop.PumpOnce();
    say_alive();
  };
  context.watch = [&loop](int fd, std::function<void()> on_readable) {
    loop.Watch(fd, std::move(on_readable));
  };
  context.random_id = RandomId();
  context.name = ProcessName(OfCamera(role_, options_.camera_id));
  context.fresh_system = fresh_system_;
  context.resumed = resumed_;
  node = factory(context, options_);
  loop.Watch(bus.fd(), [&bus] { bus.Deliver(); });
  notice.Ready(node->ready_text());
  while (!node->exit_code()) {
    say_alive();
    node->Advance();
    if (node->exit_code()) break;
    if (!loop.PumpOnce(std::min(node->deadline_ns(), notice.deadline_ns())) || loop.stop_signal() != 0)
      node->Stop();
  }
  if (keyed) LogCostOfKey(keyed->statistics());
  if (!node->problem().empty()) LogError("{}", node->problem());
  return *node->exit_code();
}

std::string FindDataFolder(const std::string& name) {
  namespace fs = std::filesystem;
  std::error_code unreadable;
  const fs::path program = fs::read_symlink("/proc/self/exe", unreadable);
  if (unreadable) throw InputError("/proc/self/exe: cannot be read; is /proc mounted?");
  for (fs::path at = program.parent_path(); !at.empty() && at != at.root_path(); at = at.parent_path()) {
    for (const fs::path& candidate : {at / "share" / "dmslam" / name, at / name}) {
      if (fs::is_directory(candidate) && !fs::is_empty(candidate)) return candidate.string();
    }
  }
  throw InputError("the folder '" + name + "' that ships with the programs was not found near " +
                   program.string() + "; install the project again");
}

}  // namespace dmslam
