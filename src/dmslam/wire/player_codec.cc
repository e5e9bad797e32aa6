#include "dmslam/camera_info_t.hpp"
#include "dmslam/end_of_sequence_t.hpp"
#include "dmslam/frame_t.hpp"
#include "dmslam/ground_truth_pose_t.hpp"
#include "dmslam/wire/camera_fields.h"
#include "dmslam/wire/enum_ranges.h"

namespace dmslam::wire {

template <>
struct Codec<CameraInfo> {
  using Wire = camera_info_t;
  static constexpr const char* kChannel = channels::kCameraInfo;

  static void Fields(auto& s, auto& m, auto& w) {
    s(m.utime, w.utime);
    s(m.session, w.session);
    s(m.camera_id, w.camera_id);
    CameraFields(s, m.camera, w);
    s(m.num_frames, w.num_frames);
    s(m.first_frame, w.first_frame);
    s(m.mode, w.mode);
    s(m.speed, w.speed);
    s(m.sequence, w.sequence);
  }
  static void Validate(const CameraInfo& m, Checker& check) {
    check.Session(m.session);
    check.CameraNumber(m.camera_id);
    check.CameraModel(m.camera);
    check.Require(!m.num_frames || *m.num_frames >= 0, "negative number of frames");
    check.Require(std::isfinite(m.speed) && m.speed >= 0, "speed below zero");
  }
};

template <>
struct EnumRange<FrameEncoding> {
  static constexpr auto kFirst = FrameEncoding::kJpeg, kLast = FrameEncoding::kBgr8;
  static constexpr const char* kName = "unknown encoding of an image";
};

template <>
struct Codec<Frame> {
  using Wire = frame_t;
  static constexpr const char* kChannel = channels::kFrame;

  static void Fields(auto& s, auto& m, auto& w) {
    s.Utime(m.stamp_ns, w.utime);
    s.Count(m.data, w.num_bytes, kMaxMessageBytes);
    s(m.frame_index, w.frame_index);
    s(m.session, w.session);
    s(m.camera_id, w.camera_id);
    s(m.stamp_ns, w.stamp_ns);
    s(m.capture_us, w.capture_us);
    s(m.publish_us, w.publish_us);
    s(m.width_px, w.width_px);
    s(m.height_px, w.height_px);
    s(m.encoding, w.encoding);
    s.Bytes(m.data, w.data);
  }
  static void Validate(const Frame& m, Checker& check) {
    check.Session(m.session);
    check.CameraNumber(m.camera_id);
    check.Stamp(m.stamp_ns);
    check.Require(m.width_px >= 0 && m.width_px <= kMaxImageSidePx && m.height_px >= 0 &&
                      m.height_px <= kMaxImageSidePx,
                  "image size out of range");
    check.Require(!m.data.empty(), "no image");
    size_t channels = 0;
    if (m.encoding == FrameEncoding::kGray8) channels = 1;
    if (m.encoding == FrameEncoding::kRgb8 || m.encoding == FrameEncoding::kBgr8) channels = 3;
    if (channels == 0 || !check.ok()) return;
    check.Require(
        m.data.size() == channels * static_cast<size_t>(m.width_px) * static_cast<size_t>(m.height_px),
        "not as many bytes as pixels need");
  }
};

template <>
struct Codec<EndOfSequence> {
  using Wire = end_of_sequence_t;
  static constexpr const char* kChannel = channels::kEndOfSequence;

  static void Fields(auto& s, auto& m, auto& w) {
    s(m.utime, w.utime);
    s(m.session, w.session);
    s(m.camera_id, w.camera_id);
    s(m.frames_published, w.frames_published);
    s(m.frames_listed, w.frames_listed);
    s(m.frames_missing, w.frames_missing);
    s(m.frames_blacked, w.frames_blacked);
    s(m.frames_jumped, w.frames_jumped);
    s.OrMinusOne(m.last_frame_index, w.last_frame_index);
    s(m.last_stamp_ns, w.last_stamp_ns);
  }
  static void Validate(const EndOfSequence& m, Checker& check) {
    check.Session(m.session);
    check.CameraNumber(m.camera_id);
    check.Stamp(m.last_stamp_ns);
    check.Require(!m.last_frame_index || *m.last_frame_index >= 0, "negative frame index");
    for (const int64_t count :
         {m.frames_published, m.frames_listed, m.frames_missing, m.frames_blacked, m.frames_jumped}) {
      check.Require(count >= 0, "negative number of frames");
    }
  }
};

template <>
struct Codec<GroundTruthPose> {
  using Wire = ground_truth_pose_t;
  static constexpr const char* kChannel = channels::kGroundTruthPose;

  static void Fields(auto& s, auto& m, auto& w) {
    s.Utime(m.stamp_ns, w.utime);
    s(m.session, w.session);
    s(m.camera_id, w.camera_id);
    s(m.stamp_ns, w.stamp_ns);
    s(m.frame_index, w.frame_index);
    s(m.T_world_cam, w.rotation_world_cam, w.translation_world_cam);
  }
  static void Validate(const GroundTruthPose& m, Checker& check) {
    check.Session(m.session);
    check.CameraNumber(m.camera_id);
    check.Stamp(m.stamp_ns);
    check.Pose(m.T_world_cam, "no pose");
  }
};

DMSLAM_WIRE_MESSAGE(CameraInfo);
DMSLAM_WIRE_MESSAGE(Frame);
DMSLAM_WIRE_MESSAGE(EndOfSequence);
DMSLAM_WIRE_MESSAGE(GroundTruthPose);

}  // namespace dmslam::wire
