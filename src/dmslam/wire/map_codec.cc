#include <algorithm>
#include <memory>
#include <unordered_map>
#include <utility>

#include "dmslam/map_record_t.hpp"
#include "dmslam/wire/codec_impl.h"

namespace dmslam::wire {

template <>
struct EnumRange<MapEvent> {
  static constexpr auto kFirst = MapEvent::kKeyframeInserted, kLast = MapEvent::kTurn;
  static constexpr const char* kName = "unknown event of the map";
};

namespace {

/// What a delta holds in lists of lists, or says again and again, in the form in which it travels.
struct Flat {
  struct KeyframeLists {
    int32_t num_loop_edges = 0;
    int32_t num_features = -1;  ///< -1: its features do not travel
    int32_t num_depths = 0;
    int32_t num_sigmas = 0;
  };
  struct LandmarkKeyframes {  ///< indices into landmark_keyframes
    int32_t reference = 0;
    int32_t first_keyframe = 0;
  };
  struct Run {
    KeyframeId keyframe;
    int32_t length = 0;
  };
  std::vector<KeyframeLists> keyframes;        ///< parallel to the delta's keyframes
  std::vector<KeyframeId> loop_edges;          ///< keyframe by keyframe
  FeatureSet features;                         ///< keyframe by keyframe
  std::vector<KeyframeId> landmark_keyframes;  ///< each once, in the order in which landmarks name them
  std::vector<LandmarkKeyframes> landmarks;    ///< parallel to the delta's landmarks
  std::vector<Run> runs;                       ///< of observations by the same keyframe
};

void Append(auto& all, const auto& more) { all.insert(all.end(), more.begin(), more.end()); }

Flat Flatten(const MapDelta& m) {
  Flat flat;
  for (const KeyframeState& keyframe : m.keyframes) {
    Flat::KeyframeLists& lists = flat.keyframes.emplace_back();
    lists.num_loop_edges = static_cast<int32_t>(keyframe.loop_edges.size());
    Append(flat.loop_edges, keyframe.loop_edges);
    if (keyframe.features == nullptr) continue;
    const FeatureSet& features = *keyframe.features;
    lists.num_features = static_cast<int32_t>(features.size());
    lists.num_depths = static_cast<int32_t>(features.depths_m.size());
    lists.num_sigmas = static_cast<int32_t>(features.sigmas_px.size());
    Append(flat.features.keypoints, features.keypoints);
    Append(flat.features.descriptors, features.descriptors);
    Append(flat.features.depths_m, features.depths_m);
    Append(flat.features.depth_sigmas_m, features.depth_sigmas_m);
    Append(flat.features.sigmas_px, features.sigmas_px);
  }
  std::unordered_map<KeyframeId, int32_t> index_of;
  const auto index = [&](KeyframeId id) {
    const auto [at, is_new] = index_of.emplace(id, static_cast<int32_t>(flat.landmark_keyframes.size()));
    if (is_new) flat.landmark_keyframes.push_back(id);
    return at->second;
  };
  for (const LandmarkState& landmark : m.landmarks) {
    const int32_t reference = index(landmark.reference);
    flat.landmarks.push_back({reference, index(landmark.first_keyframe)});
  }
  for (const ObservationState& observation : m.observations) {
    if (flat.runs.empty() || flat.runs.back().keyframe != observation.keyframe) {
      flat.runs.push_back({observation.keyframe, 0});
    }
    ++flat.runs.back().length;
  }
  return flat;
}

/// Cuts the next `count` items off `all`; false when there are not so many left.
template <typename Items>
bool TakeNext(const Items& all, size_t& at, int32_t count, Items& items) {
  if (count < 0 || static_cast<size_t>(count) > all.size() - at) return false;
  const auto begin = all.begin() + static_cast<ptrdiff_t>(at);
  items.assign(begin, begin + count);
  at += static_cast<size_t>(count);
  return true;
}

void UnflattenKeyframes(const Flat& flat, MapDelta& m, Checker& check) {
  size_t edge = 0, keypoint = 0, descriptor = 0, depth = 0, depth_sigma = 0, sigma = 0;
  bool sound = flat.keyframes.size() == m.keyframes.size();
  for (size_t i = 0; sound && i < m.keyframes.size(); ++i) {
    const Flat::KeyframeLists& lists = flat.keyframes[i];
    KeyframeState& keyframe = m.keyframes[i];
    const bool has_features = lists.num_features != -1;
    const int32_t num_features = has_features ? lists.num_features : 0;
    FeatureSet features;
    sound = TakeNext(flat.loop_edges, edge, lists.num_loop_edges, keyframe.loop_edges) &&
            TakeNext(flat.features.keypoints, keypoint, num_features, features.keypoints) &&
            TakeNext(flat.features.descriptors, descriptor, num_features, features.descriptors) &&
            TakeNext(flat.features.depths_m, depth, lists.num_depths, features.depths_m) &&
            TakeNext(flat.features.depth_sigmas_m, depth_sigma, lists.num_depths, features.depth_sigmas_m) &&
            TakeNext(flat.features.sigmas_px, sigma, lists.num_sigmas, features.sigmas_px);
    sound = sound && (has_features || (lists.num_depths == 0 && lists.num_sigmas == 0));
    if (has_features) keyframe.features = std::make_shared<const FeatureSet>(std::move(features));
  }
  check.Require(sound && edge == flat.loop_edges.size() && keypoint == flat.features.size() &&
                    depth == flat.features.depths_m.size() && sigma == flat.features.sigmas_px.size(),
                "keyframes' features or loop edges are not as many as counted");
}

void UnflattenLandmarks(const Flat& flat, MapDelta& m, Checker& check) {
  const size_t num_keyframes = flat.landmark_keyframes.size();
  const auto known = [&](int32_t index) {
    return std::cmp_greater_equal(index, 0) && std::cmp_less(index, num_keyframes);
  };
  for (size_t i = 0; i < m.landmarks.size() && check.ok(); ++i) {
    const auto [reference, first_keyframe] = flat.landmarks[i];
    check.Require(known(reference) && known(first_keyframe),
                  "a landmark names a keyframe that is not in the list");
    if (!check.ok()) return;
    m.landmarks[i].reference = flat.landmark_keyframes[static_cast<size_t>(reference)];
    m.landmarks[i].first_keyframe = flat.landmark_keyframes[static_cast<size_t>(first_keyframe)];
  }
}

void UnflattenObservations(const Flat& flat, MapDelta& m, Checker& check) {
  size_t at = 0;
  for (const Flat::Run& run : flat.runs) {
    const bool sound = run.length > 0 && static_cast<size_t>(run.length) <= m.observations.size() - at;
    check.Require(sound, "runs of observations are not as many as counted");
    if (!sound) return;
    for (int32_t i = 0; i < run.length; ++i) m.observations[at++].keyframe = run.keyframe;
  }
  check.Require(at == m.observations.size(), "runs of observations are not as many as counted");
}

// One part of the message after the other; `s` is a Put or a Get.

template <int kIndex, auto kPose>
struct RotationPart {
  auto& operator()(auto& item) const { return (item.*kPose).rotation.coeffs()[kIndex]; }
};
template <int kIndex, auto kPose>
struct TranslationPart {
  auto& operator()(auto& item) const { return (item.*kPose).translation[kIndex]; }
};
template <auto kPose>
void PoseColumns(auto& s, auto& items, auto& qx, auto& qy, auto& qz, auto& qw, auto& tx, auto& ty, auto& tz) {
  s.Column(items, qx, RotationPart<0, kPose>());
  s.Column(items, qy, RotationPart<1, kPose>());
  s.Column(items, qz, RotationPart<2, kPose>());
  s.Column(items, qw, RotationPart<3, kPose>());
  s.Column(items, tx, TranslationPart<0, kPose>());
  s.Column(items, ty, TranslationPart<1, kPose>());
  s.Column(items, tz, TranslationPart<2, kPose>());
}

void KeyframeColumns(auto& s, auto& m, auto& flat, auto& w) {
  using State = KeyframeState;
  s.Count(m.keyframes, w.num_keyframes);
  s.Count(flat.keyframes, w.num_keyframes);
  s.Column(m.keyframes, w.kf_id, &State::id);
  s.Column(m.keyframes, w.kf_map_id, &State::map_id);
  s.Column(m.keyframes, w.kf_camera_id, &State::camera_id);
  s.Column(m.keyframes, w.kf_stamp_ns, &State::stamp_ns);
  PoseColumns<&State::T_cam_world>(s, m.keyframes, w.kf_qx, w.kf_qy, w.kf_qz, w.kf_qw, w.kf_tx, w.kf_ty,
                                   w.kf_tz);
  s.Column(m.keyframes, w.kf_scale, &State::scale);
  s.Column(m.keyframes, w.kf_parent, &State::parent);
  s.Column(flat.keyframes, w.kf_num_loop_edges, &Flat::KeyframeLists::num_loop_edges);
  s.Column(flat.keyframes, w.kf_num_features, &Flat::KeyframeLists::num_features);
  s.Column(flat.keyframes, w.kf_num_depths, &Flat::KeyframeLists::num_depths);
  s.Column(flat.keyframes, w.kf_num_sigmas, &Flat::KeyframeLists::num_sigmas);
  s.Count(flat.loop_edges, w.num_loop_edges);
  s.Column(flat.loop_edges, w.loop_edge, std::identity());
  s.Count(flat.features.keypoints, w.num_features);
  s.Count(flat.features.descriptors, w.num_features);
  s.Column(flat.features.keypoints, w.x_q4, &Keypoint::x_q4);
  s.Column(flat.features.keypoints, w.y_q4, &Keypoint::y_q4);
  s.Column(flat.features.keypoints, w.octave, &Keypoint::octave);
  s.Column(flat.features.keypoints, w.angle, &Keypoint::angle);
  s.Descriptors(flat.features.descriptors, w.num_descriptor_bytes, w.descriptors, std::identity());
  s.Count(flat.features.depths_m, w.num_depths);
  s.Count(flat.features.depth_sigmas_m, w.num_depths);
  s.Column(flat.features.depths_m, w.depth_m, std::identity());
  s.Column(flat.features.depth_sigmas_m, w.depth_sigma_m, std::identity());
  s.Count(flat.features.sigmas_px, w.num_sigmas);
  s.Column(flat.features.sigmas_px, w.sigma_px, std::identity());
}

void PoseChangeColumns(auto& s, auto& m, auto& w) {
  using Pose = KeyframePose;
  s.Count(m.keyframe_poses, w.num_poses);
  s.Column(m.keyframe_poses, w.pose_kf_id, &Pose::id);
  PoseColumns<&Pose::T_cam_world>(s, m.keyframe_poses, w.pose_qx, w.pose_qy, w.pose_qz, w.pose_qw, w.pose_tx,
                                  w.pose_ty, w.pose_tz);
  s.Column(m.keyframe_poses, w.pose_scale, &Pose::scale);
}

void ReferenceMoveColumns(auto& s, auto& m, auto& w) {
  using Move = ReferenceMove;
  auto& moves = m.reference_moves;
  s.Count(moves, w.num_moves);
  s.Column(moves, w.move_reference, &Move::reference);
  PoseColumns<&Move::after_from_before>(s, moves, w.move_qx, w.move_qy, w.move_qz, w.move_qw, w.move_tx,
                                        w.move_ty, w.move_tz);
  s.Column(
      moves, w.move_scale, [](auto& item) -> auto& { return item.after_from_before.scale; });
}

void LandmarkColumns(auto& s, auto& m, auto& flat, auto& w) {
  using State = LandmarkState;
  s.Count(flat.landmark_keyframes, w.num_landmark_keyframes);
  s.Column(flat.landmark_keyframes, w.landmark_keyframe, std::identity());
  s.Count(m.landmarks, w.num_landmarks);
  s.Count(flat.landmarks, w.num_landmarks);
  s.Column(m.landmarks, w.lm_id, &State::id);
  s.Column(m.landmarks, w.lm_map_id, &State::map_id);
  s.Column(m.landmarks, w.lm_x, Coordinate<0, &State::p_world>());
  s.Column(m.landmarks, w.lm_y, Coordinate<1, &State::p_world>());
  s.Column(m.landmarks, w.lm_z, Coordinate<2, &State::p_world>());
  s.Column(flat.landmarks, w.lm_reference, &Flat::LandmarkKeyframes::reference);
  s.Column(flat.landmarks, w.lm_first_keyframe, &Flat::LandmarkKeyframes::first_keyframe);
  s.Column(m.landmarks, w.lm_first_ns, &State::first_ns);
  s.Column(
      m.landmarks, w.lm_visible, [](auto& item) -> auto& { return item.evidence.visible; });
  s.Column(
      m.landmarks, w.lm_found, [](auto& item) -> auto& { return item.evidence.found; });
  s.Column(
      m.landmarks, w.lm_moved, [](auto& item) -> auto& { return item.evidence.moved; });
  s.Column(
      m.landmarks, w.lm_motion_belief, [](auto& item) -> auto& { return item.evidence.motion_belief; });
  s.StampColumn(
      m.landmarks, w.lm_last_moved_ns, [](auto& item) -> auto& { return item.evidence.last_moved_ns; });
  s.Descriptors(m.landmarks, w.num_landmark_descriptor_bytes, w.lm_descriptors, &State::descriptor);
}

void LandmarkChangeColumns(auto& s, auto& m, auto& w) {
  using Position = LandmarkPosition;
  s.Count(m.landmark_positions, w.num_positions);
  s.Column(m.landmark_positions, w.position_id, &Position::id);
  s.Column(m.landmark_positions, w.position_x, Coordinate<0, &Position::p_world>());
  s.Column(m.landmark_positions, w.position_y, Coordinate<1, &Position::p_world>());
  s.Column(m.landmark_positions, w.position_z, Coordinate<2, &Position::p_world>());
  auto& evidence = m.landmark_evidence;
  s.Count(evidence, w.num_evidence);
  s.Column(evidence, w.evidence_id, &LandmarkEvidenceState::id);
  s.Column(
      evidence, w.evidence_visible, [](auto& item) -> auto& { return item.evidence.visible; });
  s.Column(
      evidence, w.evidence_found, [](auto& item) -> auto& { return item.evidence.found; });
  s.Column(
      evidence, w.evidence_moved, [](auto& item) -> auto& { return item.evidence.moved; });
  s.Column(
      evidence, w.evidence_motion_belief, [](auto& item) -> auto& { return item.evidence.motion_belief; });
  s.StampColumn(
      evidence, w.evidence_last_moved_ns, [](auto& item) -> auto& { return item.evidence.last_moved_ns; });
}

void ObservationColumns(auto& s, auto& m, auto& flat, auto& w) {
  s.Count(flat.runs, w.num_runs);
  s.Column(flat.runs, w.run_keyframe, &Flat::Run::keyframe);
  s.Column(flat.runs, w.run_length, &Flat::Run::length);
  s.Count(m.observations, w.num_observations);
  s.Column(m.observations, w.observation_feature, &ObservationState::feature);
  s.Column(m.observations, w.observation_landmark, &ObservationState::landmark);
}

/// Positions of landmarks are told in the world. The other frame is reserved: read before it is written, they
/// would be points at wrong places.
template <typename Copy>
void LandmarkFrame(Copy& s, auto& w) {
  if constexpr (Copy::kToWire) w.landmark_frame = map_record_t::FRAME_WORLD;
  s.check().Require(w.landmark_frame == map_record_t::FRAME_WORLD,
                    "landmarks told in another frame than the world's, which this version does not read");
}

void TombstoneColumns(auto& s, auto& m, auto& w) {
  using Dead = KeyframeTombstone;
  auto& dead = m.keyframe_tombstones;
  s.Count(dead, w.num_dead_keyframes);
  s.Column(dead, w.dead_kf_id, &Dead::id);
  s.Column(dead, w.dead_kf_parent, &Dead::parent);
  s.Column(dead, w.dead_kf_stamp_ns, &Dead::stamp_ns);
  PoseColumns<&Dead::T_kf_parent>(s, dead, w.dead_kf_qx, w.dead_kf_qy, w.dead_kf_qz, w.dead_kf_qw,
                                  w.dead_kf_tx, w.dead_kf_ty, w.dead_kf_tz);
  s.Column(dead, w.dead_kf_parent_scale, &Dead::parent_scale);
  s.Count(m.landmark_tombstones, w.num_dead_landmarks);
  s.Column(m.landmark_tombstones, w.dead_lm_id, &LandmarkTombstone::id);
  s.Column(m.landmark_tombstones, w.dead_lm_replaced_by, &LandmarkTombstone::replaced_by);
  s.Count(m.dropped_maps, w.num_dropped_maps);
  s.Column(m.dropped_maps, w.dropped_map, std::identity());
}

void ValidateEvidence(const LandmarkEvidence& evidence, Checker& check) {
  check.Finite(static_cast<double>(evidence.motion_belief), "a motion belief is not finite");
  check.Stamp(evidence.last_moved_ns);
}

void ValidateKeyframes(const MapDelta& m, Checker& check) {
  if (!check.ok()) return;
  for (const KeyframeState& keyframe : m.keyframes) {
    check.Id(keyframe.id, "impossible id of a keyframe");
    check.OptionalId(keyframe.parent, "impossible id of a parent");
    check.Require(keyframe.map_id >= 1, "a keyframe without a map");
    check.CameraNumber(keyframe.camera_id);
    check.Stamp(keyframe.stamp_ns);
    check.Pose(keyframe.T_cam_world, "a keyframe without a pose");
    check.Scale(keyframe.scale, "scale of a keyframe out of range");
    if (keyframe.features != nullptr) check.Features(*keyframe.features);
    for (const KeyframeId id : keyframe.loop_edges) check.Id(id, "a loop edge to an impossible keyframe");
    check.Require(std::is_sorted(keyframe.loop_edges.begin(), keyframe.loop_edges.end()),
                  "loop edges are not ascending");
    check.Of(keyframe.id);
  }
  for (const KeyframePose& pose : m.keyframe_poses) {
    check.Id(pose.id, "a pose of an impossible keyframe");
    check.Pose(pose.T_cam_world, "a changed pose that is none");
    check.Scale(pose.scale, "scale of a keyframe out of range");
    check.Of(pose.id);
  }
  for (const KeyframeTombstone& dead : m.keyframe_tombstones) {
    check.Id(dead.id, "impossible id of a culled keyframe");
    check.OptionalId(dead.parent, "impossible parent of a culled keyframe");
    check.Require(dead.parent != dead.id, "a culled keyframe that is its own parent");
    check.Stamp(dead.stamp_ns);
    check.Pose(dead.T_kf_parent, "a culled keyframe without a place");
    check.Scale(dead.parent_scale, "scale of a culled keyframe's parent out of range");
    check.Of(dead.id);
  }
}

void ValidateLandmarks(const MapDelta& m, Checker& check) {
  if (!check.ok()) return;
  for (const ReferenceMove& move : m.reference_moves) {
    check.OptionalId(move.reference, "landmarks move with an impossible keyframe");
    check.UnitQuaternion(move.after_from_before.rotation, "landmarks move without a rotation");
    check.Position(move.after_from_before.translation, "landmarks move without a translation");
    check.Scale(move.after_from_before.scale, "scale of a move of landmarks out of range");
  }
  for (const LandmarkState& landmark : m.landmarks) {
    check.Id(landmark.id, "impossible id of a landmark");
    check.Require(landmark.map_id >= 1, "a landmark without a map");
    check.Position(landmark.p_world, "position of a landmark is not finite");
    check.OptionalId(landmark.reference, "impossible reference keyframe of a landmark");
    check.OptionalId(landmark.first_keyframe, "impossible first keyframe of a landmark");
    check.Stamp(landmark.first_ns);
    ValidateEvidence(landmark.evidence, check);
    check.Of(landmark.id);
  }
  for (const LandmarkPosition& position : m.landmark_positions) {
    check.Id(position.id, "a position of an impossible landmark");
    check.Position(position.p_world, "position of a landmark is not finite");
    check.Of(position.id);
  }
  for (const LandmarkEvidenceState& state : m.landmark_evidence) {
    check.Id(state.id, "evidence on an impossible landmark");
    ValidateEvidence(state.evidence, check);
    check.Of(state.id);
  }
  for (const ObservationState& observation : m.observations) {
    check.Id(observation.keyframe, "an observation by an impossible keyframe");
    check.OptionalId(observation.landmark, "an observation of an impossible landmark");
    check.Of(observation.keyframe);
  }
  for (const LandmarkTombstone& dead : m.landmark_tombstones) {
    check.Id(dead.id, "impossible id of a dead landmark");
    check.OptionalId(dead.replaced_by, "a landmark fused into an impossible one");
    check.Require(dead.replaced_by != dead.id, "a landmark fused into itself");
    check.Of(dead.id);
  }
}

/// What a record is about follows from its event alone: nobody has to guess.
void ValidateEvent(const MapDelta& m, Checker& check) {
  const EventNeeds needs = NeededBy(m.event);
  check.Require(!needs.about || m.about, "an event of a keyframe that names none");
  check.Require(!needs.map_id || m.map_id, "an event of a map that names none");
  check.Require(!needs.correction_id || m.correction_id, "an answer to a correction that names none");
  check.Require(m.request.has_value() == needs.request,
                "an answer to a request that names none, or a request without its answer");
}

constexpr int kSeqBits = 56;
constexpr int64_t kSeqEnd = int64_t{1} << kSeqBits;

/// With the camera whose frontend it is in the highest byte: of a single one it is the number alone.
template <typename Copy, typename Progress>
void FrontendSeq(Copy&, Progress& progress, int64_t& wire) {
  if constexpr (Copy::kToWire) {
    wire = (static_cast<int64_t>(progress.camera) << kSeqBits) | progress.frontend.seq;
  } else {
    progress.camera = static_cast<CameraId>(static_cast<uint64_t>(wire) >> kSeqBits);
    progress.frontend.seq = wire & (kSeqEnd - 1);
  }
}

/// Observations by keyframes that come with their features must name one of them.
void ValidateObservedFeatures(const MapDelta& m, Checker& check) {
  if (!check.ok()) return;
  std::unordered_map<KeyframeId, size_t> num_features;
  for (const KeyframeState& keyframe : m.keyframes) {
    if (keyframe.features != nullptr) num_features[keyframe.id] = keyframe.features->size();
  }
  if (num_features.empty()) return;
  for (const ObservationState& observation : m.observations) {
    const auto found = num_features.find(observation.keyframe);
    check.Require(found == num_features.end() || observation.feature < found->second,
                  "an observation names a feature that is not there");
    check.Of(observation.keyframe);
  }
}

}  // namespace

template <>
struct Codec<MapDelta> {
  using Wire = map_record_t;
  static constexpr const char* kChannel = channels::kMap;

  template <typename Copy>
  static void Fields(Copy& s, auto& m, auto& w) {
    s.Utime(m.stamp_ns, w.utime);
    s(m.event, w.event);
    s(m.map_id, w.map_id);
    s(m.about, w.about);
    s(m.request, w.request);
    s.OrMinusOne(m.stamp_ns, w.stamp_ns);
    GroupFields(s, m.group, w);
    LandmarkFrame(s, w);
    s(m.version, w.version);
    s(m.correction_id, w.correction_id);
    s(m.progress.frontend.epoch, w.frontend_epoch);
    FrontendSeq(s, m.progress, w.frontend_seq);
    s(m.progress.loopcloser.epoch, w.loopcloser_epoch);
    s(m.progress.loopcloser.seq, w.loopcloser_seq);
    s(m.progress.settled, w.settled);
    s(m.progress.corrected, w.corrected);
    s(m.progress.ended, w.ended);
    Flat flat;
    if constexpr (Copy::kToWire) flat = Flatten(m);
    KeyframeColumns(s, m, flat, w);
    PoseChangeColumns(s, m, w);
    ReferenceMoveColumns(s, m, w);
    LandmarkColumns(s, m, flat, w);
    LandmarkChangeColumns(s, m, w);
    ObservationColumns(s, m, flat, w);
    TombstoneColumns(s, m, w);
    s(m.note, w.note);
    if constexpr (!Copy::kToWire) {
      UnflattenKeyframes(flat, m, s.check());
      UnflattenLandmarks(flat, m, s.check());
      UnflattenObservations(flat, m, s.check());
    }
  }
  static void Validate(const MapDelta& m, Checker& check) {
    check.OptionalId(m.about, "impossible id of the keyframe it is about");
    check.Require(m.progress.camera < kMaxCameras, "number of the camera out of range");
    check.Require(m.progress.frontend.seq >= 0 && m.progress.frontend.seq < kSeqEnd,
                  "impossible place in a stream");
    check.OptionalId(m.progress.settled, "impossible id of the keyframe settled last");
    check.Stamp(m.stamp_ns);
    check.Group(m.group);
    ValidateEvent(m, check);
    ValidateKeyframes(m, check);
    ValidateLandmarks(m, check);
    ValidateObservedFeatures(m, check);
  }
};

DMSLAM_WIRE_MESSAGE(MapDelta);

}  // namespace dmslam::wire
