#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

#include "dmslam/runtime/work_sign.h"
#include "dmslam/slam/frontend_core.h"

namespace dmslam {

/// Runs a search for the first map on a thread of its own: a search may take longer than frames are apart,
/// and nothing else waits for it, not even for a core. What it finds is told with the next frame; its frames
/// are then earlier ones. Where it is too slow for all frames, those that have waited for a second are left
/// out. For real time only: which frames it sees depends on the machine.
class BackgroundSearch {
 public:
  /// `sign`: says of each frame when it is taken up, and when it is done.
  explicit BackgroundSearch(FirstMapSearch search,
                            std::shared_ptr<WorkSign> sign = std::make_shared<WorkSign>());
  ~BackgroundSearch();
  BackgroundSearch(const BackgroundSearch&) = delete;
  BackgroundSearch& operator=(const BackgroundSearch&) = delete;

  /// Hands a frame over and returns at once: the map if one was found, else why there is none yet. Throws
  /// what the search threw.
  InitializerReport AddFrame(const InitializerFrame& frame);

 private:
  void Work(const std::stop_token& stop);

  FirstMapSearch search_;
  std::shared_ptr<WorkSign> sign_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<InitializerFrame> waiting_;
  InitializerReport last_;  ///< of the frame searched last
  std::exception_ptr problem_;
  std::jthread worker_;  ///< last: it ends before what it works on
};

/// A search that runs in the background.
FirstMapSearch InBackground(FirstMapSearch search, std::shared_ptr<WorkSign> sign);

}  // namespace dmslam
