#include "run/resume.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "dmslam/recording/checkpoint.h"
#include "dmslam/recording/journal.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"
#include "dmslam/wire/codec.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::string RunFile(const std::string& out) { return out + "/run.json"; }

/// The newest frame of the journal; nothing where there is no journal of the session.
struct JournalState {
  bool there = false;
  std::optional<uint32_t> last_frame;
};

JournalState ReadJournal(const std::string& out, uint32_t session) {
  JournalState state;
  const auto take = [&](std::span<const uint8_t> record) {
    const auto pose = wire::Decode<FramePose>(record);
    if (!pose || pose->state == TrackingState::kLocalizedLater) return;
    state.last_frame = std::max(state.last_frame.value_or(0), pose->frame_index);
  };
  state.there = Journal::Read(out + "/collector.journal", session, take);
  return state;
}

/// Measured: a map of 10 MB is with everybody 1.3 s after it is asked for, on two busy cores.
double LeadFor(const std::string& checkpoint) {
  const double megabytes = static_cast<double>(fs::file_size(checkpoint)) * 1e-6;
  return 1.0 + 0.2 * megabytes;
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

ResumePoint FindResumePoint(const std::string& out, const RunIdentity& identity) {
  const JournalState journal = ReadJournal(out, identity.session);
  if (!journal.there) {
    throw InputError(out + (fs::exists(out + "/summary.json")
                                ? ": this run has ended, and its results are there; nothing is left to resume"
                                : ": this run died before its first frame; begin it anew"));
  }
  const FoundCheckpoint found = FindCheckpoint(CheckpointPath(out), identity.session);
  if (!found.map) {
    throw InputError(found.problem +
                     "; it died before there was a map, or ran with collector.checkpoint_s=0: begin it anew");
  }
  ResumePoint point{identity.session, journal.last_frame, found.map->map.keyframes().size(),
                    LeadFor(found.path), ""};
  if (!found.problem.empty()) point.warning = found.problem + "; goes on from " + found.path;
  return point;
}

}  // namespace dmslam
