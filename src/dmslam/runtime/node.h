#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "dmslam/messaging/bus.h"

namespace dmslam {

/// So often every process says how it fares.
inline constexpr int64_t kStatusEveryNs = 1'000'000'000;

/// What a node knows of the world around it.
struct NodeContext {
  Bus* bus = nullptr;
  std::function<int64_t()> now_ns;   ///< monotonic; virtual in one process
  std::function<int64_t()> wall_us;  ///< for utime and terms of office; reaches no result
  std::function<void()> pump;        ///< delivers what has arrived, between steps of work; may do nothing
  std::function<void(int fd, std::function<void()> on_readable)>
      watch;                   ///< of descriptors of its own; may be none
  int64_t random_id = 1;       ///< of this process: reader and writer id
  std::string name;            ///< "mapper on host (pid 17)"
  std::optional<int32_t> pid;  ///< as it is told in statuses; none: that of the system's process
  /// Messages that the bus kept from the node, since it has a key and they had no tag that fits.
  std::function<int64_t()> refused = [] { return int64_t{0}; };
  bool fresh_system = false;  ///< nobody else can be writing: no listening before a stream begins
  bool resumed = false;  ///< ... and what a run whose processes all died has left on disk is gone on with
};

/// The wall clock minus the monotonic one, as they are now [us].
inline int64_t ClockOffsetUs(const NodeContext& context) {
  return context.wall_us() - context.now_ns() / 1000;
}

/// A process without its main: connects a core to the bus. Message handlers only store what comes; all work
/// is done in Advance, one thread.
class Node {
 public:
  virtual ~Node() = default;
  /// Does what there is to do now.
  virtual void Advance() = 0;
  /// When Advance wants to be called next, whatever comes.
  virtual int64_t deadline_ns() const = 0;
  /// Asked to stop (SIGTERM): finishes cleanly within a moment.
  virtual void Stop() = 0;
  /// Set when the node is done: the process's exit code.
  virtual std::optional<int> exit_code() const = 0;
  /// Why it ended, when not well; one line with the cure.
  virtual std::string problem() const { return {}; }
  /// Whether a thread of it has given no sign of its work for longer than this: then the process is as good
  /// as dead, though its loop turns.
  virtual bool Hangs(int64_t /*now_ns*/, int64_t /*longest_ns*/) const { return false; }
  /// What whoever started the process (dmslam-run, systemd) is told once it is ready; one line.
  virtual std::string ready_text() const { return {}; }
};

/// Hands everything on to another node: what a node of one's own that adds to one begins with.
class NodeDecorator : public Node {
 public:
  explicit NodeDecorator(std::unique_ptr<Node> node) : node_(std::move(node)) {}
  void Advance() override { node_->Advance(); }
  int64_t deadline_ns() const override { return node_->deadline_ns(); }
  void Stop() override { node_->Stop(); }
  std::optional<int> exit_code() const override { return node_->exit_code(); }
  std::string problem() const override { return node_->problem(); }
  bool Hangs(int64_t now_ns, int64_t longest_ns) const override { return node_->Hangs(now_ns, longest_ns); }
  std::string ready_text() const override { return node_->ready_text(); }

 private:
  std::unique_ptr<Node> node_;
};

}  // namespace dmslam
