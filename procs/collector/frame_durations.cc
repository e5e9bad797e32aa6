#include "collector/frame_durations.h"

namespace dmslam {

void FrameDurations::Add(const FrameTrace& trace) {
  const auto add = [](int64_t from_us, int64_t to_us, auto* durations) {
    if (to_us > 0) durations->Add(static_cast<double>(to_us - from_us) * 1e-3);
  };
  add(trace.begin_us, trace.tracked_us, &step);
  add(trace.decoded_us, trace.tracked_us, &apart);
  add(trace.begin_us, trace.decoded_us, &decode);
  add(trace.decoded_us, trace.extracted_us, &extract);
  add(trace.publish_us, trace.published_us, &image_to_pose);
}

}  // namespace dmslam
