#include "dmslam/recording/checkpoint.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <vector>

#include "dmslam/recording/journal.h"
#include "dmslam/recording/set_aside.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

std::string NewPath(const std::string& path) { return path + ".new"; }

}  // namespace

std::string CheckpointPath(const std::string& folder) { return folder + "/checkpoint.lcmlog"; }
std::string FormerCheckpointPath(const std::string& path) { return path + ".former"; }

// ---- When

CheckpointSchedule::CheckpointSchedule(double every_s)
    : every_ns_(static_cast<int64_t>(std::llround(every_s * 1e9))) {}

void CheckpointSchedule::OnMap(uint64_t version, std::optional<int64_t> stamp_ns, int64_t now_ns) {
  newest_ = {now_ns, stamp_ns};
  version_ = version;
  if (!changed_ && begun_version_ != version) changed_ = newest_;
}

/// Of the oldest change that is on no disk, when what is begun now will be there.
int64_t CheckpointSchedule::Age() const {
  int64_t age = newest_.now_ns - changed_->now_ns;
  if (newest_.stamp_ns && changed_->stamp_ns) age = std::max(age, *newest_.stamp_ns - *changed_->stamp_ns);
  return age + std::min(duration_ns_, every_ns_ / 2);
}

bool CheckpointSchedule::Due() const {
  if (every_ns_ == 0 || writing_ || !changed_) return false;
  if (retry_ns_ && newest_.now_ns < *retry_ns_) return false;
  return !any_ || Age() >= every_ns_;
}

int64_t CheckpointSchedule::deadline_ns() const {
  if (every_ns_ == 0 || writing_ || !changed_) return INT64_MAX;
  const int64_t due_ns =
      any_ ? changed_->now_ns + every_ns_ - std::min(duration_ns_, every_ns_ / 2) : INT64_MIN;
  return std::max(due_ns, retry_ns_.value_or(due_ns));
}

void CheckpointSchedule::OnBegun() {
  writing_ = true;
  begun_version_ = version_;
  begun_changed_ = changed_.value_or(newest_);
  begun_ns_ = newest_.now_ns;
  changed_.reset();
}

void CheckpointSchedule::OnEnded(bool written, int64_t now_ns) {
  writing_ = false;
  duration_ns_ = now_ns - begun_ns_;
  if (written) {
    any_ = true;
    retry_ns_.reset();
    return;
  }
  changed_ = begun_changed_;
  begun_version_.reset();
  retry_ns_ = now_ns + every_ns_;
}

// ---- How

void WriteCheckpoint(const std::string& path, const CutMap& map, const SessionStart& session) {
  const std::string fresh = NewPath(path);
  std::error_code error;
  try {
    SaveMap(fresh, map, session, {{session.session, session}});
  } catch (const InputError&) {
    fs::remove(fresh + ".part", error);
    fs::remove(fresh, error);
    throw;
  }
  // At no time is there none: a second name for the one that is there, before the first is taken from it.
  const std::string former = FormerCheckpointPath(path);
  fs::remove(former, error);
  fs::create_hard_link(path, former, error);
  if (error && fs::exists(path)) fs::rename(path, former, error);  // this disk knows no second names
  if (!RenameDurably(fresh, path))
    throw InputError(path + ": cannot be written (" + std::strerror(errno) + "); check the folder");
}

FoundCheckpoint FindCheckpoint(const std::string& path, uint32_t session,
                               const std::shared_ptr<FeatureStore>& features) {
  FoundCheckpoint found;
  for (const std::string& candidate : {path, FormerCheckpointPath(path)}) {
    if (!fs::exists(candidate)) continue;
    try {
      RebuiltMap map = LoadMap(candidate, std::nullopt, features);
      if (map.session.session != session) continue;
      found.map = std::move(map);
      found.path = candidate;
      return found;
    } catch (const InputError& error) {
      if (found.problem.empty()) found.problem = error.what();
    }
  }
  if (found.problem.empty()) found.problem = path + ": there is no checkpoint of this run";
  return found;
}

std::optional<std::string> SetFormerRunAside(const std::string& folder, int64_t session, bool begins) {
  const std::string journal = JournalPath(folder), newest = CheckpointPath(folder);
  const std::optional<int64_t> there = Journal::SessionOf(journal);
  if (!there || (*there == session && !begins)) return std::nullopt;
  std::vector<std::string> names;
  for (const std::string& path : {newest, FormerCheckpointPath(newest), journal})
    names.push_back(fs::path(path).filename().string());
  return SetAside(folder, *there, names);
}

void RemoveCheckpoints(const std::string& path) {
  std::error_code ignored;
  for (const std::string& name : {FormerCheckpointPath(path), path, NewPath(path), NewPath(path) + ".part"})
    fs::remove(name, ignored);
}

}  // namespace dmslam
