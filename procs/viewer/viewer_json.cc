#include "viewer/viewer_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace dmslam {
namespace {

using Json = nlohmann::json;

double Round(double value, int digits) {
  const double factor = std::pow(10.0, digits);
  return std::round(value * factor) / factor;
}

Json ToJson(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Json ToJson(const Eigen::Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }

Json ToJson(const ProcessBoard::Process& process, int64_t now_ns) {
  const ProcessHealth& h = process.health;
  const bool heard = process.life != ProcessBoard::Life::kAwaited;
  const int64_t dropped = h.dropped_foreign + h.dropped_malformed + h.dropped_checksum + h.dropped_overflow;
  Json json{{"name", process.name},
            {"life", ProcessBoard::Word(process.life)},
            {"state", process.state},
            {"reason", process.reason},
            {"restarts", process.restarts}};
  json["age"] = heard ? Json(Round(static_cast<double>(now_ns - process.heard_ns) * 1e-9, 2)) : Json(nullptr);
  if (!process.tells) return json;
  json.update(Json{{"waiting_for", h.waiting_for},
                   {"pid", h.pid},
                   {"uptime", Round(h.uptime_s, 1)},
                   {"cpu", Round(h.cpu_percent, 1)},
                   {"rss", Round(h.rss_mb, 1)},
                   {"queue", h.queue_depth},
                   {"received", h.received},
                   {"written", h.written},
                   {"dropped", dropped},
                   {"lost", h.records_lost},
                   {"repaired", h.records_repaired},
                   {"resent", h.resent},
                   {"unacknowledged", h.unacknowledged},
                   {"snapshots", h.snapshots},
                   {"host", h.host}});
  return json;
}

Json EventsJson(const ProcessBoard& board) {
  constexpr size_t kMostListed = 40;
  static constexpr std::array<const char*, 3> kLevels = {"info", "good", "bad"};
  Json events = Json::array();
  const auto& all = board.events();
  for (size_t i = all.size() > kMostListed ? all.size() - kMostListed : 0; i < all.size(); ++i) {
    events.push_back({{"n", all[i].number},
                      {"at", all[i].wall_us / 1000},
                      {"level", kLevels[static_cast<size_t>(all[i].level)]},
                      {"text", all[i].text}});
  }
  return events;
}

Json TruthJson(const TruthAlignment* alignment) {
  if (alignment == nullptr) return nullptr;
  const Sim3d& sim3 = alignment->map_from_truth;
  return {{"rotation", ToJson(sim3.rotation)},
          {"translation", ToJson(sim3.translation)},
          {"scale", sim3.scale},
          {"rmse", Round(alignment->rmse_m, 5)},
          {"pairs", alignment->pairs}};
}

Json MapsJson(const StatusView& view) {
  Json maps = Json::array();
  if (view.layout == nullptr) return maps;
  for (const auto& [map_id, place] : view.layout->places()) {
    maps.push_back({{"id", map_id},
                    {"name", NameOf(map_id)},
                    {"colour", place.colour},
                    {"keyframes", place.keyframes},
                    {"offset", ToJson(place.offset)}});
  }
  return maps;
}

Json CamerasJson(const std::vector<CameraView>& views) {
  Json cameras = Json::array();
  for (const CameraView& view : views) {
    Json camera{
        {"id", cameras.size()}, {"map", view.map_id ? NameOf(*view.map_id) : ""}, {"ended", view.ended}};
    if (view.info != nullptr) {
      camera["sequence"] = view.info->sequence;
      camera["frames"] = view.info->num_frames.value_or(0);
      camera["first_frame"] = view.info->first_frame;
    }
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

Json SequenceJson(const CameraInfo& info) {
  const Camera& camera = info.camera;
  return {{"sequence", info.sequence},
          {"frames", info.num_frames.value_or(0)},
          {"first_frame", info.first_frame},
          {"lockstep", info.mode == PlaybackMode::kLockstep},
          {"camera",
           {{"width", camera.width_px},
            {"height", camera.height_px},
            {"fx", camera.fx_px},
            {"fy", camera.fy_px},
            {"cx", camera.cx_px},
            {"cy", camera.cy_px}}}};
}

Json MapJson(const StatusView& view) {
  return {{"id", view.map_id ? Json(*view.map_id) : Json()},
          {"version", view.map_version},
          {"keyframes", view.keyframes},
          {"landmarks", view.landmarks},
          {"moving", view.moving},
          {"resets", view.resets},
          {"loops", view.loops}};
}

Json FrontendJson(const FrontendStatus& status) {
  return {{"fps", status.fps},
          {"features", status.features},
          {"skipped", status.frames_skipped},
          {"processed", status.frames_processed},
          {"p50", Round(status.latency_p50_ms, 2)},
          {"p95", Round(status.latency_p95_ms, 2)},
          {"extract", Round(status.extract_ms, 2)},
          {"track", Round(status.track_ms, 2)},
          {"relocalisations", status.relocalisations}};
}

Json MapperJson(const MapperStatus& status) {
  return {{"landmarks_p50", Round(status.landmarks_p50_ms, 1)},
          {"adjusted_p50", Round(status.adjusted_p50_ms, 1)},
          {"adjustment", Round(status.adjustment_ms, 1)},
          {"culled", status.landmarks_culled},
          {"queue", status.keyframe_queue}};
}

}  // namespace

std::string NameOf(MapId map_id) {
  const std::string name = "map " + std::to_string(map_id % kMapsPerCamera);
  const MapId camera = map_id / kMapsPerCamera;
  return camera == 0 ? name : name + " of camera " + std::to_string(camera);
}

std::string Describe(const JoinedMaps& joined) {
  const auto [first, second] = std::minmax(joined.from, joined.into);
  if (second < kMapsPerCamera)
    return "maps " + std::to_string(first) + " and " + std::to_string(second) + " are joined";
  return NameOf(first) + " and " + NameOf(second) + " are joined";
}

std::string StateWord(PlayerStatus::State state) {
  switch (state) {
    case PlayerStatus::State::kStarting:
      return "starting";
    case PlayerStatus::State::kWaiting:
      return "waiting";
    case PlayerStatus::State::kPlaying:
      return "playing";
    case PlayerStatus::State::kDone:
      return "done";
  }
  return "";
}

std::string StateWord(TrackingState state) {
  switch (state) {
    case TrackingState::kNotInitialized:
      return "no map yet";
    case TrackingState::kWaitingForMap:
      return "waiting for map";
    case TrackingState::kTrial:
      return "trial";
    case TrackingState::kTracking:
      return "tracking";
    case TrackingState::kUncertain:
      return "uncertain";
    case TrackingState::kLost:
      return "lost";
    case TrackingState::kLocalizedLater:
      return "placed later";
    case TrackingState::kRotationOnly:
      return "rotation only";
    case TrackingState::kMissing:
      return "too few landmarks";
  }
  return "";
}

std::string StateWord(MapperStatus::State state) {
  switch (state) {
    case MapperStatus::State::kStarting:
      return "starting";
    case MapperStatus::State::kWaiting:
      return "waiting";
    case MapperStatus::State::kMapping:
      return "mapping";
    case MapperStatus::State::kDone:
      return "done";
  }
  return "";
}

std::string StateWord(LoopcloserStatus::State state) {
  switch (state) {
    case LoopcloserStatus::State::kStarting:
      return "starting";
    case LoopcloserStatus::State::kWaiting:
      return "waiting";
    case LoopcloserStatus::State::kWatching:
      return "watching";
    case LoopcloserStatus::State::kCorrecting:
      return "correcting";
    case LoopcloserStatus::State::kDone:
      return "done";
  }
  return "";
}

std::string ToJson(const StatusView& view) {
  Json json;
  json["now"] = view.wall_us / 1000;
  json["session"] = view.session;
  json["ended"] = view.ended;
  if (view.camera != nullptr) json.update(SequenceJson(*view.camera));
  json["map"] = MapJson(view);
  json["maps"] = MapsJson(view);
  json["cameras"] = CamerasJson(view.cameras);
  json["frontend"] = FrontendJson(*view.frontend);
  json["mapper"] = MapperJson(*view.mapper);
  json["viewer"] = {{"browsers", view.browsers}, {"skipped", view.skipped}};
  json["truth"] = TruthJson(view.alignment);
  json["up"] = ToJson(view.up);
  Json processes = Json::array();
  for (const auto& process : view.board->processes()) processes.push_back(ToJson(process, view.now_ns));
  json["processes"] = processes;
  json["events"] = EventsJson(*view.board);
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string PoseJson(const PoseView& view, const std::optional<Rigid3d>& drawn, uint32_t arrangement) {
  Json json{{"frame", view.frame_index},
            {"camera", view.camera_id},
            {"arrangement", arrangement},
            {"t", static_cast<double>(view.stamp_ns) * 1e-9},
            {"state", static_cast<int>(view.state)},
            {"word", StateWord(view.state)},
            {"map", view.map_id ? Json(*view.map_id) : Json()},
            {"inliers", view.inliers},
            {"moving", view.moving},
            {"unknown", view.unknown},
            {"share", Round(view.moving_share, 4)},
            {"latency", Round(view.latency_ms, 2)}};
  if (drawn) {
    json["p"] = ToJson(drawn->translation);
    json["q"] = ToJson(drawn->rotation);
  }
  return json.dump();
}

std::string FeaturesJson(const FeatureView& view, int width_px, int height_px) {
  std::vector<uint8_t> bytes;
  std::array<int, 4> counts{};
  for (const FeatureView::Item& item : view.items) {
    ++counts[static_cast<size_t>(item.kind)];
    if (item.kind == FeatureView::Kind::kUnmatched) continue;
    for (const uint16_t word : {item.u_q4, item.v_q4}) {
      bytes.push_back(static_cast<uint8_t>(word & 0xff));
      bytes.push_back(static_cast<uint8_t>(word >> 8));
    }
    bytes.push_back(static_cast<uint8_t>(item.kind));
  }
  return Json{{"frame", view.frame_index}, {"camera", view.camera_id}, {"width", width_px},
              {"height", height_px},       {"counts", counts},         {"data", Base64(bytes)}}
      .dump();
}

std::string Base64(const std::vector<uint8_t>& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t group = static_cast<uint32_t>(bytes[i]) << 16;
    if (i + 1 < bytes.size()) group |= static_cast<uint32_t>(bytes[i + 1]) << 8;
    if (i + 2 < bytes.size()) group |= bytes[i + 2];
    for (size_t digit = 0; digit < 4; ++digit) {
      text += digit > 1 && i + digit > bytes.size() ? '=' : kDigits[(group >> (18 - 6 * digit)) & 63];
    }
  }
  return text;
}

}  // namespace dmslam
