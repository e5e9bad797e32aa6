
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <tuple>

#include "collector/map_ply.h"
#include "dmslam/console/command_line.h"
#include "dmslam/console/log.h"
#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/codec.h"
#include "dmslam/messaging/keyed_bus.h"
#include "dmslam/messaging/protocol_messages.h"
#include "dmslam/recording/log_version.h"
#include "dmslam/recording/map_file.h"
#include "dmslam/runtime/exit_codes.h"
#include "dmslam/slam/trajectory_builder.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"
#include "dmslam/wire/codec.h"
#include "landmark_command.h"
#include "map_commands.h"
#include "purity.h"

namespace {

struct Arguments {
  std::string log, key, ply, trajectory, online, keyframes, save, masks, json;
  uint32_t session = 0;
  dmslam::CameraId camera = 0;
  double at_s = -1;
  bool channels = false;
};

/// list, merge, diff, split and landmark: what is done to whole files.
struct CommandArguments {
  std::string file, other, prefix, key;
  dmslam::MergeArguments merge;
  dmslam::LandmarkArguments landmark;
};

void Declare(dmslam::CommandLine& app, Arguments& a) {
  app.SetVersion(dmslam::BuildVersion());
  app.AddOption("--log,--map", a.log, "log of a run, or a saved map");
  app.AddOption("--log-session", a.session, "which of the log's sessions, where it holds several");
  app.AddOption(
      "--key", a.key,
      "file with the key under which the log was recorded: what others sent is left out; default: what "
      "DMSLAM_KEY_FILE names");
  app.AddOption("--at", a.at_s, "seconds after the log's beginning: the map as it was then").NonNegative();
  app.AddFlag("--channels", a.channels, "list what the log holds: channel, type, messages, bytes");
  app.AddOption("--ply", a.ply, "write the map as coloured points");
  app.AddOption("--camera-id", a.camera, "of several cameras: whose trajectory and keyframes are written")
      .InRange(0, static_cast<int>(dmslam::kMaxCameras) - 1)
      .ShowDefault();
  app.AddOption("--trajectory", a.trajectory, "write where the camera was, by the map (TUM format)");
  app.AddOption("--trajectory-online", a.online, "write where the camera was, as told frame by frame");
  app.AddOption("--keyframes", a.keyframes, "write the keyframes' poses (TUM format)");
  const dmslam::CommandLineOption masks = app.AddOption(
      "--masks", a.masks, "sequence's folder with masks: say how many landmarks are seen mostly on people");
  app.AddOption("--json", a.json, "also write that into this file").Needs(masks);
  app.AddOption("--save", a.save, "write the map as a file that the mapper can load (--map)");
}

using Command = std::function<int(const std::optional<dmslam::BusKey>& key)>;

dmslam::CommandLine& AddCommand(dmslam::CommandLine& app, const std::string& name,
                                const std::string& description, CommandArguments& a, Command& chosen,
                                const Command& command) {
  dmslam::CommandLine& line = app.AddSubcommand(name, description);
  line.AddOption("--key", a.key, "of logs: file with the key under which they were recorded");
  line.OnParsed([&chosen, command] { chosen = command; });
  return line;
}

void DeclareMerge(dmslam::CommandLine& app, CommandArguments& a, Command& chosen) {
  dmslam::MergeArguments& m = a.merge;
  dmslam::CommandLine& line =
      AddCommand(app, "merge", "Joins two maps that show the same place. 1: they do not; nothing is written",
                 a, chosen, [&m](const auto& key) { return dmslam::MergeMaps(m, key); });
  line.AddOption("A", m.a, "saved map or log of a run: what is joined lies where this one lies").Required();
  line.AddOption("B", m.b, "the other one").Required();
  line.AddOption("--save", m.save, "where the joined map is written").Required();
  line.AddFlag("--renumber", m.renumber,
               "sessions that both have get another number in B, instead of being refused");
  line.AddFlag("--apart", m.apart,
               "where they do not show the same place: write both, as two maps in one file");
  line.AddOption("--vocabulary", m.vocabulary, "bag-of-words vocabulary; default: the one that ships");
  line.AddOption("--config", m.config, "settings (YAML)");
  line.AddOption("--set", m.overrides, "one setting: key=value; may be repeated");
}

void DeclareLandmark(dmslam::CommandLine& app, CommandArguments& a, Command& chosen) {
  dmslam::LandmarkArguments& l = a.landmark;
  dmslam::CommandLine& line = AddCommand(
      app, "landmark",
      "Says of a landmark which keyframes see it, which decision made it or took it, and which run "
      "and seed that was",
      a, chosen, [&l](const auto& key) { return dmslam::TellLandmark(l, key); });
  line.AddOption("FILE", l.source.path,
                 "log of a run, which tells all; or a saved map, which tells what it is")
      .Required();
  line.AddOption("ID", l.id, "ORDINAL:NUMBER, such as 1:217, or the one number that messages carry");
  line.AddFlag("--all", l.all, "instead of ID: all landmarks, into --json");
  line.AddOption("--json", l.json, "write it into this file, for programs");
  line.AddOption("--at", l.source.at_s, "seconds after the log's beginning: as it was then").NonNegative();
  line.AddOption("--log-session", l.source.session, "which of the log's sessions, where it holds several");
  line.AddOption("--config", l.source.config, "the settings of the run (YAML), where it had some of its own");
  line.AddOption("--set", l.source.overrides, "one of them: key=value; may be repeated");
}

void DeclareCommands(dmslam::CommandLine& app, CommandArguments& a, Command& chosen) {
  AddCommand(app, "list", "Says which maps are in a file", a, chosen,
             [&a](const auto& key) { return dmslam::ListMaps(a.file, key); })
      .AddOption("FILE", a.file, "saved map or log of a run")
      .Required();
  DeclareMerge(app, a, chosen);
  DeclareLandmark(app, a, chosen);
  dmslam::CommandLine& diff =
      AddCommand(app, "diff", "Says what two maps have apart. 0: nothing, 1: something, 2: a file is no map",
                 a, chosen, [&a](const auto& key) { return dmslam::DiffMaps(a.file, a.other, key); });
  diff.AddOption("A", a.file, "saved map or log of a run").Required();
  diff.AddOption("B", a.other, "the other one").Required();
  dmslam::CommandLine& split =
      AddCommand(app, "split", "Writes each of several maps into a file of its own", a, chosen,
                 [&a](const auto& key) { return dmslam::SplitMaps(a.file, a.prefix, key); });
  split.AddOption("FILE", a.file, "saved map or log of a run").Required();
  split.AddOption("--save-prefix", a.prefix, "how the files begin: PREFIX1.map for map 1").Required();
}

/// Names of all types by their fingerprints.
std::map<int64_t, std::string> TypeNames() {
  std::map<int64_t, std::string> names = {
      {dmslam::head_t::getHash(), "head_t"},           {dmslam::ack_t::getHash(), "ack_t"},
      {dmslam::part_t::getHash(), "part_t"},           {dmslam::take_over_t::getHash(), "take_over_t"},
      {dmslam::hand_over_t::getHash(), "hand_over_t"}, {dmslam::replica_t::getHash(), "replica_t"},
      {dmslam::proof_t::getHash(), "proof_t"}};
  const auto add = [&]<typename... Message>(const std::tuple<Message...>*) {
    (names.emplace(dmslam::wire::Info<Message>().fingerprint, dmslam::wire::Info<Message>().type), ...);
  };
  add(static_cast<const dmslam::wire::Messages*>(nullptr));
  return names;
}

/// One line per channel. What is not ours has the type "?".
int ListChannels(const std::string& path, const std::optional<dmslam::BusKey>& key) {
  struct Content {
    std::string type;
    int64_t messages = 0, bytes = 0;
  };
  const std::map<int64_t, std::string> names = TypeNames();
  std::map<std::string, Content> contents;
  dmslam::EventLogReader reader(path);
  if (key) reader.UseKey(*key);
  while (const auto event = reader.Next()) {
    Content& content = contents[event->channel];
    const auto name = names.find(dmslam::FingerprintOf(event->bytes).value_or(0));
    content.type = name == names.end() ? "?" : name->second;
    if (const auto protocol = dmslam::OtherProtocol(*event)) content.type = dmslam::NameOfProtocol(*protocol);
    ++content.messages;
    content.bytes += static_cast<int64_t>(event->bytes.size());
  }
  for (const auto& [channel, content] : contents) {
    std::printf("%-36s %-20s %8lld messages %12lld bytes\n", channel.c_str(), content.type.c_str(),
                static_cast<long long>(content.messages), static_cast<long long>(content.bytes));
  }
  if (!reader.gaps().empty()) dmslam::LogWarning("{}", reader.DescribeGaps());
  return 0;
}

/// The poses of the frames, as the frontends of all cameras told them up to then. Returns how many of their
/// records are missing.
int64_t AddFramePoses(const dmslam::LogIndex& log, const dmslam::RecordedSession& session, int64_t until_us,
                      dmslam::TrajectoryBuilder* builder) {
  int64_t missing = 0;
  for (const dmslam::CameraId camera : session.CamerasWithFrontend()) {
    const dmslam::StreamId stream = dmslam::StreamOfCamera(dmslam::StreamId::kFrontend, camera);
    const dmslam::Replay replay = dmslam::PlanReplay(session.Stream(stream), until_us);
    missing += replay.missing;
    for (const dmslam::ReplayStep& step : replay.steps) {
      const std::string channel = dmslam::SplitCamera(step.message->channel).channel;
      if (channel == dmslam::channels::kFramePose) {
        if (const auto pose = dmslam::wire::Decode<dmslam::FramePose>(log.Read(*step.message)))
          builder->OnFramePose(*pose);
      } else if (channel == dmslam::channels::kMapReset) {
        if (const auto reset = dmslam::wire::Decode<dmslam::MapReset>(log.Read(*step.message)))
          builder->OnMapReset(*reset);
      }
    }
  }
  return missing;
}

void Print(const dmslam::LogIndex& log, const dmslam::RecordedSession& session,
           const dmslam::RebuiltMap& rebuilt, const dmslam::TrajectoryBuilder::Trajectories& trajectories,
           std::optional<dmslam::MapId> map_id) {
  const double seconds = static_cast<double>(log.end_us() - log.begin_us()) * 1e-6;
  std::printf("log         %lld messages, %.1f s, session %u, sequence %s\n",
              static_cast<long long>(log.num_messages()), seconds, session.id,
              rebuilt.session.sequence.c_str());
  const std::string number = map_id ? "number " + std::to_string(*map_id) : "none";
  std::printf("map         %s, version %llu, %zu keyframes, %zu landmarks%s\n", number.c_str(),
              static_cast<unsigned long long>(rebuilt.map.version()), rebuilt.map.keyframes().size(),
              rebuilt.map.num_landmarks(),
              rebuilt.ended          ? ", complete"
              : session.IsSavedMap() ? ""
                                     : ", of a run that had not ended");
  std::printf("records     %lld applied, %lld missing\n", static_cast<long long>(rebuilt.records),
              static_cast<long long>(rebuilt.missing));
  std::printf("trajectory  %zu frames\n", trajectories.final.size());
}

/// Says how many landmarks lie on people, by the masks of the keyframes' images.
void Judge(const Arguments& a, const dmslam::Map& map, std::optional<dmslam::MapId> map_id) {
  if (!map_id) throw dmslam::InputError(a.log + ": holds no map to judge; was a camera tracked?");
  const dmslam::MapPurity purity = dmslam::JudgeMap(map, *map_id, dmslam::MasksIn(a.masks));
  if (purity.landmarks == 0)
    throw dmslam::InputError(a.masks + ": no mask belongs to a keyframe of " + a.log +
                             "; is it this sequence?");
  std::printf("on people   %zu of %zu landmarks (%.2f %%), ever %zu; %zu of %zu keyframes have no mask\n",
              purity.on_people, purity.landmarks, purity.OnPeoplePercent(), purity.ever_on_people,
              purity.keyframes_unjudged, purity.keyframes);
  if (a.json.empty()) return;
  std::ofstream file(a.json, std::ios::binary);
  file << dmslam::PurityJson(purity);
  file.flush();
  if (!file)
    throw dmslam::InputError(a.json + ": cannot be written; check that the folder exists and has space");
}

int Run(const Arguments& a) {
  if (a.log.empty())
    throw dmslam::InputError("give --log FILE, or one of list, merge, diff, split and landmark (see --help)");
  for (const std::string& file : {a.ply, a.trajectory, a.online, a.keyframes, a.save, a.json}) {
    if (!file.empty()) dmslam::CheckFolderOf(file);
  }
  const std::optional<dmslam::BusKey> key = dmslam::BusKey::LoadIfWanted(a.key);
  if (a.channels) return ListChannels(a.log, key);
  const dmslam::LogIndex log(a.log, key);
  if (!log.DescribeDamage().empty()) dmslam::LogWarning("{}", log.DescribeDamage());
  const dmslam::RecordedSession& session = log.Session(a.session);
  const int64_t until_us = a.at_s < 0 ? INT64_MAX : log.begin_us() + std::llround(a.at_s * 1e6);
  const dmslam::RebuiltMap rebuilt = dmslam::RebuildMap(log, session, until_us);
  if (rebuilt.missing > 0) {
    dmslam::LogWarning("{}: {} map records are missing; what they said is lost, {} references lead nowhere",
                       a.log, rebuilt.missing, rebuilt.skipped);
  }
  dmslam::TrajectoryBuilder builder(rebuilt.session.camera, rebuilt.session.pyramid);
  builder.SetMap(rebuilt.map);
  if (const int64_t missing = AddFramePoses(log, session, until_us, &builder); missing > 0) {
    dmslam::LogWarning("{}: {} records of the frontend are missing; some frames' poses are not the last word",
                       a.log, missing);
  }
  dmslam::TrajectoryBuilder::Trajectories trajectories = builder.Build(a.camera);
  const std::optional<dmslam::MapId> map_id =
      trajectories.map_id ? trajectories.map_id : dmslam::LargestMap(rebuilt.map);
  if (!trajectories.map_id) {
    for (const auto& [id, keyframe] : rebuilt.map.keyframes()) {
      if (keyframe.map_id == map_id && keyframe.camera_id == a.camera)
        trajectories.keyframes.push_back({keyframe.stamp_ns, keyframe.T_cam_world.Inverse()});
    }
    std::ranges::stable_sort(trajectories.keyframes, {}, &dmslam::StampedPose::stamp_ns);
  }
  if (!a.ply.empty()) dmslam::WriteMapPly(a.ply, rebuilt.map, map_id);
  if (!a.trajectory.empty()) dmslam::WriteTrajectory(a.trajectory, trajectories.final);
  if (!a.online.empty()) dmslam::WriteTrajectory(a.online, trajectories.online);
  if (!a.keyframes.empty()) dmslam::WriteTrajectory(a.keyframes, trajectories.keyframes);
  if (!a.save.empty()) dmslam::SaveMap(a.save, rebuilt.map, rebuilt.session, rebuilt.runs);
  Print(log, session, rebuilt, trajectories, map_id);
  if (!a.masks.empty()) Judge(a, rebuilt.map, map_id);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  dmslam::CommandLine app(
      "Rebuilds the map of a run from its log, and writes it out; joins, compares and lists saved maps; "
      "proves "
      "their landmarks.",
      "dmslam-map");
  Arguments arguments;
  CommandArguments command_arguments;
  Command command;
  Declare(app, arguments);
  DeclareCommands(app, command_arguments, command);
  if (const auto code = app.Parse(argc, argv)) return *code;
  dmslam::SetUpLog("dmslam-map");
  const bool is_diff = !command_arguments.other.empty();
  try {
    return command ? command(dmslam::BusKey::LoadIfWanted(command_arguments.key)) : Run(arguments);
  } catch (const dmslam::MisfitError& error) {
    dmslam::LogError("{}", error.what());
    return dmslam::kExitMisfit;
  } catch (const dmslam::InputError& error) {
    dmslam::LogError("{}", error.what());
    return is_diff ? 2 : dmslam::kExitInput;
  } catch (const std::exception& error) {
    dmslam::LogError("stopped by an internal error: {}", error.what());
    return dmslam::kExitInternal;
  }
}
