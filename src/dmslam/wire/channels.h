#pragma once

namespace dmslam::channels {

/// Names of the channels that carry the typed messages, DMSLAM_<OWNER>_<CONTENT>. A prefix that separates
/// systems is put before them by the bus. The channels of the protocol (HEAD, ACK, PART ...) are named in
/// messaging/types.h.

inline constexpr char kCameraInfo[] = "DMSLAM_PLAYER_CAMERA_INFO";
inline constexpr char kFrame[] = "DMSLAM_PLAYER_FRAME";
inline constexpr char kEndOfSequence[] = "DMSLAM_PLAYER_END_OF_SEQUENCE";
inline constexpr char kGroundTruthPose[] = "DMSLAM_PLAYER_GROUND_TRUTH";
inline constexpr char kPlayerStatus[] = "DMSLAM_PLAYER_STATUS";

// Records of the frontend's stream (wire/streams.h lists what each stream carries).
inline constexpr char kSession[] = "DMSLAM_FRONTEND_SESSION";
inline constexpr char kInitialMap[] = "DMSLAM_FRONTEND_INITIAL_MAP";
inline constexpr char kKeyframe[] = "DMSLAM_FRONTEND_KEYFRAME";
inline constexpr char kFramePose[] = "DMSLAM_FRONTEND_FRAME_POSE";
inline constexpr char kFrameEvidence[] = "DMSLAM_FRONTEND_EVIDENCE";
inline constexpr char kMapReset[] = "DMSLAM_FRONTEND_RESET";
inline constexpr char kAdjustRequest[] = "DMSLAM_FRONTEND_ADJUST_REQUEST";
inline constexpr char kTurnRequest[] = "DMSLAM_FRONTEND_TURN_REQUEST";
// Not records: what may be lost.
/// The session once more, again and again: for who does not read the stream.
inline constexpr char kSessionAgain[] = "DMSLAM_FRONTEND_SESSION_AGAIN";
inline constexpr char kFrameDone[] = "DMSLAM_FRONTEND_FRAME_DONE";
inline constexpr char kSequenceDone[] = "DMSLAM_FRONTEND_SEQUENCE_DONE";
inline constexpr char kOdometry[] = "DMSLAM_FRONTEND_ODOMETRY";
inline constexpr char kPoseView[] = "DMSLAM_FRONTEND_POSE";
inline constexpr char kFeatureView[] = "DMSLAM_FRONTEND_FEATURES";
inline constexpr char kFrameTrace[] = "DMSLAM_FRONTEND_TRACE";
inline constexpr char kFrontendStatus[] = "DMSLAM_FRONTEND_STATUS";

// Records of the map stream.
inline constexpr char kMap[] = "DMSLAM_MAPPER_MAP";
inline constexpr char kMapperStatus[] = "DMSLAM_MAPPER_STATUS";

// Records of the loop closer's stream.
inline constexpr char kChecked[] = "DMSLAM_LOOPCLOSER_CHECKED";
inline constexpr char kLoopcloserStatus[] = "DMSLAM_LOOPCLOSER_STATUS";

}  // namespace dmslam::channels
