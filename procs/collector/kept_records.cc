#include "collector/kept_records.h"

#include <sstream>

#include "dmslam/console/log.h"

namespace dmslam {
namespace {

constexpr int64_t kSayAgainNs = 30'000'000'000;

}  // namespace

void KeptRecords::ReadNote(std::istream& text, CameraId num_cameras) {
  if (CameraId camera = 0; text >> camera && camera < num_cameras)
    text >> safe_[camera].epoch >> safe_[camera].seq;
}

std::optional<std::string> KeptRecords::Keep(const Record& record, int64_t now_ns) {
  journal_.Append(*record.bytes);
  if (journal_.complete() || say_again_ns_) return std::nullopt;
  say_again_ns_ = now_ns + kSayAgainNs;
  LogError("{}; the run goes on, and frame poses wait in memory, not acknowledged, until there is room",
           journal_.problem());
  return journal_.problem();
}

void KeptRecords::NotePosition(CameraId camera, const Version& taken) {
  if (taken == safe_[camera]) return;
  std::ostringstream note;
  note << "taken " << camera << ' ' << taken.epoch << ' ' << taken.seq;
  journal_.AppendNote(note.str());
  safe_[camera] = taken;
}

void KeptRecords::Retry(int64_t now_ns) {
  if (!say_again_ns_) return;
  const int64_t waiting = journal_.pending();
  if (journal_.Flush()) {
    say_again_ns_.reset();
    LogInfo("the disk takes frame poses again: all that waited are written");
  } else if (now_ns >= *say_again_ns_) {
    say_again_ns_ = now_ns + kSayAgainNs;
    LogWarning("{} frame poses wait for room on the disk", waiting);
  }
}

Version KeptRecords::PositionOf(CameraId camera) const {
  const auto found = safe_.find(camera);
  return found == safe_.end() ? Version() : found->second;
}

}  // namespace dmslam
