#include "landmark_proof.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/map/map_states.h"
#include "dmslam/map/renumbering.h"
#include "dmslam/messaging/camera_channels.h"
#include "dmslam/settings/settings.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

/// The settings of a run as far as they can be known, and whether they are its own.
struct RunSettings {
  MapperOptions mapper;
  bool known = false;
  std::string modes;  ///< "map.saved=on, loop.enabled=off"
};

/// Its profile and seed are told; whether all else is as it is given here, its hash tells. What
/// scripts/run.sh sets by itself is tried.
RunSettings SettingsOf(const SessionStart& run, const ProofSource& source) {
  static constexpr std::array kModes = {"map.saved=on", "map.localize_only=on", "loop.enabled=off"};
  std::vector<std::string> given = source.overrides;
  given.push_back("seed=" + std::to_string(run.seed));
  if (!run.profile.empty()) given.push_back("profile=" + run.profile);
  for (unsigned chosen = 0; chosen < 1U << kModes.size(); ++chosen) {
    std::vector<std::string> overrides = given;
    std::string modes;
    for (size_t i = 0; i < kModes.size(); ++i) {
      if ((chosen >> i & 1U) == 0) continue;
      overrides.emplace_back(kModes[i]);
      modes += std::string(modes.empty() ? "" : ", ") + kModes[i];
    }
    const Settings settings = LoadSettings(source.config, overrides);
    if (settings.Hash() == run.configuration_hash) return {settings.Read<MapperOptions>(), true, modes};
  }
  return {LoadSettings(source.config, given).Read<MapperOptions>(), false, ""};
}

/// What the frames said that a change of the map works in; none: it is not in the log.
std::optional<FrameEvidence> EvidenceOf(const LogIndex& log, const RecordedSession& session,
                                        const MapDelta& delta) {
  if (delta.event != MapEvent::kEvidence) return std::nullopt;
  const MapProgress& progress = delta.progress;
  const RecordedStream& stream = session.Stream(StreamOfCamera(StreamId::kFrontend, progress.camera));
  for (const auto& [term, recorded] : stream) {
    const auto message = recorded.records.find(progress.frontend.seq);
    if (term.epoch == progress.frontend.epoch && message != recorded.records.end())
      return wire::Decode<FrameEvidence>(log.Read(message->second));
  }
  return std::nullopt;
}

/// Also of those whose landmarks are all gone.
std::map<uint16_t, uint32_t> SessionsByOrdinal(const LandmarkHistories& histories) {
  std::map<uint16_t, uint32_t> sessions = SessionsByOrdinal(histories.map());
  for (const auto& [id, history] : histories.landmarks()) {
    if (!history.end || !history.end->last) continue;
    uint32_t& session = sessions[id.epoch_ordinal()];
    session = std::max(session, history.end->last->first_keyframe.session());
  }
  return sessions;
}

template <typename Number>
bool ParseWhole(std::string_view text, Number* number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *number);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

LandmarkProofs ReadProofs(const ProofSource& source, std::optional<LandmarkId> watched,
                          const std::optional<BusKey>& key) {
  const LogIndex log(source.path, key);
  if (!log.DescribeDamage().empty()) LogWarning("{}", log.DescribeDamage());
  const RecordedSession& session = log.Session(source.session);
  const SessionStart run = MadeWith(log, session);
  LandmarkProofs proofs{source.path,
                        !session.IsSavedMap(),
                        run.session,
                        {},
                        {},
                        {},
                        LandmarkHistories(run.camera, run.pyramid, SettingsOf(run, source).mapper)};
  LandmarkHistories& histories = proofs.histories;
  if (watched) histories.Watch(*watched);
  ChangeReader reader;
  reader.begins_anew = [&] { histories.BeginAnew(); };
  reader.new_writer = [&] { histories.OnNewWriter(); };
  reader.change = [&](const MapDelta& delta) {
    const std::optional<FrameEvidence> said = EvidenceOf(log, session, delta);
    histories.Add(delta, said ? &*said : nullptr);
  };
  const int64_t until_us = source.at_s < 0 ? INT64_MAX : log.begin_us() + std::llround(source.at_s * 1e6);
  proofs.read = ForEachChange(log, session, until_us, reader);
  histories.Finish();
  for (const auto& [id, start] : RunsOf(session, run, proofs.map())) {
    const RunSettings settings = SettingsOf(start, source);
    proofs.runs.emplace(id, ProvenRun{start, settings.known, settings.modes});
  }
  proofs.sessions_by_ordinal = SessionsByOrdinal(histories);
  return proofs;
}

const ProvenRun* LandmarkProofs::RunOf(uint32_t session_of_run) const {
  const auto run = runs.find(session_of_run);
  return run == runs.end() ? nullptr : &run->second;
}

std::set<uint32_t> LandmarkProofs::Sessions() const {
  std::set<uint32_t> sessions = SessionsOf(map());
  for (const auto& [id, run] : runs) sessions.insert(id);
  return sessions;
}

std::optional<uint32_t> LandmarkProofs::SessionOf(const LandmarkHistory& history) const {
  if (history.origin != LandmarkOrigin::kNotTold) return session;  // by a record of this log
  const auto of_ordinal = sessions_by_ordinal.find(history.id.epoch_ordinal());
  if (of_ordinal != sessions_by_ordinal.end()) return of_ordinal->second;
  const std::set<uint32_t> all = Sessions();
  return all.size() == 1 ? std::optional(*all.begin()) : std::nullopt;
}

LandmarkNow NowOf(const LandmarkProofs& proofs, const LandmarkHistory& history) {
  if (const Landmark* landmark = proofs.map().FindLandmark(history.id))
    return {true, StateOf(*landmark), SightsOf(proofs.map(), *landmark)};
  if (!history.end) return {};
  return {false, history.end->last, history.end->seen};
}

std::optional<LandmarkId> ParseLandmarkId(const std::string& text) {
  LandmarkId id;
  const size_t colon = text.find(':');
  if (colon == std::string::npos) {
    if (!ParseWhole(text, &id.value)) return std::nullopt;
  } else {
    uint16_t ordinal = 0;
    uint64_t number = 0;
    const std::string_view view = text;
    if (!ParseWhole(view.substr(0, colon), &ordinal) || !ParseWhole(view.substr(colon + 1), &number))
      return std::nullopt;
    id = LandmarkId::Make(ordinal, number);
    if (id.number() != number) return std::nullopt;
  }
  return id.valid() ? std::optional(id) : std::nullopt;
}

std::string NameOf(LandmarkId id) {
  return std::to_string(id.epoch_ordinal()) + ":" + std::to_string(id.number());
}

std::string NameOf(MapEvent event) {
  static constexpr std::array kNames = {"?",
                                        "KEYFRAME_INSERTED",
                                        "LANDMARKS_CREATED",
                                        "FUSED",
                                        "ADJUSTED",
                                        "MAPPED",
                                        "EVIDENCE",
                                        "CORRECTED",
                                        "GLOBALLY_ADJUSTED",
                                        "MAP_STARTED",
                                        "MAP_DROPPED",
                                        "SETTLED",
                                        "SNAPSHOT",
                                        "REFUSED",
                                        "ENDED",
                                        "MAP_ADJUSTED",
                                        "REQUEST_DONE",
                                        "FIRST_MAP_REFUSED",
                                        "TURN"};
  static_assert(kNames.size() == static_cast<size_t>(MapEvent::kTurn) + 1);
  return kNames.at(static_cast<size_t>(event));
}

std::string NameOf(LandmarkOrigin origin) {
  static constexpr std::array kNames = {"not told", "first map", "triangulated", "other"};
  static_assert(kNames.size() == static_cast<size_t>(LandmarkOrigin::kOther) + 1);
  return kNames.at(static_cast<size_t>(origin));
}

std::string NameOf(LandmarkFate fate) {
  static constexpr std::array kNames = {"not told",     "fused",    "rarely found", "few observers",
                                        "seen through", "moved",    "unheld",       "keyframe culled",
                                        "too near",     "unproven", "map dropped",  "left out"};
  static_assert(kNames.size() == static_cast<size_t>(LandmarkFate::kLeftOut) + 1);
  return kNames.at(static_cast<size_t>(fate));
}

}  // namespace dmslam
