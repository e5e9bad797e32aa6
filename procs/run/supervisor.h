#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace dmslam {

/// A process to be started, and started again.
struct ChildSpec {
  std::string name;                                ///< "mapper"
  std::vector<std::string> arguments;              ///< the program's path first
  std::vector<std::string> first;                  ///< only at its first start, behind the others
  std::map<std::string, std::string> environment;  ///< beside our own
  std::vector<std::string> after;                  ///< first started when these have said that they are ready
  std::string output, errors;   ///< files that standard output and standard error are appended to
  bool errors_to_ours = false;  ///< standard error is the supervisor's own
  std::string pid_file;         ///< holds its process id; empty: none
  bool restart = true;          ///< where that is worth it
  int stop_signal = SIGTERM;
  bool speaks = false;  ///< says that it is ready and then, again and again, that it is alive
};

/// What became of a child, or who spoke to the supervisor.
struct ChildEvent {
  enum class Kind : uint8_t {
    kReady,      ///< said so (sd_notify); `text` is the status it gave with it
    kEnded,      ///< and stays so
    kRestarted,  ///< died, and is started again after `delay_ns`
    kSignal,     ///< the supervisor itself was asked to stop; `code` is the signal
    kTime,       ///< nothing happened until the deadline
  };
  Kind kind = Kind::kTime;
  std::string name;
  std::string text;
  int code = 0;         ///< exit code, or 128 + signal
  int restarts = 0;     ///< of this child so far
  bool hung = false;    ///< it said nothing for too long, and was killed
  bool yields = false;  ///< another process has taken its place: no failure
  int64_t delay_ns = 0;
};

/// Starts processes and starts again those that die or hang. It cannot miss a death: whoever has ended is
/// asked for until nobody is left, however many die at once. Its children end with it, whatever ends it.
///
/// One for a program, made before any thread: it takes SIGCHLD, SIGINT, SIGTERM and SIGHUP for itself.
class Supervisor {
 public:
  struct Options {
    int64_t short_life_ns = 3'000'000'000;  ///< who lives for less has made no progress
    /// Nor has who is superseded within this time: it listens for others first, and waits for who asks for
    /// its place.
    int64_t short_office_ns = 60'000'000'000;
    int most_short_lives = 8;              ///< in a row; then it is past help
    int64_t first_delay_ns = 200'000'000;  ///< before the second start in a row; doubles with each
    int64_t longest_delay_ns = 5'000'000'000;
    int64_t patience_ns =
        60'000'000'000;                   ///< bus or camera may be gone for so long; never at the first start
    bool wait_for_what_may_come = false;  ///< ... for ever, and at the first start too
    int64_t watchdog_ns = 0;              ///< who says nothing for so long hangs; 0: nobody is asked
    /// ... as does who is known to speak, and has said no word since its start: what it begins with, as a
    /// large map, may take long to load.
    int64_t first_word_ns = 300'000'000'000;
    int64_t stop_ns = 10'000'000'000;        ///< who does not end when asked to is killed after so long...
    int64_t last_work_ns = 600'000'000'000;  ///< ... or, where it has said that it is at its last work
    pid_t (*fork)() = ::fork;                ///< a test lets it fail
  };

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
