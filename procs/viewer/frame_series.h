#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>

#include "dmslam/wire/frontend_messages.h"

namespace dmslam {

/// What is plotted of a camera over time: one entry per frame, the newest hour at 30 Hz.
class FrameSeries {
 public:
  void Add(const PoseView& view);
  void Clear();
  int64_t end() const { return first_ + static_cast<int64_t>(views_.size()); }
  const PoseView* newest() const { return views_.empty() ? nullptr : &views_.back(); }

  /// Entries from number `since` on (from the oldest kept where that is gone) as JSON: "first", "end", "run"
  /// (another one where all before is void), and equally long arrays "t" [s], "frame", "state", "inliers",
  /// "moving", "share" (0..1), "latency" [ms]. At most `most`, the newest.
  std::string Json(int64_t since, int64_t most) const;

 private:
  std::deque<PoseView> views_;
  int64_t first_ = 0;
  int64_t run_ = 1;
};

/// One series per camera.
class CameraSeries {
 public:
  void Add(const PoseView& view) { of_[view.camera_id].Add(view); }
  void Clear() {
    for (auto& [camera, series] : of_) series.Clear();
  }
  std::string Json(CameraId camera, int64_t since, int64_t most) const {
    const auto it = of_.find(camera);
    return (it == of_.end() ? FrameSeries() : it->second).Json(since, most);
  }

 private:
  std::map<CameraId, FrameSeries> of_;
};

}  // namespace dmslam
