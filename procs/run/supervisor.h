#pragma once

#include <sys/types.h>

#include <csignal>
#include <cstdint>
#include <deque>
#include <list>
#include <optional>
#include <string>

#include "run/child.h"
#include "run/supervisor_options.h"

namespace dmslam {

/// Starts processes and starts again those that die or hang. It cannot miss a death: whoever has ended is
/// asked for until nobody is left, however many die at once. Its children end with it, whatever ends it.
///
/// One for a program, made before any thread: it takes SIGCHLD, SIGINT, SIGTERM and SIGHUP for itself.
class Supervisor {
 public:
  using Options = SupervisorOptions;

  explicit Supervisor(Options options);
  /// Kills whom it has.
  ~Supervisor();
  Supervisor(const Supervisor&) = delete;
  Supervisor& operator=(const Supervisor&) = delete;

  /// Starts it, once those it is to come after are ready; an ended child of the same name is forgotten.
  /// Throws InputError where no process can be made.
  void Start(ChildSpec spec);
  /// The next event; kTime when `deadline_ns` (of the monotonic clock) comes before.
  ChildEvent Wait(int64_t deadline_ns = INT64_MAX);
  /// From now on nobody is started again.
  void StopRestarting();
  /// Asks all to end, kills those that do not, and returns when nobody is left. A signal kills at once.
  /// Who says that it is at its last work (STOPPING=1) gets more time for it.
  void StopAll();

  bool Alive(const std::string& name) const;
  /// Of those alive or about to be started.
  size_t size() const;
  /// 0 where it is not alive.
  pid_t PidOf(const std::string& name) const;
  static int64_t now_ns();

 private:
  struct Child {
    ChildSpec spec;
    pid_t pid = 0;                            // 0: not alive
    int64_t began_ns = 0;                     // its newest life
    int64_t due_ns = INT64_MAX;               // when it is started again
    std::optional<int64_t> heard_ns;          // when it last said that it is alive
    std::optional<int64_t> missing_since_ns;  // since when bus or camera cannot be had
    int restarts = 0, short_lives = 0, last_code = 0;
    bool waits = true;   // has never been started
    bool ready = false;  // its newest life has said so
    bool lived = false;  // long enough to be worth patience
    bool hung = false;
    bool at_last_work = false;  // its newest life has said so: it writes results, and may be silent meanwhile
  };
  bool MayBegin(const Child& child) const;
  void Launch(Child* child);
  void OnNotStarted(Child* child, const std::string& reason);
  [[noreturn]] void BecomeChild(const Child& child, int output, int errors);
  void Reap();
  void OnDeath(Child* child, int code);
  std::optional<int64_t> DelayBeforeRestart(Child* child, int code);
  void StartDue();
  void HearNotices();
  void OnNotice(pid_t sender, const std::string& text);
  void KillHung();
  int64_t SilentUntil(const Child& child) const;
  void TakeSignals();
  void Poll(int64_t deadline_ns);
  int64_t NextDeadline() const;

  Options options_;
  std::list<Child> children_;
  std::deque<ChildEvent> events_;
  bool restarting_ = true;
  int signal_fd_ = -1, notice_fd_ = -1;
  std::string notice_address_;
  sigset_t former_mask_{};
  void (*former_pipe_)(int) = SIG_DFL;  ///< what a broken pipe did before
};

}  // namespace dmslam
