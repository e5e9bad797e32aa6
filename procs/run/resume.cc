#include "run/resume.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <utility>

#include "dmslam/recording/checkpoint.h"
#include "dmslam/recording/frame_memory.h"
#include "dmslam/recording/journal.h"
#include "dmslam/recording/set_aside.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr char kRunFile[] = "run.json";
std::string RunFile(const std::string& out) { return out + "/" + kRunFile; }

std::string NameOf(const std::string& path) { return fs::path(path).filename().string(); }

/// What the journal says of how far a run had come.
class JournalState {
 public:
  JournalState(const std::string& out, uint32_t session) {
    there_ = Journal::Read(
        JournalPath(out), session, [this](std::span<const uint8_t> record) { Take(record); },
        [this](const std::string& note) { ReadNote(note); });
    if (!life_.last_frame) life_ = former_life_;  // it died again before its first frame
  }
  bool there() const { return there_; }
  std::optional<uint32_t> last_frame() const { return last_frame_; }

  /// Of the newest life: the frame before its first keyframe that `map` lacks, or its newest frame.
  std::optional<uint32_t> LastFrameIn(const Map& map, std::optional<uint32_t> newest_keyframe) const {
    std::optional<uint32_t> last = life_.last_frame;
    for (const auto& [id, map_id] : life_.proposed) {
      const bool made = map.HasKnown(id) || (newest_keyframe && id.frame_index() <= *newest_keyframe);
      if (!last || made || dropped_.contains(map_id) || id.frame_index() == 0) continue;
      last = std::min(*last, id.frame_index() - 1);
    }
    return last;
  }

 private:
  /// From when the processes were begun, or resumed, until they all died.
  struct Life {
    std::optional<uint32_t> last_frame;
    std::map<KeyframeId, MapId> proposed;
  };
  void Take(std::span<const uint8_t> record) {
    if (const auto reset = wire::Decode<MapReset>(record); reset && reset->fate == MapReset::Fate::kDrop)
      dropped_.insert(reset->map_id);
    const auto pose = wire::Decode<FramePose>(record);
    if (!pose || pose->state == TrackingState::kLocalizedLater) return;
    last_frame_ = std::max(last_frame_.value_or(0), pose->frame_index);
    life_.last_frame = std::max(life_.last_frame.value_or(0), pose->frame_index);
  }
  void ReadNote(const std::string& text) {
    std::istringstream note(text);
    std::string kind;
    uint64_t keyframe = 0;
    MapId map_id = 0;
    note >> kind;
    if (kind == "keyframe" && note >> keyframe >> map_id) life_.proposed[KeyframeId{keyframe}] = map_id;
    if (kind == "dropped" && note >> map_id) dropped_.insert(map_id);
    if (kind != "resumed" || !life_.last_frame) return;
    former_life_ = std::exchange(life_, {});
  }

  bool there_ = false;
  std::optional<uint32_t> last_frame_;
  Life life_, former_life_;
  std::set<MapId> dropped_;
};

/// A mapper reads some 50 MB a second, and publishes a part of 56 KB every 3 ms; with room for a busy host.
double LeadFor(const std::string& checkpoint) {
  const double megabytes = static_cast<double>(fs::file_size(checkpoint)) * 1e-6;
  return 2.0 + 0.2 * megabytes;
}

}  // namespace

void RunIdentity::Write(const std::string& out) const {
  const Json json = {{"version", BuildVersion()}, {"session", session}, {"folder", folder},
                     {"arguments", arguments},    {"pid", pid},         {"resumed", resumed}};
  WriteFile(RunFile(out), json.dump(2) + "\n");
}

RunIdentity RunIdentity::Read(const std::string& out) {
  std::ifstream file(RunFile(out));
  if (!file) throw InputError(RunFile(out) + ": is not there; --resume needs the --out folder of a run");
  try {
    const Json json = Json::parse(file);
    RunIdentity run;
    run.session = json.at("session").get<uint32_t>();
    run.folder = json.at("folder").get<std::string>();
    run.arguments = json.at("arguments").get<std::vector<std::string>>();
    run.pid = json.at("pid").get<int64_t>();
    run.resumed = json.at("resumed").get<int>();
    return run;
  } catch (const Json::exception& error) {
    throw InputError(RunFile(out) + ": cannot be read (" + error.what() + "); begin the run anew");
  }
}

RunLock::RunLock(const std::string& out) : fd_(open(out.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (fd_ < 0 || flock(fd_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  close(fd_);
  std::string who = "another dmslam-run";
  if (fs::exists(RunFile(out))) who += " (pid " + std::to_string(RunIdentity::Read(out).pid) + ")";
  throw InputError(out + ": " + who + " is alive and writes there; stop it, or choose another folder");
}

RunLock::~RunLock() {
  if (fd_ >= 0) close(fd_);
}

/// A run that has ended has removed its journal and its checkpoints; one that died before there was a
/// checkpoint cannot be resumed.
std::optional<std::string> KeepUnfinishedRun(const std::string& out) {
  const std::string newest = CheckpointPath(out), former = FormerCheckpointPath(newest);
  if (!fs::exists(RunFile(out)) || (!fs::exists(newest) && !fs::exists(former))) return std::nullopt;
  const std::optional<int64_t> session = Journal::SessionOf(JournalPath(out));
  if (!session || *session != RunIdentity::Read(out).session) return std::nullopt;
  return SetAside(
      out, *session,
      {kRunFile, NameOf(newest), NameOf(former), NameOf(JournalPath(out)), NameOf(FrameMemoryPath(out))});
}

ResumePoint FindResumePoint(const std::string& out, const RunIdentity& identity) {
  const JournalState journal(out, identity.session);
  if (!journal.there()) {
    throw InputError(
        out + (fs::exists(out + "/summary.json")
                   ? ": this run has ended, and its results are there; nothing is left to resume"
                   : ": it holds no " + NameOf(JournalPath(out)) +
                         ": this run died before its first frame, or the file was removed; begin it anew"));
  }
  Journal::Sync(JournalPath(out));  // those who wrote it may have died before they did
  const FoundCheckpoint found = FindCheckpoint(CheckpointPath(out), identity.session);
  if (!found.map) {
    throw InputError(found.problem +
                     "; where no checkpoint is damaged, the run died before there was a map or had "
                     "collector.checkpoint_s=0: begin it anew");
  }
  const auto& keyframes = found.map->map.keyframes();
  ResumePoint point;
  point.session = identity.session;
  point.last_frame = journal.last_frame();
  point.keyframes = keyframes.size();
  const KeyframeId newest = keyframes.rbegin()->first;
  if (newest.session() == identity.session) point.newest_keyframe = newest.frame_index();
  point.play_behind = journal.LastFrameIn(found.map->map, point.newest_keyframe);
  point.lead_s = LeadFor(found.path);
  if (!found.problem.empty()) point.warning = found.problem + "; goes on from " + found.path;
  return point;
}

}  // namespace dmslam
