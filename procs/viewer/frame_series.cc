#include "viewer/frame_series.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace dmslam {
namespace {

constexpr size_t kMost = 108'000;

double Round(double value, double step) { return std::round(value / step) * step; }

}  // namespace

void FrameSeries::Add(const PoseView& view) {
  if (!views_.empty() && view.frame_index <= views_.back().frame_index) return;
  views_.push_back(view);
  if (views_.size() <= kMost) return;
  views_.pop_front();
  ++first_;
}

void FrameSeries::Clear() {
  views_.clear();
  first_ = 0;
  ++run_;
}

std::string FrameSeries::Json(int64_t since, int64_t most) const {
  const int64_t from = std::max({since, first_, end() - most});
  nlohmann::json t = nlohmann::json::array(), frame = t, state = t, inliers = t, moving = t, share = t,
                 latency = t;
  for (int64_t i = from; i < end(); ++i) {
    const PoseView& view = views_[static_cast<size_t>(i - first_)];
    t.push_back(Round(static_cast<double>(view.stamp_ns - views_.front().stamp_ns) * 1e-9, 1e-3));
    frame.push_back(view.frame_index);
    state.push_back(static_cast<int>(view.state));
    inliers.push_back(view.inliers);
    moving.push_back(view.moving);
    share.push_back(Round(view.moving_share, 1e-4));
    latency.push_back(Round(view.latency_ms, 1e-2));
  }
  return nlohmann::json{{"first", std::min(from, end())},
                        {"end", end()},
                        {"run", run_},
                        {"t", t},
                        {"frame", frame},
                        {"state", state},
                        {"inliers", inliers},
                        {"moving", moving},
                        {"share", share},
                        {"latency", latency}}
      .dump();
}

}  // namespace dmslam
