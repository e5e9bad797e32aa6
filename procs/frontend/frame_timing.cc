#include "frontend/frame_timing.h"

#include <utility>

namespace dmslam {
namespace {

double MsBetween(int64_t begin_us, int64_t end_us) { return static_cast<double>(end_us - begin_us) * 1e-3; }

}  // namespace

void FrameTiming::Add(const FrameTrace& trace, double extract_ms) {
  ++frames_;
  latency_.Add(MsBetween(trace.publish_us, trace.published_us));
  decode_.Add(MsBetween(trace.begin_us, trace.decoded_us));
  extract_.Add(extract_ms);
  step_.Add(MsBetween(trace.begin_us, trace.tracked_us));
}

void FrameTiming::TakeStatus(FrontendStatus* status) {
  status->frames_processed = frames_;
  status->fps = static_cast<double>(frames_ - std::exchange(frames_at_status_, frames_));
  status->latency_p50_ms = latency_.Quantile(0.5);
  status->latency_p95_ms = latency_.Quantile(0.95);
  status->latency_p99_ms = latency_.Quantile(0.99);
  status->decode_ms = decode_.Quantile(0.5);
  status->extract_ms = extract_.Quantile(0.5);
  status->step_ms = step_.Quantile(0.5);
  status->step_p95_ms = step_.Quantile(0.95);
  status->track_ms = status->step_ms - status->decode_ms - status->extract_ms;
}

}  // namespace dmslam
