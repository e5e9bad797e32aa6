#include "dmslam/frontend_status_t.hpp"
#include "dmslam/loopcloser_status_t.hpp"
#include "dmslam/mapper_status_t.hpp"
#include "dmslam/player_status_t.hpp"
#include "dmslam/wire/enum_ranges.h"

namespace dmslam::wire {
namespace {

/// Copies like the Put or Get it wraps, but real numbers that are not finite: a status must never stop the
/// process that sends it, so Put writes -1 for them; Get refuses them.
template <typename Copy>
class FiniteOnly {
 public:
  static constexpr bool kToWire = Copy::kToWire;
  explicit FiniteOnly(Copy& copy) : copy_(copy) {}
  void operator()(auto& value, auto& wire) {
    copy_(value, wire);
    MakeFinite(wire);
  }
  void OrMinusOne(auto& value, auto& wire) {
    copy_.OrMinusOne(value, wire);
    MakeFinite(wire);
  }

 private:
  void MakeFinite(auto& wire) {
    if constexpr (std::is_floating_point_v<std::remove_cvref_t<decltype(wire)>>) {
      if constexpr (Copy::kToWire) {
        if (!std::isfinite(wire)) wire = -1;
      } else {
        copy_.check().Finite(wire, "a number of the status is not finite");
      }
    }
  }

  Copy& copy_;
};

void HealthFields(auto& s, auto& m, auto& w) {
  s(m.pid, w.pid);
  s(m.uptime_s, w.uptime_s);
  s(m.rss_mb, w.rss_mb);
  s(m.cpu_percent, w.cpu_percent);
  s(m.queue_depth, w.queue_depth);
  s(m.queue_peak, w.queue_peak);
  s(m.received, w.received);
  s(m.received_bytes, w.received_bytes);
  s(m.dropped_foreign, w.dropped_foreign);
  s(m.dropped_malformed, w.dropped_malformed);
  s(m.dropped_checksum, w.dropped_checksum);
  s(m.dropped_overflow, w.dropped_overflow);
  s(m.dropped_duplicate, w.dropped_duplicate);
  s(m.refused_peers, w.refused_peers);
  s(m.repairs_requested, w.repairs_requested);
  s(m.records_repaired, w.records_repaired);
  s(m.records_lost, w.records_lost);
  s(m.recovery_p50_ms, w.recovery_p50_ms);
  s(m.recovery_p99_ms, w.recovery_p99_ms);
  s(m.epoch, w.epoch);
  s(m.written, w.written);
  s(m.written_bytes, w.written_bytes);
  s(m.resent, w.resent);
  s(m.resent_bytes, w.resent_bytes);
  s(m.unacknowledged, w.unacknowledged);
  s(m.kept_bytes, w.kept_bytes);
  s(m.readers, w.readers);
  s(m.snapshots, w.snapshots);
  s(m.host, w.host);
  s(m.waiting_for, w.waiting_for);
}

void HeadFields(auto& s, auto& head, auto& w) {
  s(head.utime, w.utime);
  s(head.session, w.session);
  HealthFields(s, head.health, w.health);
  s(head.reason, w.reason);
}

}  // namespace

template <>
struct EnumRange<PlayerStatus::State> {
  static constexpr auto kFirst = PlayerStatus::State::kStarting, kLast = PlayerStatus::State::kDone;
  static constexpr const char* kName = "unknown state of the player";
};
template <>
struct EnumRange<MapperStatus::State> {
  static constexpr auto kFirst = MapperStatus::State::kStarting, kLast = MapperStatus::State::kDone;
  static constexpr const char* kName = "unknown state of the mapper";
};
template <>
struct EnumRange<LoopcloserStatus::State> {
  static constexpr auto kFirst = LoopcloserStatus::State::kStarting, kLast = LoopcloserStatus::State::kDone;
  static constexpr const char* kName = "unknown state of the loop closer";
};

template <>
struct Codec<PlayerStatus> {
  using Wire = player_status_t;
  static constexpr const char* kChannel = channels::kPlayerStatus;

  static void Fields(auto& copy, auto& m, auto& w) {
    FiniteOnly s(copy);
    HeadFields(s, m.head, w);
    s(m.state, w.state);
    s(m.frames_published, w.frames_published);
    s(m.frames_total, w.frames_total);
    s(m.frames_missing, w.frames_missing);
    s(m.repeats, w.repeats);
    s.OrMinusOne(m.frame_index, w.frame_index);
    s(m.fps, w.fps);
    s(m.late_ms, w.late_ms);
    s(m.camera_id, w.camera_id);
  }
  static void Validate(const PlayerStatus& m, Checker& check) {
    check.Session(m.head.session);
    check.CameraNumber(m.camera_id);
  }
};

template <>
struct Codec<FrontendStatus> {
  using Wire = frontend_status_t;
  static constexpr const char* kChannel = channels::kFrontendStatus;

  static void Fields(auto& copy, auto& m, auto& w) {
    FiniteOnly s(copy);
    HeadFields(s, m.head, w);
    s(m.state, w.state);
    s(m.fps, w.fps);
    s(m.frames_received, w.frames_received);
    s(m.frames_processed, w.frames_processed);
    s(m.frames_skipped, w.frames_skipped);
    s.OrMinusOne(m.frame_index, w.frame_index);
    s(m.features, w.features);
    s(m.inliers, w.inliers);
    s(m.moving, w.moving);
    s(m.unknown, w.unknown);
    s(m.moving_share, w.moving_share);
    s(m.latency_p50_ms, w.latency_p50_ms);
    s(m.latency_p95_ms, w.latency_p95_ms);
    s(m.latency_p99_ms, w.latency_p99_ms);
    s(m.decode_ms, w.decode_ms);
    s(m.extract_ms, w.extract_ms);
    s(m.track_ms, w.track_ms);
    s(m.step_ms, w.step_ms);
    s(m.step_p95_ms, w.step_p95_ms);
    s(m.map_id, w.map_id);
    s(m.map_version, w.map_version);
    s(m.map_keyframes, w.map_keyframes);
    s(m.map_landmarks, w.map_landmarks);
    s(m.keyframes_proposed, w.keyframes_proposed);
    s(m.keyframes_withheld, w.keyframes_withheld);
    s(m.keyframes_unacknowledged, w.keyframes_unacknowledged);
    s(m.resets, w.resets);
    s(m.relocalisations, w.relocalisations);
    s.OrMinusOne(m.first_map_s, w.first_map_s);
    s(m.camera_id, w.camera_id);
  }
  static void Validate(const FrontendStatus& m, Checker& check) { check.CameraNumber(m.camera_id); }
};

template <>
struct Codec<MapperStatus> {
  using Wire = mapper_status_t;
  static constexpr const char* kChannel = channels::kMapperStatus;

  static void Fields(auto& copy, auto& m, auto& w) {
    FiniteOnly s(copy);
    HeadFields(s, m.head, w);
    s(m.state, w.state);
    s(m.version, w.version);
    s(m.maps, w.maps);
    s(m.keyframes, w.keyframes);
    s(m.landmarks, w.landmarks);
    s(m.moving_landmarks, w.moving_landmarks);
    s(m.keyframe_queue, w.keyframe_queue);
    s(m.keyframes_unaccepted, w.keyframes_unaccepted);
    s(m.keyframes_inserted, w.keyframes_inserted);
    s(m.keyframes_culled, w.keyframes_culled);
    s(m.landmarks_created, w.landmarks_created);
    s(m.landmarks_culled, w.landmarks_culled);
    s(m.landmarks_fused, w.landmarks_fused);
    s(m.observations_dropped, w.observations_dropped);
    s(m.refused_neighbourhood, w.refused_neighbourhood);
    s(m.refused_motion, w.refused_motion);
    s(m.refused_geometry, w.refused_geometry);
    s(m.corrections_applied, w.corrections_applied);
    s(m.corrections_refused, w.corrections_refused);
    s(m.last_settled, w.last_settled);
    s(m.landmarks_p50_ms, w.landmarks_p50_ms);
    s(m.landmarks_p95_ms, w.landmarks_p95_ms);
    s(m.landmarks_p99_ms, w.landmarks_p99_ms);
    s(m.adjusted_p50_ms, w.adjusted_p50_ms);
    s(m.adjusted_p95_ms, w.adjusted_p95_ms);
    s(m.adjusted_p99_ms, w.adjusted_p99_ms);
    s(m.adjustment_ms, w.adjustment_ms);
  }
  static void Validate(const MapperStatus& m, Checker& check) {
    check.OptionalId(m.last_settled, "impossible id of a keyframe");
  }
};

template <>
struct Codec<LoopcloserStatus> {
  using Wire = loopcloser_status_t;
  static constexpr const char* kChannel = channels::kLoopcloserStatus;

  static void Fields(auto& copy, auto& m, auto& w) {
    FiniteOnly s(copy);
    HeadFields(s, m.head, w);
    s(m.state, w.state);
    s(m.replica_version, w.replica_version);
    s(m.indexed_keyframes, w.indexed_keyframes);
    s(m.keyframe_queue, w.keyframe_queue);
    s(m.keyframes_checked, w.keyframes_checked);
    s(m.candidates, w.candidates);
    s(m.refused_consistency, w.refused_consistency);
    s(m.refused_geometry, w.refused_geometry);
    s(m.loops_closed, w.loops_closed);
    s(m.global_adjustments, w.global_adjustments);
    s(m.last_keyframe, w.last_keyframe);
    s(m.last_loop_keyframe, w.last_loop_keyframe);
    s(m.query_p50_ms, w.query_p50_ms);
    s(m.query_p95_ms, w.query_p95_ms);
    s(m.check_p50_ms, w.check_p50_ms);
    s(m.check_p95_ms, w.check_p95_ms);
    s(m.vocabulary_checksum, w.vocabulary_checksum);
  }
  static void Validate(const LoopcloserStatus& m, Checker& check) {
    check.OptionalId(m.last_keyframe, "impossible id of a keyframe");
    check.OptionalId(m.last_loop_keyframe, "impossible id of a keyframe");
  }
};

DMSLAM_WIRE_MESSAGE(PlayerStatus);
DMSLAM_WIRE_MESSAGE(FrontendStatus);
DMSLAM_WIRE_MESSAGE(MapperStatus);
DMSLAM_WIRE_MESSAGE(LoopcloserStatus);

}  // namespace dmslam::wire
