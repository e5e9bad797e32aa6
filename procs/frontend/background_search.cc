#include "frontend/background_search.h"

#include <memory>
#include <utility>

#include "dmslam/util/thread_priority.h"

namespace dmslam {
namespace {

constexpr double kLongestWaitS = 1.0;

}  // namespace

BackgroundSearch::BackgroundSearch(FirstMapSearch search, std::shared_ptr<WorkSign> sign)
    : search_(std::move(search)),
      sign_(std::move(sign)),
      worker_([this](const std::stop_token& stop) { Work(stop); }) {
  last_.reason = "the search has just begun";
}

BackgroundSearch::~BackgroundSearch() = default;

InitializerReport BackgroundSearch::AddFrame(const InitializerFrame& frame) {
  const std::lock_guard lock(mutex_);
  if (problem_) std::rethrow_exception(std::exchange(problem_, nullptr));
  if (last_.result) {
    waiting_.clear();  // they belong to the time before this map
    return std::exchange(last_, InitializerReport());
  }
  waiting_.push_back(frame);
  while (SecondsFromTo(waiting_.front(), frame) > kLongestWaitS) waiting_.pop_front();
  changed_.notify_one();
  return last_;
}

void BackgroundSearch::Work(const std::stop_token& stop) {
  LetOthersGoFirst();
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !waiting_.empty() && !last_.result && !problem_; })) {
    const InitializerFrame frame = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    InitializerReport report;
    std::exception_ptr problem;
    sign_->Begin();
    try {
      report = search_(frame);
    } catch (...) {
      problem = std::current_exception();  // for who asks next
    }
    sign_->Rest();
    lock.lock();
    last_ = std::move(report);
    problem_ = problem;
  }
}

FirstMapSearch InBackground(FirstMapSearch search, std::shared_ptr<WorkSign> sign) {
  auto background = std::make_shared<BackgroundSearch>(std::move(search), std::move(sign));
  return [background](const InitializerFrame& frame) { return background->AddFrame(frame); };
}

}  // namespace dmslam
