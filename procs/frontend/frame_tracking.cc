#include "frontend/frame_tracking.h"

#include "dmslam/recording/recorded_frames.h"
#include "dmslam/util/check.h"
#include "frontend/pictures.h"

namespace dmslam {
namespace {

std::string SizeText(int width_px, int height_px) {
  return std::to_string(width_px) + "x" + std::to_string(height_px);
}

FeatureView ViewOfFeatures(uint32_t session, const TrackedFrame& frame) {
  FeatureView view{session, frame.index, frame.stamp_ns, {}};
  view.items.reserve(frame.classes.size());
  for (size_t i = 0; i < frame.classes.size(); ++i) {
    const Keypoint& keypoint = frame.features->set.keypoints[i];
    view.items.push_back({keypoint.x_q4, keypoint.y_q4, static_cast<FeatureView::Kind>(frame.classes[i])});
  }
  return view;
}

}  // namespace

std::variant<Tracked, ImageProblem> FrameTracking::Track(const ReceivedFrame& received, bool withheld,
                                                         FrontendCore* core) {
  const Frame& frame = received.frame;
  Tracked tracked;
  FrameTrace& trace = tracked.trace;
  trace = {options_.session, frame.frame_index,   frame.stamp_ns,    frame.capture_us,
           frame.publish_us, received.receive_us, options_.wall_us()};
  if (std::optional<ImageProblem> problem = Decode(frame)) return std::move(*problem);
  trace.decoded_us = options_.wall_us();
  core->SetWithheld(withheld);
  tracked.output = core->ProcessImage(frame.frame_index, frame.stamp_ns,
                                      {image_.data.data(), image_.width, image_.height, image_.width});
  tracked.odometry = core->odometry();
  tracked.extract_ms = core->extract_ms();
  trace.tracked_us = options_.wall_us();
  trace.extracted_us = trace.decoded_us + static_cast<int64_t>(1000.0 * tracked.extract_ms);
  tracked.features = ViewOfFeatures(options_.session, core->frame());
  return tracked;
}

std::optional<ImageProblem> FrameTracking::Decode(const Frame& frame) {
  const std::string name = "frame " + std::to_string(frame.frame_index);
  try {
    decoder_.Decode(ToImageEncoding(frame.encoding), frame.width_px, frame.height_px, frame.data, name,
                    image_);
  } catch (const InputError& error) {
    return ImageProblem{ImageProblem::Kind::kUnreadable, error.what()};
  }
  if (image_.width == options_.width_px && image_.height == options_.height_px) return std::nullopt;
  return ImageProblem{ImageProblem::Kind::kOtherSize,
                      name + " is " + SizeText(image_.width, image_.height) +
                          " pixels, but the camera file says " +
                          SizeText(options_.width_px, options_.height_px) +
                          "; give the camera file that belongs to the sequence (--camera)"};
}

void FrameTracking::DrawPicture(const FrontendOutput& output, const TrackedFrame& frame) const {
  if (options_.picture_every <= 0 || frame.index % static_cast<uint32_t>(options_.picture_every) != 0) return;
  for (auto event = output.events.rbegin(); event != output.events.rend(); ++event) {
    const auto* pose = std::get_if<FramePose>(&*event);
    if (pose) return WritePicture(options_.picture_dir, image_, frame, *pose);
  }
}

}  // namespace dmslam
