#include "dmslam/runtime/process_main.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <string>
#include <system_error>
#include <vector>

#include "dmslam/messaging/event_loop.h"
#include "dmslam/messaging/lcm_bus.h"
#include "dmslam/runtime/process_info.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

int64_t RandomId() {
  std::random_device device;
  const uint64_t bits = (static_cast<uint64_t>(device()) << 32) | device();
  return static_cast<int64_t>((bits >> 1) | 1);
}

void SetUpLogging(const std::string& role, bool quiet) {
  spdlog::set_default_logger(spdlog::stderr_color_mt(role));
  spdlog::set_pattern("%H:%M:%S.%e %n %l: %^%v%$");
  spdlog::set_level(quiet ? spdlog::level::warn : spdlog::level::info);
}

}  // namespace

ProcessMain::ProcessMain(const std::string& role, const std::string& description)
    : app_(description, "dmslam-" + role), role_(role) {
  app_.set_version_flag("--version", BuildVersion());
  app_.add_option("--lcm-url", lcm_url_, "LCM bus; separate systems by port")->capture_default_str();
  app_.add_option("--prefix", prefix_, "put before every channel: separates systems that share a port");
  app_.add_option("--link", link_, "host: records travel whole; lan: in parts of at most 1380 bytes")
      ->check(CLI::IsMember({"host", "lan"}))
      ->capture_default_str();
  app_.add_option("--session", options_.session, "session id; 0: that of the first camera heard");
  // Those who take part in a run wait for one another; tools and viewers wait for nobody.
  const std::vector<std::string> pipeline = {"frontend", "mapper", "loopcloser", "collector"};
  if (role == "player" || std::ranges::find(pipeline, role) != pipeline.end()) options_.peers = pipeline;
  app_.add_option("--peers", options_.peers, "processes that take part: they are waited for")
      ->delimiter(',')
      ->capture_default_str();
  app_.add_option("--config", config_, "settings (YAML)");
  app_.add_option("--set", overrides_, "one setting: key=value; may be repeated");
  app_.add_flag(
      "--accept-recorded", options_.accept_recorded,
      "take camera and frames of a recorded session, as lcm-logplayer plays them, for this session's");
  app_.add_flag("--take-over", options_.take_over,
                "ask a present writer of the same stream to close, and follow it");
  app_.add_flag("--fresh", options_.fresh, "a mapper begins with an empty map, whatever the others hold");
  app_.add_flag("--fresh-system", fresh_system_, "nobody else can be writing: begin without listening first");
  app_.add_flag("--quiet", quiet_, "log warnings only");
}

int ProcessMain::Run(int argc, char** argv, const Factory& factory) {
  try {
    app_.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app_.exit(error);
  }
  SetUpLogging(role_, quiet_);
  try {
    return RunNode(factory);
  } catch (const InputError& error) {
    spdlog::error("{}", error.what());
    return 1;
  } catch (const std::exception& error) {
    spdlog::critical("stopped by an internal error: {}", error.what());
    return 70;
  }
}

int ProcessMain::RunNode(const Factory& factory) {
  options_.settings = LoadSettings(config_, overrides_);
  options_.link = link_ == "lan" ? Link::kLan : Link::kHost;
  if (offline_) {
    if (const std::optional<int> code = offline_(options_)) return *code;
  }
  EventLoop loop;
  LcmBus bus({lcm_url_, prefix_});
  if (!bus.receive_buffer_note().empty()) spdlog::info("{}", bus.receive_buffer_note());
  NodeContext context;
  context.bus = &bus;
  context.now_ns = &EventLoop::now_ns;
  context.wall_us = &EventLoop::wall_us;
  context.pump = [&loop] { loop.PumpOnce(); };
  context.watch = [&loop](int fd, std::function<void()> on_readable) {
    loop.Watch(fd, std::move(on_readable));
  };
  context.random_id = RandomId();
  context.name = ProcessName(role_);
  context.fresh_system = fresh_system_;
  const std::unique_ptr<Node> node = factory(context, options_);
  loop.Watch(bus.fd(), [&bus] { bus.Deliver(); });
  while (!node->exit_code()) {
    node->Advance();
    if (node->exit_code()) break;
    if (!loop.PumpOnce(node->deadline_ns()) || loop.stop_signal() != 0) node->Stop();
  }
  if (!node->problem().empty()) spdlog::error("{}", node->problem());
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

std::shared_ptr<const Vocabulary> LoadVocabulary(const std::string& path) {
  const std::string file = path.empty() ? FindDataFolder("data") + "/vocabulary.dmv" : path;
  return std::make_shared<const Vocabulary>(LoadOrbVocabulary(file));
}

}  // namespace dmslam
