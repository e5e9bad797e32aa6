#include "dmslam/recording/recorded_frames.h"

#include <algorithm>

#include "dmslam/util/check.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
ImageEncoding ToImageEncoding(FrameEncoding encoding) {
  switch (encoding) {
    case FrameEncoding::kJpeg:
      return ImageEncoding::kJpeg;
    case FrameEncoding::kPng:
      return ImageEncoding::kPng;
    case FrameEncoding::kGray8:
      return ImageEncoding::kGray8;
    case FrameEncoding::kRgb8:
      return ImageEncoding::kRgb8;
    case FrameEncoding::kBgr8:
      return ImageEncoding::kBgr8;
  }
  return ImageEncoding::kFile;
}

namespace {

std::string Listed(const std::vector<CameraId>& cameras) {
  std::string numbers;
  for (const CameraId camera : cameras) numbers += (numbers.empty() ? "" : ", ") + std::to_string(camera);
  return numbers;
}

const RecordedCamera& ChooseCamera(const LogIndex& log, uint32_t session_id, CameraId wanted) {
  const RecordedSession& session = log.Session(session_id);
  const std::vector<CameraId> there = session.CamerasWithFrames();
  if (there.empty()) throw InputError(log.path() + ": holds no frames; was the player recorded too?");
  const CameraId chosen = there.size() == 1 ? there.front() : wanted;
  if (std::ranges::find(there, chosen) == there.end()) {
    throw InputError(log.path() + ": holds no frames of camera " + std::to_string(wanted) + " but of " +
                     Listed(there));
  }
  const RecordedCamera& camera = session.cameras.at(chosen);
  if (!camera.info) {
    throw InputError(log.path() +
                     ": does not say which camera took its frames; record from before the player starts");
  }
  return camera;
}

}  // namespace

RecordedFrames::RecordedFrames(std::shared_ptr<const LogIndex> log, uint32_t session, CameraId camera)
    : log_(std::move(log)), camera_(&ChooseCamera(*log_, session, camera)) {
  std::optional<int64_t> newest_ns;  // stamps increase strictly, or it is no sequence
  for (const auto& [index, message] : camera_->frames) {
    const int64_t stamp_ns = camera_->stamps_ns.at(index);
    if (newest_ns && stamp_ns <= *newest_ns) continue;
    newest_ns = stamp_ns;
    frames_.emplace_back(index, &message);
  }
}

std::string RecordedFrames::Name(size_t index) const {
  return log_->path() + ", frame " + std::to_string(FrameIndex(index));
}

EncodedImage RecordedFrames::Read(size_t index) {
  const std::optional<Frame> frame = wire::Decode<Frame>(log_->Read(*frames_.at(index).second));
  if (!frame) throw InputError(Name(index) + ": cannot be decoded");
  return {ToImageEncoding(frame->encoding), frame->width_px, frame->height_px, frame->data};
}

size_t RecordedFrames::missing() const {
  return camera_->end ? static_cast<size_t>(camera_->end->frames_missing) : 0;
}

std::vector<StampedPose> RecordedFrames::GroundTruth() const {
  std::vector<StampedPose> poses;
  for (const auto& [stamp_ns, pose] : camera_->ground_truth) poses.push_back({stamp_ns, pose.T_world_cam});
  return poses;
}

}  // namespace dmslam
