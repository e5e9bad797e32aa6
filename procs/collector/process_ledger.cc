#include "collector/process_ledger.h"

#include <algorithm>
#include <sstream>

#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/node.h"

namespace dmslam {
namespace {

constexpr int64_t ProcessHealth::*kHealthCounters[] = {
    &ProcessHealth::dropped_foreign,  &ProcessHealth::dropped_malformed, &ProcessHealth::dropped_checksum,
    &ProcessHealth::records_repaired, &ProcessHealth::records_lost,      &ProcessHealth::repairs_requested,
    &ProcessHealth::resent,           &ProcessHealth::resent_bytes,      &ProcessHealth::written,
    &ProcessHealth::written_bytes};
constexpr int64_t FrontendStatus::*kFrontendCounters[] = {
    &FrontendStatus::frames_received,    &FrontendStatus::frames_processed,
    &FrontendStatus::frames_skipped,     &FrontendStatus::keyframes_proposed,
    &FrontendStatus::keyframes_withheld, &FrontendStatus::relocalisations};
constexpr int64_t kSilentNs = kStatusEveryNs * 3 / 2;  // who lives says so in every status
constexpr size_t kMostNewcomers = 16;

}  // namespace

bool ProcessLedger::Hear(const std::string& process, const ProcessHealth& heard, size_t keyframes,
                         int64_t now_ns) {
  if (!OnProcess(process, heard, now_ns)) return false;
  ProcessHealth& health = run_->health[process];
  const ProcessHealth& former = processes_[process].former;
  const double largest = std::max(health.rss_mb, heard.rss_mb);
  run_->memory[process].Add({keyframes, heard.rss_mb});
  health = heard;
  health.rss_mb = largest;
  for (int64_t ProcessHealth::*counter : kHealthCounters) health.*counter += former.*counter;
  return true;
}

void ProcessLedger::HearFrontend(const std::string& process, FrontendStatus status, size_t keyframes,
                                 int64_t now_ns) {
  if (!Hear(process, status.head.health, keyframes, now_ns)) return;
  for (int64_t FrontendStatus::*counter : kFrontendCounters)
    status.*counter += processes_[process].former_frontend.*counter;
  run_->cameras[status.camera_id].frontend = std::move(status);
}

/// Whoever is started again listens before it writes, and so does a rival: which it is shows when the present
/// one is heard again, or is not.
bool ProcessLedger::IsHeldBack(const ProcessHealth& heard, int64_t now_ns, Followed* known) {
  const bool is_present = known->present && known->present->pid == heard.pid;
  if (is_present) known->newcomers.clear();
  const bool writes = known->present && known->present->epoch != 0;
  if (is_present || !writes || heard.epoch != 0 || now_ns - known->present_ns > kSilentNs) {
    known->present = heard;
    known->present_ns = now_ns;
    return false;
  }
  std::erase_if(known->newcomers, [&](const ProcessHealth& other) { return other.pid == heard.pid; });
  if (known->newcomers.size() < kMostNewcomers) known->newcomers.push_back(heard);
  return true;
}

bool ProcessLedger::OnProcess(const std::string& process, const ProcessHealth& heard, int64_t now_ns) {
  if (!note_) {
    heard_early_[{process, heard.pid}] = heard;
    return true;
  }
  Followed& known = processes_[process];
  if (IsHeldBack(heard, now_ns, &known)) return false;
  for (const ProcessHealth& newcomer : std::exchange(known.newcomers, {}))
    Count(process, newcomer, now_ns);  // it has died, too
  Count(process, heard, now_ns);
  return true;
}

/// A process is heard; where another one of its name was before it, that one's counters are kept.
void ProcessLedger::Count(const std::string& process, const ProcessHealth& heard, int64_t now_ns) {
  if (processes_[process].instances.IsNew(heard, now_ns)) {
    NoteProcess(process, heard);
  } else if (heard.epoch != 0 && processes_[process].noted_epoch == 0) {
    NoteHeard(process, heard);
  }
}

void ProcessLedger::NoteProcess(const std::string& process, const ProcessHealth& heard) {
  Followed& known = processes_[process];
  std::string note = "process " + process + " " + std::to_string(heard.pid);
  if (++known.count > 1) {
    ++run_->restarts;
    known.former = run_->health[process];
    if (const FrontendStatus* frontend = FrontendOf(process)) known.former_frontend = *frontend;
    note += CountersOf(process);
  }
  note_(note);
  NoteHeard(process, heard);
}

/// How long it has run [ms] and its term of office: what tells it from one that comes after it with its id.
void ProcessLedger::NoteHeard(const std::string& process, const ProcessHealth& heard) {
  processes_[process].noted_epoch = heard.epoch;
  std::ostringstream note;
  note << "heard " << process << ' ' << heard.pid << ' ' << static_cast<int64_t>(heard.uptime_s * 1e3) << ' '
       << heard.epoch;
  note_(note.str());
}

std::string ProcessLedger::CountersOf(const std::string& process) const {
  std::ostringstream text;
  const ProcessHealth& health = run_->health.at(process);
  for (int64_t ProcessHealth::*counter : kHealthCounters) text << ' ' << health.*counter;
  if (const FrontendStatus* frontend = FrontendOf(process))
    for (int64_t FrontendStatus::*counter : kFrontendCounters) text << ' ' << frontend->*counter;
  return text.str();
}

/// What is known of the frontend that is called so; null: it is none.
FrontendStatus* ProcessLedger::FrontendOf(const std::string& process) const {
  for (CameraId camera = 0; camera < run_->cameras.size(); ++camera) {
    if (process == OfCamera(roles::kFrontend, camera)) return &run_->cameras[camera].frontend;
  }
  return nullptr;
}

/// This process is another one than the collector before it, whatever its id.
void ProcessLedger::Begin(Note note, const ProcessHealth& own, int64_t now_ns) {
  note_ = std::move(note);
  Followed& known = processes_[roles::kCollector];
  known.former = run_->health[roles::kCollector];
  known.instances.IsNew(own, now_ns);
  NoteProcess(roles::kCollector, own);
  for (const auto& [key, health] : std::exchange(heard_early_, {})) OnProcess(key.first, health, now_ns);
}

void ProcessLedger::NoteCounters() {
  for (const auto& [process, health] : run_->health) {
    note_("counters " + process + " " + std::to_string(health.pid) + CountersOf(process));
    NoteHeard(process, health);
  }
}

void ProcessLedger::ReadNote(const std::string& kind, std::istream& text, int64_t now_ns) {
  std::string process;
  int32_t pid = 0;
  if (!(text >> process >> pid)) return;
  if (kind == "process") ReadProcess(process, pid, text, now_ns);
  if (kind == "counters") ReadCounters(process, pid, text);
  int64_t uptime_ms = 0, epoch = 0;
  if (kind != "heard" || !(text >> uptime_ms >> epoch)) return;
  InstanceWatch::Noted noted{static_cast<double>(uptime_ms) * 1e-3, std::nullopt};
  if (epoch != 0) noted.epoch = epoch;  // it was no writer when it was noted
  processes_[process].instances.Know(pid, now_ns, noted);
}

void ProcessLedger::ReadProcess(const std::string& process, int32_t pid, std::istream& text, int64_t now_ns) {
  Followed& known = processes_[process];
  known.instances.Know(pid, now_ns, {});
  if (++known.count > 1) ++run_->restarts;
  for (int64_t ProcessHealth::*counter : kHealthCounters) text >> known.former.*counter;
  if (FrontendOf(process) == nullptr) return;
  for (int64_t FrontendStatus::*counter : kFrontendCounters) text >> known.former_frontend.*counter;
}

void ProcessLedger::ReadCounters(const std::string& process, int32_t pid, std::istream& text) {
  ProcessHealth& health = run_->health[process];
  health.pid = pid;
  for (int64_t ProcessHealth::*counter : kHealthCounters) text >> health.*counter;
  FrontendStatus* frontend = FrontendOf(process);
  if (frontend == nullptr) return;
  for (int64_t FrontendStatus::*counter : kFrontendCounters) text >> frontend->*counter;
}

}  // namespace dmslam
