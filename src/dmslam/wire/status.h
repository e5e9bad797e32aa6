#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "dmslam/map/proposals.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// How a process fares, whichever it is. Counters count from its start.
struct ProcessHealth {
  int32_t pid = 0;
  double uptime_s = 0;
  double rss_mb = 0;        ///< resident memory [MiB]
  double cpu_percent = 0;   ///< of one core, over the last second
  int32_t queue_depth = 0;  ///< messages received and not yet worked on
  int32_t queue_peak = 0;   ///< the deepest it was
  int64_t received = 0;     ///< messages that arrived
  int64_t received_bytes = 0;
  int64_t dropped_foreign = 0;    ///< of another session
  int64_t dropped_malformed = 0;  ///< length, counts or values are wrong
  int64_t dropped_checksum = 0;
  int64_t dropped_overflow = 0;   ///< the queue was full
  int64_t dropped_duplicate = 0;  ///< records that were there already
  int64_t refused_peers = 0;      ///< beacons of another protocol or schema
  int64_t repairs_requested = 0;  ///< as reader: pieces asked for again
  int64_t records_repaired = 0;   ///< as reader: records that arrived only because of that
  int64_t records_lost = 0;       ///< as reader: given up, that is bridged by a snapshot
  double recovery_p50_ms = 0;     ///< as reader: from a record's being named as missing to its being here
  double recovery_p99_ms = 0;
  int64_t epoch = 0;    ///< as writer; 0: not yet, or no writer
  int64_t written = 0;  ///< as writer: records
  int64_t written_bytes = 0;
  int64_t resent = 0;  ///< as writer: pieces sent again
  int64_t resent_bytes = 0;
  int32_t unacknowledged = 0;  ///< as writer: records that some reader still lacks
  int64_t kept_bytes = 0;      ///< as writer: held for repair
  int32_t readers = 0;         ///< as writer: known ones
  int32_t snapshots = 0;       ///< as writer: begun
  std::string host;
  std::string waiting_for;  ///< names of peers that it waits for; empty: none
};

/// What the process does: the part of a status that all share. Published once a second.
struct StatusHead {
  int64_t utime = 0;     ///< wall time at which it was sent [us]
  uint32_t session = 0;  ///< 0: none yet
  ProcessHealth health;
  std::string reason;  ///< why it is in its state, and what it waits for
};

struct PlayerStatus {
  enum class State : uint8_t { kStarting = 1, kWaiting = 2, kPlaying = 3, kDone = 4 };
  StatusHead head;
  State state = State::kStarting;
  int64_t frames_published = 0;
  std::optional<int64_t> frames_total;  ///< where it is known
  int64_t frames_missing = 0;
  int64_t repeats = 0;                 ///< frames sent again in lock-step
  std::optional<int32_t> frame_index;  ///< of the newest frame; none: none yet
  double fps = 0;                      ///< over the last second
  double late_ms = 0;                  ///< how late the newest frame was published
  CameraId camera_id = 0;
};

struct FrontendStatus {
  StatusHead head;
  TrackingState state = TrackingState::kNotInitialized;
  double fps = 0;  ///< frames processed over the last second
  int64_t frames_received = 0;
  int64_t frames_processed = 0;
  int64_t frames_skipped = 0;          ///< left out in favour of the newest: too many waited
  std::optional<int32_t> frame_index;  ///< of the newest frame; none: none yet
  int32_t features = 0;                ///< in the newest frame
  int32_t inliers = 0;
  int32_t moving = 0;
  int32_t unknown = 0;
  double moving_share = 0;
  double latency_p50_ms = 0;  ///< image published to pose published, over the last 10 s
  double latency_p95_ms = 0;
  double latency_p99_ms = 0;
  double decode_ms = 0;  ///< medians over the last 10 s
  double extract_ms = 0;
  double track_ms = 0;
  double step_ms = 0;
  double step_p95_ms = 0;
  std::optional<MapId> map_id;
  int64_t map_version = 0;  ///< of its replica
  int32_t map_keyframes = 0;
  int32_t map_landmarks = 0;
  int64_t keyframes_proposed = 0;
  int64_t keyframes_withheld = 0;  ///< wanted, but too many were unacknowledged
  int32_t keyframes_unacknowledged = 0;
  int64_t resets = 0;
  int64_t relocalisations = 0;
  std::optional<double> first_map_s;  ///< from the first frame to the first map that lasted; none: none yet
  CameraId camera_id = 0;
};

struct MapperStatus {
  enum class State : uint8_t {
    kStarting = 1,  ///< no camera is known yet
    kWaiting = 2,   ///< its stream is not open yet, or no frontend is there
    kMapping = 3,
    kDone = 4,  ///< the map is complete
  };
  StatusHead head;
  State state = State::kStarting;
  int64_t version = 0;
  int32_t maps = 0;  ///< that have a keyframe
  int32_t keyframes = 0;
  int32_t landmarks = 0;
  int32_t moving_landmarks = 0;      ///< believed to move
  int32_t keyframe_queue = 0;        ///< proposed and not yet inserted
  int32_t keyframes_unaccepted = 0;  ///< inserted, but no other process holds the record yet
  int64_t keyframes_inserted = 0;
  int64_t keyframes_culled = 0;
  int64_t landmarks_created = 0;
  int64_t landmarks_culled = 0;       ///< hardly found, seen to move, or seen through
  int64_t landmarks_fused = 0;        ///< that became part of others
  int64_t observations_dropped = 0;   ///< of keyframes in flight, whose landmark was gone
  int64_t refused_neighbourhood = 0;  ///< candidates for landmarks refused by mutual exclusion
  int64_t refused_motion = 0;         ///< features of keyframes, seen to move: none is made of them
  int64_t refused_geometry = 0;
  int64_t corrections_applied = 0;
  int64_t corrections_refused = 0;
  std::optional<KeyframeId> last_settled;
  double landmarks_p50_ms = 0;  ///< keyframe received to its new landmarks published
  double landmarks_p95_ms = 0;
  double landmarks_p99_ms = 0;
  double adjusted_p50_ms = 0;  ///< keyframe received to its local bundle adjustment published
  double adjusted_p95_ms = 0;
  double adjusted_p99_ms = 0;
  double adjustment_ms = 0;  ///< median time of a local bundle adjustment
};

struct LoopcloserStatus {
  enum class State : uint8_t {
    kStarting = 1,  ///< no camera is known yet
    kWaiting = 2,   ///< its stream is not open yet, or no mapper is there
    kWatching = 3,
    kCorrecting = 4,  ///< works a correction out, or waits for the mapper's word on it
    kDone = 5,        ///< the map is complete
  };
  StatusHead head;
  State state = State::kStarting;
  int64_t replica_version = 0;
  int32_t indexed_keyframes = 0;
  int32_t keyframe_queue = 0;  ///< records of the map known and not yet taken, with keyframes among them
  int64_t keyframes_checked = 0;
  int64_t candidates = 0;
  int64_t refused_consistency = 0;
  int64_t refused_geometry = 0;
  int64_t loops_closed = 0;
  int64_t global_adjustments = 0;
  std::optional<KeyframeId> last_keyframe;       ///< newest keyframe checked
  std::optional<KeyframeId> last_loop_keyframe;  ///< newest keyframe that closed a loop
  double query_p50_ms = 0;  ///< time in which the places are named that a keyframe may show
  double query_p95_ms = 0;
  double check_p50_ms = 0;  ///< keyframe received to answer published
  double check_p95_ms = 0;
  std::optional<uint64_t> vocabulary_checksum;
};

}  // namespace dmslam
