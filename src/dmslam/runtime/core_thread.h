#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

#include "dmslam/runtime/work_sign.h"

namespace dmslam {

/// Runs the jobs of a core one after another, in the order in which they are posted, and hands back what they
/// report. In real time on a thread of its own: the thread that posts them keeps the bus alive meanwhile. In
/// lock-step, and in one process, at once on the caller's thread. Jobs and reports are the same in both cases
/// and come in the same order, so that a core cannot tell the difference.
///
/// Everything a job touches belongs to it until its last report was delivered: between jobs (`Idle`) it is
/// the poster's.
class CoreThread {
 public:
  using Job = std::function<void()>;
  enum class Mode { kAtOnce, kOwnThread };
  struct Options {
    size_t max_jobs = 1;      ///< posted, and not done
    size_t max_reports = 64;  ///< made, and not delivered: beyond them a job waits
    bool lets_others_go_first =
        false;  ///< where cores are short (LetOthersGoFirst); a thread of its own only
  };

  explicit CoreThread(Mode mode) : CoreThread(mode, Options()) {}
  CoreThread(Mode mode, Options options);
  /// Drops what has not begun and what was not delivered, and waits for the job in work.
  ~CoreThread();
  CoreThread(const CoreThread&) = delete;
  CoreThread& operator=(const CoreThread&) = delete;

  // ---- The thread that posts

  bool HasRoom() const;
  /// Needs room.
  void Post(Job job);
  /// Calls what was reported, in order. An exception that a job has left with is thrown here.
  void Deliver();
  /// Whether all jobs are done, and all their reports delivered.
  bool Idle() const;
  /// Delivers until it is idle.
  void Finish();
  /// Readable when there is something to deliver; -1 where jobs run at once.
  int fd() const { return event_fd_; }
  /// Whether a job is in work that has given no sign for longer than this. Of jobs that run at once: never.
  bool Hangs(int64_t now_ns, int64_t longest_ns) const { return sign_.Hangs(now_ns, longest_ns); }

  // ---- From within a job

  /// To be called on the thread that posts.
  void Report(Job report);
  /// The job goes on: to be said now and then by one that takes long. A report says so too.
  void Beat() { sign_.Beat(); }

 private:
  void Work();
  void RunNext(std::unique_lock<std::mutex>& lock);
  void Wake() const;

  const Options options_;
  int event_fd_ = -1;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;  ///< the first one may be in work
  std::deque<Job> reports_;
  std::exception_ptr failure_;
  size_t delivering_ = 0;  ///< reports that the poster calls just now, or next
  bool stopping_ = false;
  WorkSign sign_;       ///< of the job in work; at rest where jobs run at once
  std::thread thread_;  ///< not joinable: jobs run at once
};

}  // namespace dmslam
