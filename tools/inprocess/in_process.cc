#include "in_process.h"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <vector>

#include "dmslam/messaging/bus.h"
#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/event_log.h"
#include "dmslam/messaging/roles.h"
#include "frontend/make_frontend.h"
#include "loopcloser/make_loopcloser.h"
#include "player/records_node.h"

namespace dmslam {
namespace {

constexpr int64_t kClockStartNs = 1'000'000'000;

/// Keeps all that is said in a log, as lcm-logger does beside processes: with the beacons of the streams,
/// without which no reader follows them.
class Recorder {
 public:
  Recorder(MemoryBus::Port* bus, const std::string& path, const std::function<int64_t()>& now_us)
      : log_(path) {
    bus->SubscribeToAll();
    bus->SetHandler([this, now_us](const std::string& channel, std::span<const uint8_t> bytes) {
      log_.Write(now_us(), channel, bytes);
    });
  }
  void Close() { log_.Close(); }

 private:
  EventLogWriter log_;
};

/// The nodes, their ports, and the time they share.
class System {
 public:
  NodeContext ContextFor(const std::string& name) {
    NodeContext context;
    context.bus = &bus_.AddPort();
    context.now_ns = [this] { return now_ns_; };
    context.wall_us = [this] { return now_ns_ / 1000; };
    context.random_id = static_cast<int64_t>(nodes_.size()) + 1;
    context.name = name;
    context.fresh_system = true;
    return context;
  }
  void Add(std::unique_ptr<Node> node) { nodes_.push_back(std::move(node)); }
  void Record(const std::string& path) {
    recorder_ = std::make_unique<Recorder>(&bus_.AddPort(), path, [this] { return now_ns_ / 1000; });
  }

  /// Runs until all are done, one fails, or `stop` says so: then everyone writes what it has. Returns the
  /// first exit code that is not zero.
  int Run(const std::function<bool()>& stop, std::string* problem) {
    const int code = RunNodes(stop, problem);
    if (recorder_) recorder_->Close();
    return code;
  }

 private:
  int RunNodes(const std::function<bool()>& stop, std::string* problem) {
    while (true) {
      if (stop && stop()) return StopNodes(problem);
      bool all_done = true;
      for (const auto& node : nodes_) {
        if (!node->exit_code()) node->Advance();
        if (!node->exit_code()) all_done = false;
        if (node->exit_code().value_or(0) != 0) {
          *problem = node->problem();
          return *node->exit_code();
        }
      }
      if (all_done) return 0;
      bool delivered = false;
      while (bus_.DeliverOne()) delivered = true;
      if (!delivered) AdvanceClock();
    }
  }

  /// The collector, which was added first, last: by then the others have said what they had to say.
  int StopNodes(std::string* problem) {
    for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
      if ((*node)->exit_code()) continue;
      (*node)->Stop();
      if ((*node)->exit_code().value_or(0) == 0) continue;
      *problem = (*node)->problem();
      return *(*node)->exit_code();
    }
    return 0;
  }

  void AdvanceClock() {
    int64_t next = INT64_MAX;
    for (const auto& node : nodes_) {
      if (!node->exit_code()) next = std::min(next, node->deadline_ns());
    }
    now_ns_ = std::max(now_ns_ + 1000, next == INT64_MAX ? now_ns_ + 1'000'000 : next);
  }

  MemoryBus bus_;
  int64_t now_ns_ = kClockStartNs;
  std::vector<std::unique_ptr<Node>> nodes_;
  std::unique_ptr<Recorder> recorder_;
};

/// The processes that need no images: collector, loop closer and mapper.
void AddMapSide(InProcessOptions* options, System* system) {
  NodeOptions& node = options->node;
  node.session = options->player.session;
  node.peers.insert(node.peers.end(),
                    {roles::kFrontend, roles::kMapper, roles::kLoopCloser, roles::kCollector});
  if (!options->record.empty()) system->Record(options->record);
  options->collector.checkpoints = false;  // nobody resumes it
  system->Add(MakeCollector(system->ContextFor(roles::kCollector), node, options->collector));
  system->Add(MakeLoopcloser(system->ContextFor(roles::kLoopCloser), node, options->vocabulary));
  system->Add(MakeMapper(system->ContextFor(roles::kMapper), node, options->map_files));
}

}  // namespace

int RunRecordsInProcess(InProcessOptions options, std::shared_ptr<const LogIndex> log, uint32_t log_session,
                        std::string* problem) {
  System system;
  AddMapSide(&options, &system);
  system.Add(std::make_unique<RecordsNode>(system.ContextFor(roles::kPlayer), options.node, std::move(log),
                                           log_session));
  return system.Run(options.stop, problem);
}

int RunInProcess(InProcessOptions options, std::unique_ptr<FrameSource> source, std::string* problem,
                 std::vector<AnotherCamera> others) {
  options.player.mode = PlaybackMode::kLockstep;
  for (size_t i = 0; i < others.size(); ++i)
    options.node.peers.push_back(OfCamera(roles::kFrontend, static_cast<CameraId>(i + 1)));
  System system;
  AddMapSide(&options, &system);
  system.Add(MakeFrontend(system.ContextFor(roles::kFrontend), options.node,
                          {options.vocabulary, options.picture_dir, options.picture_every, ""}));
  system.Add(
      std::make_unique<PlayerNode>(system.ContextFor(roles::kPlayer), options.player, std::move(source)));
  for (AnotherCamera& other : others) {
    NodeOptions node = options.node;
    node.camera_id = other.player.camera_id = ++options.node.camera_id;
    other.player.mode = PlaybackMode::kLockstep;
    other.player.session = options.player.session;
    system.Add(MakeFrontend(system.ContextFor(OfCamera(roles::kFrontend, node.camera_id)), node,
                            {options.vocabulary, "", 0, ""}));
    system.Add(std::make_unique<PlayerNode>(system.ContextFor(OfCamera(roles::kPlayer, node.camera_id)),
                                            other.player, std::move(other.source)));
  }
  return system.Run(options.stop, problem);
}

}  // namespace dmslam
