#include "dmslam/runtime/core_thread.h"

#include <pthread.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>
#include <utility>

#include "dmslam/util/check.h"
#include "dmslam/util/thread_priority.h"

namespace dmslam {

CoreThread::CoreThread(Mode mode, Options options) : options_(options) {
  if (mode == Mode::kAtOnce) return;
  event_fd_ = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  DMSLAM_CHECK(event_fd_ >= 0, "no descriptor is left for an event");
  thread_ = std::thread([this] {
    if (options_.lets_others_go_first) LetOthersGoFirst();
    Work();
  });
  pthread_setname_np(thread_.native_handle(), "core");  // as debuggers and top show it
}

CoreThread::~CoreThread() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
  close(event_fd_);
}

bool CoreThread::HasRoom() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return jobs_.size() < options_.max_jobs;
}

bool CoreThread::Idle() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return jobs_.empty() && reports_.empty() && !failure_ && delivering_ == 0;
}

void CoreThread::Post(Job job) {
  if (!thread_.joinable()) return job();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    DMSLAM_CHECK(jobs_.size() < options_.max_jobs, "a job was posted without room for it");
    if (jobs_.empty()) sign_.Begin();  // else it is that of the one before
    jobs_.push_back(std::move(job));
  }
  changed_.notify_all();
}

void CoreThread::Report(Job report) {
  if (!thread_.joinable()) return report();
  {
    std::unique_lock<std::mutex> lock(mutex_);
    sign_.Rest();  // it waits for who delivers
    changed_.wait(lock, [this] { return stopping_ || reports_.size() < options_.max_reports; });
    sign_.Begin();
    if (stopping_) return;
    reports_.push_back(std::move(report));
  }
  changed_.notify_all();
  Wake();
}

void CoreThread::Deliver() {
  if (!thread_.joinable()) return;
  uint64_t woken = 0;
  const ssize_t cleared = read(event_fd_, &woken, sizeof(woken));
  static_cast<void>(cleared);  // nothing to clear: it was not woken
  std::deque<Job> reports;
  std::exception_ptr failure;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    reports.swap(reports_);
    failure = std::exchange(failure_, nullptr);
  }
  changed_.notify_all();
  delivering_ += reports.size();
  for (const Job& report : reports) {
    report();
    --delivering_;
  }
  if (failure) std::rethrow_exception(failure);
}

void CoreThread::Finish() {
  while (!Idle()) {
    {
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait(lock, [this] { return jobs_.empty() || !reports_.empty() || failure_; });
    }
    Deliver();
  }
}

void CoreThread::Work() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stopping_ || !jobs_.empty(); });
    if (stopping_) return;
    RunNext(lock);
  }
}

/// The job stays in the queue while it is in work: it takes its room until it is done.
void CoreThread::RunNext(std::unique_lock<std::mutex>& lock) {
  const Job job = std::move(jobs_.front());
  lock.unlock();
  std::exception_ptr failure;
  sign_.Begin();
  try {
    job();
  } catch (...) {
    failure = std::current_exception();
  }
  sign_.Rest();
  lock.lock();
  jobs_.pop_front();
  if (failure) failure_ = failure;
  changed_.notify_all();
  Wake();
}

void CoreThread::Wake() const {
  const uint64_t one = 1;
  const ssize_t written = write(event_fd_, &one, sizeof(one));
  static_cast<void>(written);  // full: it is readable already
}

}  // namespace dmslam
