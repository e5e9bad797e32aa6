#include "collector/checkpointer.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

/// Why it failed; empty: it did not.
std::string ProblemOf(const std::function<void()>& write) {
  try {
    write();
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

Checkpointer::Checkpointer(Options options, std::unique_ptr<CoreThread> thread, Journal* journal)
    : options_(std::move(options)),
      schedule_(options_.every_s),
      journal_(journal),
      thread_(std::move(thread)) {}

Checkpointer::~Checkpointer() = default;

void Checkpointer::OnMap(const Map& map, bool whole, std::optional<int64_t> newest_stamp_ns,
                         const std::optional<SessionStart>& session) {
  if (map.keyframes().empty()) return;  // an empty map takes no other one's place
  schedule_.OnMap(map.version(), newest_stamp_ns, options_.now_ns());
  if (!schedule_.Due()) return;
  if (whole && session && thread_->Idle()) return Begin(map, *session);
  look_again_ns_ = options_.now_ns() + kLookAgainNs;
}

void Checkpointer::Begin(const Map& map, const SessionStart& session) {
  Copied copied;
  copied.begun_ns = options_.now_ns();
  const auto cut = std::make_shared<const CutMap>(Cut(options_.path, map));
  copied.ended_ns = options_.now_ns();
  copied.keyframes = map.keyframes().size();
  copied.landmarks = map.num_landmarks();
  schedule_.OnBegun();
  thread_->Post([this, copied, cut, session] {
    const std::string problem = ProblemOf([&] {
      journal_->Sync();
      WriteCheckpoint(options_.path, *cut, session);
    });
    thread_->Report([this, copied, problem] { OnEnded(copied, problem); });
  });
}

void Checkpointer::OnEnded(const Copied& copied, const std::string& problem) {
  const int64_t now_ns = options_.now_ns();
  schedule_.OnEnded(problem.empty(), now_ns);
  if (problem.empty()) {
    ++written_;
    LogInfo("checkpoint of {} keyframes and {} landmarks: copied in {:.1f} ms, on the disk {:.1f} ms later",
            copied.keyframes, copied.landmarks, static_cast<double>(copied.ended_ns - copied.begun_ns) * 1e-6,
            static_cast<double>(now_ns - copied.ended_ns) * 1e-6);
  } else {
    Warn(problem);
  }
}

/// Once: the disk that refuses one refuses the next.
void Checkpointer::Warn(const std::string& problem) {
  if (!problem.empty() && !std::exchange(warned_, true)) problem_ = problem;
}

void Checkpointer::SyncJournal() {
  if (!thread_->Idle()) return;
  thread_->Post([this] {
    const std::string problem = ProblemOf([&] { journal_->Sync(); });
    thread_->Report([this, problem] { Warn(problem); });
  });
}

int64_t Checkpointer::deadline_ns() const {
  const int64_t due_ns = schedule_.deadline_ns();
  return due_ns == INT64_MAX ? due_ns : std::max(due_ns, look_again_ns_.value_or(due_ns));
}

void Checkpointer::Finish() { thread_->Finish(); }

bool Checkpointer::WriteLast(const Map& map, bool whole, const std::optional<SessionStart>& session) {
  thread_->Finish();
  if (whole && session && !map.keyframes().empty() && schedule_.HasUnsaved()) {
    Begin(map, *session);
  } else {
    SyncJournal();
  }
  thread_->Finish();
  return !schedule_.HasUnsaved();
}

std::string Checkpointer::TakeProblem() { return std::exchange(problem_, ""); }

}  // namespace dmslam
