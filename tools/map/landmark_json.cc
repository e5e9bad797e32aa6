#include "landmark_json.h"

#include <nlohmann/json.hpp>

#include "dmslam/dynamics/proven.h"
#include "dmslam/util/output_file.h"
#include "dmslam/util/time.h"
#include "text.h"

namespace dmslam {
namespace {

using Json = nlohmann::ordered_json;

Json ToJson(KeyframeId id) {
  return {{"session", id.session()}, {"camera", id.camera()}, {"frame", id.frame_index()}};
}

/// Text, as no double holds it exactly.
Json StampJson(std::optional<int64_t> stamp_ns) {
  return stamp_ns ? Json(FormatStampNs(*stamp_ns)) : Json(nullptr);
}

Json ToJson(const MapMoment& when) {
  return {{"version", when.version},
          {"event", NameOf(when.event)},
          {"about", when.about ? ToJson(*when.about) : Json(nullptr)},
          {"stamp", StampJson(when.stamp_ns)}};
}

Json ToJson(const LandmarkSight& sight) {
  Json json = ToJson(sight.keyframe);
  json["stamp"] = StampJson(sight.stamp_ns);
  json["feature"] = sight.feature;
  json["x_px"] = sight.keypoint.x_px();
  json["y_px"] = sight.keypoint.y_px();
  json["level"] = sight.keypoint.octave;
  json["error_px"] = sight.error_px ? Json(*sight.error_px) : Json(nullptr);
  return json;
}

Json ToJson(const std::vector<LandmarkSight>& sights) {
  Json json = Json::array();
  for (const LandmarkSight& sight : sights) json.push_back(ToJson(sight));
  return json;
}

Json ToJson(const LandmarkEvidence& evidence) {
  return {{"visible", evidence.visible},
          {"found", evidence.found},
          {"moved", evidence.moved},
          {"motion_belief", evidence.motion_belief},
          {"last_moved", StampJson(evidence.last_moved_ns)}};
}

Json MadeJson(const LandmarkHistory& history) {
  Json json = {{"decision", NameOf(history.origin)}, {"when", ToJson(history.made)}};
  json["from"] = ToJson(history.made_from);
  json["widest_angle_rad"] = history.widest ? Json(history.widest->rad) : Json(nullptr);
  json["widest_angle_with"] = history.widest ? ToJson(history.widest->keyframe) : Json(nullptr);
  return json;
}

Json EndJson(const LandmarkHistory& history) {
  if (!history.end) return nullptr;
  const LandmarkEnd& end = *history.end;
  return {{"decision", NameOf(end.fate)},
          {"when", ToJson(end.when)},
          {"into", end.into ? Json(NameOf(*end.into)) : Json(nullptr)},
          {"note", end.note}};
}

/// static, moving, or not in the map: fused or removed.
std::string StateOfNow(const LandmarkProofs& proofs, const LandmarkHistory& history) {
  const Landmark* landmark = proofs.map().FindLandmark(history.id);
  if (landmark != nullptr) return IsStatic(landmark) ? "static" : "moving";
  return history.end && history.end->into ? "fused" : "removed";
}

void AddState(const LandmarkProofs& proofs, const LandmarkState& state, Json* json) {
  const Landmark* landmark = proofs.map().FindLandmark(state.id);
  (*json)["proven"] = landmark != nullptr && IsProven(proofs.map(), *landmark, ProvenOptions());
  (*json)["map"] = state.map_id;
  (*json)["position"] = {state.p_world.x(), state.p_world.y(), state.p_world.z()};
  (*json)["reference"] = ToJson(state.reference);
  (*json)["first_keyframe"] = ToJson(state.first_keyframe);
  (*json)["first_stamp"] = StampJson(state.first_ns);
  (*json)["evidence"] = ToJson(state.evidence);
}

Json FormerJson(const LandmarkHistory& history) {
  Json json = Json::array();
  for (const FormerSight& former : history.former) {
    Json sight = ToJson(former.sight);
    sight["until"] = ToJson(former.until);
    sight["keyframe_culled"] = former.keyframe_culled;
    json.push_back(std::move(sight));
  }
  return json;
}

Json ToJson(const LandmarkProofs& proofs, const LandmarkHistory& history) {
  const LandmarkNow now = NowOf(proofs, history);
  const std::optional<uint32_t> session = proofs.SessionOf(history);
  Json json = {{"id", NameOf(history.id)},
               {"state", StateOfNow(proofs, history)},
               {"session", session ? Json(*session) : Json(nullptr)}};
  if (now.state) AddState(proofs, *now.state, &json);
  json["made"] = MadeJson(history);
  json["end"] = EndJson(history);
  json["took_in"] = Json::array();
  for (const LandmarkFusion& fusion : history.absorbed)
    json["took_in"].push_back({{"id", NameOf(fusion.absorbed)}, {"when", ToJson(fusion.when)}});
  json["seen_by"] = ToJson(now.seen);
  json["once_seen_by"] = FormerJson(history);
  json["evidence_steps"] = Json::array();
  for (const EvidenceStep& step : history.evidence)
    json["evidence_steps"].push_back({{"when", ToJson(step.when)}, {"evidence", ToJson(step.evidence)}});
  return json;
}

Json FileJson(const LandmarkProofs& proofs) {
  return {{"file", proofs.path},
          {"of_log", proofs.of_log},
          {"records", proofs.read.records},
          {"missing", proofs.read.missing}};
}

/// `run`: null where the file tells no more than its session.
Json RunJson(uint32_t session, const ProvenRun* run) {
  Json json = {{"session", session}, {"seed", nullptr}, {"configuration_hash", nullptr}};
  if (run == nullptr) return json;
  const SessionStart& start = run->start;
  json["seed"] = start.seed;
  json["configuration_hash"] = Hex(start.configuration_hash);
  json["settings_known"] = run->settings_known;
  json["modes"] = run->modes;
  json["profile"] = start.profile;
  json["version"] = start.software;
  json["vocabulary"] = start.vocabulary_checksum ? Json(Hex(*start.vocabulary_checksum)) : Json(nullptr);
  json["sequence"] = start.sequence;
  json["lockstep"] = start.mode == PlaybackMode::kLockstep;
  return json;
}

Json RunsJson(const LandmarkProofs& proofs) {
  Json json = Json::array();
  for (const uint32_t session : proofs.Sessions()) json.push_back(RunJson(session, proofs.RunOf(session)));
  return json;
}

/// Text from a file may be of any bytes.
std::string Dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace

void WriteProofJson(const std::string& path, const LandmarkProofs& proofs,
                    const std::vector<const LandmarkHistory*>& histories) {
  OutputFile file(path);
  Json run = FileJson(proofs);
  run.update(RunJson(proofs.session, proofs.RunOf(proofs.session)));
  file.Write("{\"run\": " + Dump(run) + ",\n\"runs\": " + Dump(RunsJson(proofs)) + ",\n\"landmarks\": [");
  const char* before = "\n";
  for (const LandmarkHistory* history : histories) {
    file.Write(before + Dump(ToJson(proofs, *history)));
    before = ",\n";
  }
  file.Write("\n]}\n");
  file.Commit();
}

}  // namespace dmslam
