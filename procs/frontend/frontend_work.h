#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "dmslam/runtime/core_thread.h"
#include "dmslam/slam/frontend_core.h"
#include "dmslam/wire/status.h"

namespace dmslam {

/// A frontend's core and where its jobs run, one at a time. What touches the core is done in a job, or while
/// there is none.
class FrontendWork {
 public:
  using Job = std::function<void()>;
  FrontendWork(const FrontendCore::Setup& setup, std::unique_ptr<CoreThread> thread)
      : core_(setup), thread_(std::move(thread)) {}

  /// Within a job, or while it is idle.
  FrontendCore& core() { return core_; }
  const FrontendCore& core() const { return core_; }

  bool Idle() const { return thread_->Idle(); }
  void Post(Job job) { thread_->Post(std::move(job)); }
  /// The same with what the core has to say of itself afterwards. Returns whether it is idle again.
  bool Run(Job job);
  void Finish() { thread_->Finish(); }
  /// What the core has to say of itself, as of the newest job that is done.
  const FrontendStatus& Status();

  /// Within a job: to be called on the thread that posts; and that the job goes on.
  void Report(Job report) { thread_->Report(std::move(report)); }
  void Beat() { thread_->Beat(); }

 private:
  FrontendCore core_;
  FrontendStatus status_;               ///< as it was said last
  std::unique_ptr<CoreThread> thread_;  ///< ends before what jobs touch
};

}  // namespace dmslam
