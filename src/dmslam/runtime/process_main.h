#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/console/command_line.h"
#include "dmslam/messaging/keyed_bus.h"
#include "dmslam/runtime/node.h"
#include "dmslam/runtime/node_options.h"

namespace dmslam {

/// What the mains of all processes share: options, the bus, the loop, and one clear line where something is
/// wrong.
class ProcessMain {
 public:
  using Factory = std::function<std::unique_ptr<Node>(NodeContext, NodeOptions)>;

  ProcessMain(const std::string& role, const std::string& description);

  /// For the process's own options.
  CommandLine& app() { return app_; }
  /// What the options put before every channel; known once they are parsed.
  const std::string& prefix() const { return prefix_; }
  /// Work that needs no bus, if the options ask for it: done after parsing, instead of running a node, where
  /// it returns an exit code.
  void SetOffline(std::function<std::optional<int>(const NodeOptions&)> offline) {
    offline_ = std::move(offline);
  }
  /// Parses, makes the node, and runs it until it is done. Returns the exit code.
  int Run(int argc, char** argv, const Factory& factory);

 private:
  int RunNode(const Factory& factory);
  void AddCameras();
  std::unique_ptr<KeyedBus> MakeKeyedBus(Bus* bus) const;
  /// At the end: what tags took of the process' time.
  void LogCostOfKey(const KeyedBus::Statistics& statistics) const;

  CommandLine app_;
  std::string role_;
  std::string lcm_url_ = "udpm://239.255.76.67:7670?ttl=0&recv_buf_size=4194304";
  std::string prefix_;
  std::string key_;
  std::string link_ = "host";
  CameraId cameras_ = 1;
  std::string config_;
  std::vector<std::string> overrides_;
  NodeOptions options_;
  bool fresh_system_ = false;
  bool resumed_ = false;
  bool quiet_ = false;
  std::function<std::optional<int>(const NodeOptions&)> offline_;
};

/// A folder of the project or of its installation, found from the program's place: "config", "data".
std::string FindDataFolder(const std::string& name);

}  // namespace dmslam
