#include <algorithm>

#include "dmslam/adjust_request_t.hpp"
#include "dmslam/features_t.hpp"
#include "dmslam/frame_done_t.hpp"
#include "dmslam/frame_evidence_t.hpp"
#include "dmslam/frame_pose_t.hpp"
#include "dmslam/frame_trace_t.hpp"
#include "dmslam/initial_map_t.hpp"
#include "dmslam/keyframe_t.hpp"
#include "dmslam/map_reset_t.hpp"
#include "dmslam/odometry_t.hpp"
#include "dmslam/pose_t.hpp"
#include "dmslam/sequence_done_t.hpp"
#include "dmslam/session_t.hpp"
#include "dmslam/turn_request_t.hpp"
#include "dmslam/wire/camera_fields.h"
#include "dmslam/wire/enum_ranges.h"

namespace dmslam::wire {

template <>
struct Codec<SessionStart> {
  using Wire = session_t;
  static constexpr const char* kChannel = channels::kSession;

  static void Fields(auto& s, auto& m, auto& w) {
    s.Utime(m.first_stamp_ns, w.utime);
    s(m.session, w.session);
    s(m.camera_id, w.camera_id);
    s(m.seed, w.seed);
    s(m.configuration_hash, w.configuration_hash);
    s(m.vocabulary_checksum, w.vocabulary_checksum);
    s.OrMinusOne(m.first_stamp_ns, w.first_stamp_ns);
    s(m.mode, w.mode);
    s(m.pyramid.levels, w.pyramid_levels);
    s(m.pyramid.scale_factor, w.pyramid_scale_factor);
    CameraFields(s, m.camera, w);
    s(m.protocol_version, w.protocol_version);
    s(m.software, w.software);
    s(m.sequence, w.sequence);
    s(m.profile, w.profile);
  }
  static void Validate(const SessionStart& m, Checker& check) {
    check.Session(m.session);
    check.CameraNumber(m.camera_id);
    check.Stamp(m.first_stamp_ns);
    check.CameraModel(m.camera);
    check.Require(m.pyramid.levels >= 1 && m.pyramid.levels <= kMaxPyramidLevels,
                  "number of pyramid levels out of range");
    check.Require(m.pyramid.scale_factor > 1 && m.pyramid.scale_factor <= 4,
                  "pyramid's scale factor out of range");
  }
};

namespace {

void KeyframeFields(auto& s, auto& m, auto& w) {
  s(m.id, w.id);
  s(m.reference, w.reference_id);
  s(m.stamp_ns, w.stamp_ns);
  s(m.map_id, w.map_id);
  s(m.camera_id, w.camera_id);
  s(m.T_cam_reference, w.rotation_cam_reference, w.translation_cam_reference);
  s(m.reference_scale, w.reference_scale);
  auto& keypoints = m.features.keypoints;
  s.Count(keypoints, w.num_features, kMaxFeatures);
  s.Count(m.features.descriptors, w.num_features, kMaxFeatures);
  s.Column(keypoints, w.x_q4, &Keypoint::x_q4);
  s.Column(keypoints, w.y_q4, &Keypoint::y_q4);
  s.Column(keypoints, w.octave, &Keypoint::octave);
  s.Column(keypoints, w.angle, &Keypoint::angle);
  s.Descriptors(m.features.descriptors, w.num_descriptor_bytes, w.descriptors, std::identity());
  s.Count(m.features.depths_m, w.num_depths, kMaxFeatures);
  s.Count(m.features.depth_sigmas_m, w.num_depths, kMaxFeatures);
  s.Column(m.features.depths_m, w.depth_m, std::identity());
  s.Column(m.features.depth_sigmas_m, w.depth_sigma_m, std::identity());
  s.Count(m.features.sigmas_px, w.num_sigmas, kMaxFeatures);
  s.Column(m.features.sigmas_px, w.sigma_px, std::identity());
  s.Count(m.matches, w.num_matches, kMaxFeatures);
  s.Column(m.matches, w.match_feature, &KeyframeProposal::Match::feature);
  s.Column(m.matches, w.match_landmark, &KeyframeProposal::Match::landmark);
  s.Count(m.moving, w.num_moving, kMaxFeatures);
  s.Column(m.moving, w.moving, std::identity());
}

void ValidateKeyframe(const KeyframeProposal& m, Checker& check) {
  check.Id(m.id, "no keyframe id");
  check.OptionalId(m.reference, "impossible id of the reference keyframe");
  check.Require(m.map_id >= 1, "no map id");
  check.CameraNumber(m.camera_id);
  check.Stamp(m.stamp_ns);
  check.Pose(m.T_cam_reference, "no pose");
  check.Scale(m.reference_scale, "scale of the reference out of range");
  check.Features(m.features);
  for (const KeyframeProposal::Match& match : m.matches) {
    check.Require(match.feature < m.features.size(), "a match names a feature that is not there");
    check.Id(match.landmark, "a match names an impossible landmark");
  }
  for (size_t i = 0; i < m.moving.size(); ++i) {
    check.Require(m.moving[i] < m.features.size(), "a moving feature is not there");
    check.Require(i == 0 || m.moving[i - 1] < m.moving[i], "moving features are not ascending");
  }
}

}  // namespace

template <>
struct Codec<KeyframeProposal> {
  using Wire = keyframe_t;
  static constexpr const char* kChannel = channels::kKeyframe;

  static void Fields(auto& s, auto& m, auto& w) {
    s.Utime(m.stamp_ns, w.utime);
    KeyframeFields(s, m, w.keyframe);
  }
  static void Validate(const KeyframeProposal& m, Checker& check) { ValidateKeyframe(m, check); }
};

namespace {

constexpr size_t kMostViewsBetween = 8;

void ViewFields(auto& s, auto& m, auto& w) {
  KeyframeFields(s, m.keyframe, w.keyframe);
  s.Count(m.sights, w.num_sights, kMaxFeatures);
  s.Column(m.sights, w.point, &InitialMap::View::Sight::point);
  s.Column(m.sights, w.feature, &InitialMap::View::Sight::feature);
}

}  // namespace

template <>
struct Codec<InitialMap> {
  using Wire = initial_map_t;
  static constexpr const char* kChannel = channels::kInitialMap;

  static void Fields(auto& s, auto& m, auto& w) {
    using Point = InitialMap::Point;
    s.Utime(m.second.stamp_ns, w.utime);
    s(m.map_id, w.map_id);
    KeyframeFields(s, m.first, w.first);
    KeyframeFields(s, m.second, w.second);
    s.Count(m.points, w.num_points, kMaxFeatures);
    s.Column(m.points, w.feature_first, &Point::feature_first);
    s.Column(m.points, w.feature_second, &Point::feature_second);
    s.Column(m.points, w.x_world, Coordinate<0, &Point::p_world>());
    s.Column(m.points, w.y_world, Coordinate<1, &Point::p_world>());
    s.Column(m.points, w.z_world, Coordinate<2, &Point::p_world>());
    s.Count(m.between, w.num_between, kMostViewsBetween);
    if constexpr (std::remove_cvref_t<decltype(s)>::kToWire) w.between.resize(m.between.size());
    for (size_t i = 0; i < std::min(m.between.size(), w.between.size()); ++i)
      ViewFields(s, m.between[i], w.between[i]);
  }
  static void Validate(const InitialMap& m, Checker& check) {
    check.Require(m.map_id >= 1, "no map id");
    ValidateKeyframe(m.first, check);
    const KeyframeProposal* before = &m.first;
    const auto follows = [&](const KeyframeProposal& keyframe) {
      ValidateKeyframe(keyframe, check);
      const bool same = keyframe.map_id == m.map_id && keyframe.camera_id == m.first.camera_id &&
                        keyframe.id.session() == m.first.id.session();
      check.Require(same && before->id < keyframe.id, "keyframes of a first map that do not belong together");
      before = &keyframe;
    };
    for (const InitialMap::View& view : m.between) follows(view.keyframe);
    follows(m.second);
    check.Require(m.first.map_id == m.map_id, "keyframes of a first map that do not belong together");
    for (const InitialMap::Point& point : m.points) {
      check.Require(
          point.feature_first < m.first.features.size() && point.feature_second < m.second.features.size(),
          "a point names a feature that is not there");
      check.Position(point.p_world, "position of a point is not finite");
    }
    for (const InitialMap::View& view : m.between) {
      for (const InitialMap::View::Sight& sight : view.sights) {
        check.Require(sight.point < m.points.size(), "a sight names a point that is not there");
        check.Require(sight.feature < view.keyframe.features.size(),
                      "a sight names a feature that is not there");
      }
    }
  }
};

template <>
struct Codec<FramePose> {
  using Wire = frame_pose_t;
  static constexpr const char* kChannel = channels::kFramePose;

  static void Fields(auto& s, auto& m, auto& w) {
    s.Utime(m.stamp_ns, w.utime);
    s(m.frame_index, w.frame_index);
    s(m.state, w.state);
    s(m.stamp_ns, w.stamp_ns);
    s(m.map_id, w.map_id);
    s(m.reference, w.reference_id);
    s(m.T_cam_reference, w.rotation_cam_reference, w.translation_cam_reference);
    s(m.reference_scale, w.reference_scale);
    s(m.T_cam_world, w.rotation_cam_world, w.translation_cam_world);
    s(m.num_features, w.num_features);
    s(m.num_static, w.num_static);
    s(m.num_moving, w.num_moving);
    s(m.num_unknown, w.num_unknown);
    s(m.moving_image_share, w.moving_image_share);
    s(m.camera_id, w.camera_id);
    s.Count(m.covariance, w.num_covariance, kPoseCovarianceSize);
    s.Column(m.covariance, w.covariance, std::identity());
    s.Count(m.step_covariance, w.num_step_covariance, kPoseCovarianceSize);
    s.Column(m.step_covariance, w.step_covariance, std::identity());
    s.OrMinusOne(m.step_from, w.step_from);
    s(m.reason, w.reason);
  }
  static void Validate(const FramePose& m, Checker& check) {
    check.Stamp(m.stamp_ns);
    check.OptionalId(m.reference, "impossible id of the reference keyframe");
    // Not the reverse: logs from before STATE_MISSING have STATE_UNCERTAIN without a pose.
    check.Require(!m.HasPose() || HasPose(m.state), "a pose in a state that has none");
    check.Pose(m.T_cam_reference, "no pose relative to the reference keyframe");
    check.Pose(m.T_cam_world, "no pose in the map");
    check.Scale(m.reference_scale, "scale of the reference out of range");
    check.Share(static_cast<double>(m.moving_image_share));
    check.CameraNumber(m.camera_id);
    check.Covariance(m.covariance);
    check.Covariance(m.step_covariance);
    check.Require(m.step_covariance.empty() || m.step_from.has_value(),
                  "a step's covariance without the frame that it starts from");
  }
};

template <>
struct Codec<FrameEvidence> {
  using Wire = frame_evidence_t;
  static constexpr const char* kChannel = channels::kFrameEvidence;

  static void Fields(auto& s, auto& m, auto& w) {
    using Item = FrameEvidence::Item;
    s.Utime(m.stamp_ns, w.utime);
    s(m.map_id, w.map_id);
    s(m.camera_id, w.camera_id);
    s(m.stamp_ns, w.stamp_ns);
    s.Count(m.items, w.num_landmarks);
    s.Column(m.items, w.landmark, &Item::landmark);
    s.Column(m.items, w.visible, &Item::visible);
    s.Column(m.items, w.found, &Item::found);
    s.Column(m.items, w.moved, &Item::moved);
  }
  static void Validate(const FrameEvidence& m, Checker& check) {
    check.Stamp(m.stamp_ns);
    check.CameraNumber(m.camera_id);
    for (size_t i = 0; i < m.items.size(); ++i) {
      check.Id(m.items[i].landmark, "impossible landmark");
      check.Require(i == 0 || m.items[i - 1].landmark < m.items[i].landmark, "landmarks are not ascending");
    }
  }
};

template <>
struct Codec<MapReset> {
  using Wire = map_reset_t;
  static constexpr const char* kChannel = channels::kMapReset;

  static void Fields(auto& s, auto& m, auto& w) {
    s.Utime(m.stamp_ns, w.utime);
    s.OrMinusOne(m.stamp_ns, w.stamp_ns);
    s(m.map_id, w.map_id);
    s(m.camera_id, w.camera_id);
    s(m.fate, w.drop);
    s(m.reason, w.reason);
  }
  static void Validate(const MapReset& m, Checker& check) {
    check.Require(m.map_id >= 1, "a reset of no map");
    check.CameraNumber(m.camera_id);
    check.Stamp(m.stamp_ns);
  }
};

template <>
struct Codec<AdjustRequest> {
  using Wire = adjust_request_t;
  static constexpr const char* kChannel = channels::kAdjustRequest;

  static void Fields(auto& s, auto& m, auto& w) {
    s.Utime(m.newest_stamp_ns, w.utime);
    s.OrMinusOne(m.newest_stamp_ns, w.newest_stamp_ns);
    s(m.request, w.request);
    s(m.camera_id, w.camera_id);
    s(m.reason, w.reason);
  }
  static void Validate(const AdjustRequest& m, Checker& check) {
    check.Require(m.request >= 1, "a request without a number");
    check.CameraNumber(m.camera_id);
    check.Stamp(m.newest_stamp_ns);
  }
};

template <>
struct Codec<TurnRequest> {
  using Wire = turn_request_t;
  static constexpr const char* kChannel = channels::kTurnRequest;

  static void Fields(auto& s, auto& m, auto& w) {
    s.Utime(m.time.stamp_ns, w.utime);
    s.OrMinusOne(m.time.stamp_ns, w.stamp_ns);  // -1: the end
    s(m.frame_index, w.frame_index);
    s(m.camera_id, w.camera_id);
  }
  static void Validate(const TurnRequest& m, Checker& check) {
    check.Require(m.frame_index < kMaxFrames, "number of the frame out of range");
    check.Require(m.camera_id < kMaxCameras, "number of the camera out of range");
    check.Stamp(m.time.stamp_ns);
  }
};

template <>
struct Codec<FrameDone> {
  using Wire = frame_done_t;
  static constexpr const char* kChannel = channels::kFrameDone;

  static void Fields(auto& s, auto& m, auto& w) {
    s.Utime(m.stamp_ns, w.utime);
    s(m.session, w.session);
    s(m.camera_id, w.camera_id);
    s(m.frame_index, w.frame_index);
    s(m.stamp_ns, w.done_stamp_ns);
  }
  static void Validate(const FrameDone& m, Checker& check) {
    check.Session(m.session);
    check.CameraNumber(m.camera_id);
    check.Stamp(m.stamp_ns);
  }
};

template <>
struct Codec<SequenceDone> {
  using Wire = sequence_done_t;
  static constexpr const char* kChannel = channels::kSequenceDone;

  static void Fields(auto& s, auto& m, auto& w) {
    s(m.utime, w.utime);
    s(m.session, w.session);
    s(m.camera_id, w.camera_id);
    s(m.frames_processed, w.frames_processed);
    s(m.frames_skipped, w.frames_skipped);
  }
  static void Validate(const SequenceDone& m, Checker& check) {
    check.Session(m.session);
    check.CameraNumber(m.camera_id);
    check.Require(m.frames_processed >= 0 && m.frames_skipped >= 0, "negative number of frames");
  }
};

template <>
struct Codec<Odometry> {
  using Wire = odometry_t;
  static constexpr const char* kChannel = channels::kOdometry;

  static void Fields(auto& s, auto& m, auto& w) {
    s.Utime(m.stamp_ns, w.utime);
    s(m.session, w.session);
    s(m.camera_id, w.camera_id);
    s(m.frame_index, w.frame_index);
    s(m.stamp_ns, w.stamp_ns);
    s(m.state, w.state);
    s(m.segment, w.segment);
    s(m.measured, w.measured);
    s(m.T_odom_cam, w.rotation_odom_cam, w.translation_odom_cam);
    s(m.has_velocity, w.has_velocity);
    for (int i = 0; i < 3; ++i) {
      s(m.linear_velocity[i], w.linear_velocity[i]);
      s(m.angular_velocity[i], w.angular_velocity[i]);
    }
    s(m.map_id, w.map_id);
    s(m.T_map_odom, w.rotation_map_odom, w.translation_map_odom);
    s(m.scale_map_odom, w.scale_map_odom);
    s(m.depth, w.depth);
    s(m.latency_ms, w.latency_ms);
    s.OrMinusOne(m.step_from, w.step_from);
    s.Count(m.step_covariance, w.num_step_covariance, kPoseCovarianceSize);
    s.Column(m.step_covariance, w.step_covariance, std::identity());
  }
  static void Validate(const Odometry& m, Checker& check) {
    check.Session(m.session);
    check.CameraNumber(m.camera_id);
    check.Stamp(m.stamp_ns);
    check.Pose(m.T_odom_cam, "no pose in odom");
    check.Position(m.linear_velocity, "a velocity is not finite");
    check.Position(m.angular_velocity, "an angular velocity is not finite");
    check.Pose(m.T_map_odom, "no pose of odom in the map");
    check.Scale(m.scale_map_odom, "scale of odom in the map out of range");
    check.Scale(m.depth, "depth of the scene out of range");
    check.Finite(m.latency_ms, "latency is not finite");
    check.Covariance(m.step_covariance);
    check.Require(m.step_covariance.empty() || m.step_from.has_value(),
                  "a step's covariance without the frame that it starts from");
  }
};

template <>
struct Codec<PoseView> {
  using Wire = pose_t;
  static constexpr const char* kChannel = channels::kPoseView;

  static void Fields(auto& s, auto& m, auto& w) {
    s.Utime(m.stamp_ns, w.utime);
    s(m.session, w.session);
    s(m.camera_id, w.camera_id);
    s(m.stamp_ns, w.stamp_ns);
    s(m.frame_index, w.frame_index);
    s(m.state, w.state);
    s(m.map_id, w.map_id);
    s(m.has_pose, w.has_pose);
    s(m.T_world_cam.translation.x(), w.x);
    s(m.T_world_cam.translation.y(), w.y);
    s(m.T_world_cam.translation.z(), w.z);
    s(m.T_world_cam.rotation.x(), w.qx);
    s(m.T_world_cam.rotation.y(), w.qy);
    s(m.T_world_cam.rotation.z(), w.qz);
    s(m.T_world_cam.rotation.w(), w.qw);
    s(m.inliers, w.inliers);
    s(m.moving, w.moving);
    s(m.unknown, w.unknown);
    s(m.moving_share, w.moving_share);
    s(m.latency_ms, w.latency_ms);
    s.OrMinusOne(m.error_m, w.error_m);
  }
  static void Validate(const PoseView& m, Checker& check) {
    check.Session(m.session);
    check.CameraNumber(m.camera_id);
    check.Stamp(m.stamp_ns);
    check.Pose(m.T_world_cam, "no pose");
    check.Require(m.inliers >= 0 && m.moving >= 0 && m.unknown >= 0, "negative number of features");
    check.Share(m.moving_share);
    check.Finite(m.latency_ms, "latency is not finite");
    check.Finite(m.error_m.value_or(0), "error is not finite");
  }
};

template <>
struct EnumRange<FeatureView::Kind> {
  static constexpr auto kFirst = FeatureView::Kind::kUnmatched, kLast = FeatureView::Kind::kMoving;
  static constexpr const char* kName = "unknown kind of a feature";
};

template <>
struct Codec<FeatureView> {
  using Wire = features_t;
  static constexpr const char* kChannel = channels::kFeatureView;

  static void Fields(auto& s, auto& m, auto& w) {
    using Item = FeatureView::Item;
    s.Utime(m.stamp_ns, w.utime);
    s(m.session, w.session);
    s(m.camera_id, w.camera_id);
    s(m.frame_index, w.frame_index);
    s(m.stamp_ns, w.stamp_ns);
    s.Count(m.items, w.num_features, kMaxFeatures);
    s.Column(m.items, w.u_q4, &Item::u_q4);
    s.Column(m.items, w.v_q4, &Item::v_q4);
    s.Column(m.items, w.kind, &Item::kind);
  }
  static void Validate(const FeatureView& m, Checker& check) {
    check.Session(m.session);
    check.CameraNumber(m.camera_id);
    check.Stamp(m.stamp_ns);
  }
};

template <>
struct Codec<FrameTrace> {
  using Wire = frame_trace_t;
  static constexpr const char* kChannel = channels::kFrameTrace;

  static void Fields(auto& s, auto& m, auto& w) {
    s.Utime(m.stamp_ns, w.utime);
    s(m.session, w.session);
    s(m.camera_id, w.camera_id);
    s(m.frame_index, w.frame_index);
    s(m.stamp_ns, w.stamp_ns);
    s(m.capture_us, w.capture_us);
    s(m.publish_us, w.publish_us);
    s(m.receive_us, w.receive_us);
    s(m.begin_us, w.begin_us);
    s(m.decoded_us, w.decoded_us);
    s(m.extracted_us, w.extracted_us);
    s(m.tracked_us, w.tracked_us);
    s(m.published_us, w.published_us);
  }
  static void Validate(const FrameTrace& m, Checker& check) {
    check.Session(m.session);
    check.CameraNumber(m.camera_id);
    check.Stamp(m.stamp_ns);
  }
};

DMSLAM_WIRE_MESSAGE(SessionStart);
DMSLAM_WIRE_MESSAGE(KeyframeProposal);
DMSLAM_WIRE_MESSAGE(InitialMap);
DMSLAM_WIRE_MESSAGE(FramePose);
DMSLAM_WIRE_MESSAGE(FrameEvidence);
DMSLAM_WIRE_MESSAGE(MapReset);
DMSLAM_WIRE_MESSAGE(AdjustRequest);
DMSLAM_WIRE_MESSAGE(TurnRequest);
DMSLAM_WIRE_MESSAGE(FrameDone);
DMSLAM_WIRE_MESSAGE(SequenceDone);
DMSLAM_WIRE_MESSAGE(Odometry);
DMSLAM_WIRE_MESSAGE(PoseView);
DMSLAM_WIRE_MESSAGE(FeatureView);
DMSLAM_WIRE_MESSAGE(FrameTrace);

}  // namespace dmslam::wire
